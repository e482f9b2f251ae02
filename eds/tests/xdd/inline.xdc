<?xml version="1.0" encoding="utf-8"?>
<!-- As eds-dcf-net writes: no namespace, no parameters, the node-ID with a small letter. -->
<ISO15745ProfileContainer xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
  <ISO15745Profile>
    <ProfileBody xsi:type="ProfileBody_Device_CANopen" fileName="valve.xdc" fileCreator="lexican" fileCreationDate="2026-03-01" fileVersion="1">
      <DeviceIdentity><vendorName>Nobody</vendorName><vendorID>0x195</vendorID><productName>Valve</productName><productID>7</productID></DeviceIdentity>
    </ProfileBody>
  </ISO15745Profile>
  <ISO15745Profile>
    <ProfileBody xsi:type="ProfileBody_CommunicationNetwork_CANopen">
      <ApplicationLayers>
        <CANopenObjectList>
          <CANopenObject index="1000" name="Device type" objectType="7" dataType="0007" accessType="const" defaultValue="0" PDOmapping="no"/>
          <CANopenObject index="1001" name="Error register" objectType="7" dataType="0005" accessType="ro" PDOmapping="default"/>
          <CANopenObject index="1017" name="Producer heartbeat time" objectType="7" dataType="0006" accessType="rw" defaultValue="0" actualValue="500" denotation="beat"/>
          <CANopenObject index="1018" name="Identity" objectType="9" subNumber="2">
            <CANopenSubObject subIndex="00" name="Highest sub-index" dataType="0005" accessType="const" defaultValue="1"/>
            <CANopenSubObject subIndex="01" name="Vendor-ID" dataType="0007" accessType="ro" defaultValue="0x195"/>
          </CANopenObject>
          <CANopenObject index="2000" name="Set" objectType="7" dataType="0016" accessType="rw" PDOmapping="RPDO" lowLimit="1" highLimit="9" actualValue="5"/>
          <CANopenObject index="2001" name="Got" objectType="7" dataType="000C" accessType="rw" PDOmapping="TPDO"/>
          <CANopenObject index="2002" name="Only written" objectType="7" dataType="0001" accessType="wo"/>
        </CANopenObjectList>
      </ApplicationLayers>
      <TransportLayers><PhysicalLayer><baudRate><supportedBaudRate value="500 Kbps"/></baudRate></PhysicalLayer></TransportLayers>
      <NetworkManagement>
        <CANopenGeneralFeatures granularity="8"/>
        <CANopenMasterFeatures bootUpMaster="true"/>
        <deviceCommissioning nodeID="5" nodeName="left" actualBaudRate="500 Kbps" networkNumber="2" networkName="net" CANopenManager="false"/>
      </NetworkManagement>
    </ProfileBody>
  </ISO15745Profile>
</ISO15745ProfileContainer>
