"""What the tests share: simulated devices, and a data sheet of our own."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import lexican
import pytest

# A shell that has begun the tests in the background has it ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)

SENSOR = """\
[FileInfo]
FileName=sensor.eds
FileVersion=1
FileRevision=1
EDSVersion=4.0

[DeviceInfo]
VendorName=Acme
VendorNumber=0x123
ProductName=Sensor
ProductNumber=0x7
RevisionNumber=1
BaudRate_500=1
SimpleBootUpSlave=1
Granularity=8
NrOfRXPDO=0
NrOfTXPDO=1

[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018

[1000]
ParameterName=Device type
ObjectType=7
DataType=7
AccessType=ro
DefaultValue=0x191
PDOMapping=0

[1001]
ParameterName=Error register
ObjectType=7
DataType=5
AccessType=ro
PDOMapping=0

[1018]
ParameterName=Identity object
ObjectType=9
SubNumber=3

[1018sub0]
ParameterName=Highest sub-index supported
ObjectType=7
DataType=5
AccessType=ro
DefaultValue=2

[1018sub1]
ParameterName=Vendor-ID
ObjectType=7
DataType=7
AccessType=ro
DefaultValue=0x123

[1018sub2]
ParameterName=Product code
ObjectType=7
DataType=7
AccessType=ro
DefaultValue=0x7

[OptionalObjects]
SupportedObjects=4
1=0x1014
2=0x1017
3=0x1800
4=0x1A00

[1014]
ParameterName=COB-ID EMCY
ObjectType=7
DataType=7
AccessType=rw
DefaultValue=$NODEID+0x80

[1017]
ParameterName=Producer heartbeat time
ObjectType=7
DataType=6
AccessType=rw
DefaultValue=0

[1800]
ParameterName=TPDO communication parameter
ObjectType=9
SubNumber=3

[1800sub0]
ParameterName=Highest sub-index supported
ObjectType=7
DataType=5
AccessType=ro
DefaultValue=2

[1800sub1]
ParameterName=COB-ID
ObjectType=7
DataType=7
AccessType=rw
DefaultValue=$NODEID+0x180

[1800sub2]
ParameterName=Transmission type
ObjectType=7
DataType=5
AccessType=rw
DefaultValue=1

[1A00]
ParameterName=TPDO mapping parameter
ObjectType=9
SubNumber=2

[1A00sub0]
ParameterName=Number of mapped objects
ObjectType=7
DataType=5
AccessType=ro
DefaultValue=1

[1A00sub1]
ParameterName=First mapped object
ObjectType=7
DataType=7
AccessType=ro
DefaultValue=0x20000010

[ManufacturerObjects]
SupportedObjects=3
1=0x2000
2=0x2001
3=0x2002

[2000]
ParameterName=Pressure
ObjectType=7
DataType=3
AccessType=ro
DefaultValue=-7
PDOMapping=1

[2001]
ParameterName=Calibration
ObjectType=7
DataType=0xF
AccessType=rw

[2002]
ParameterName=Name
ObjectType=7
DataType=9
AccessType=rw
DefaultValue=Sensor
"""

OVERLAY = """\
[overlay]
format = 1

[quantity.Pressure]
units = [{ symbol = "bar", method = "bar", scale = "1/100" }]

[object."2000"]
quantity = "Pressure"
"""


@pytest.fixture
def sensor(tmp_path: Path) -> Path:
    """A data sheet with a TPDO and a domain."""
    path = tmp_path / "sensor.eds"
    path.write_text(SENSOR)
    return path


@pytest.fixture
def network() -> Iterator[lexican.Machine]:
    """A simulated drive with the node-ID 1, in virtual time."""
    with lexican.simulate("siko/ag03-1") as machine:
        yield machine
