//! A data sheet of our own, of any size: for comparisons without a corpus, and for the memory of large files.

use std::fmt::Write;

/// About as many bytes as asked for, always the same. The objects are of the kinds that real data sheets have:
/// plain ones, records and arrays, with limits and without.
pub(super) fn data_sheet(bytes: usize) -> String {
    let mut objects = Objects::default();
    objects.communication();
    for index in 0x2000..=0x5FFF {
        if objects.sections.len() + objects.manufacturer.len() * 10 >= bytes {
            break;
        }
        objects.manufacturer(index);
    }
    objects.finish()
}

#[derive(Default)]
struct Objects {
    sections: String,
    optional: Vec<u16>,
    manufacturer: Vec<u16>,
}

/// What a value is: name, type, access right and default.
type Fact<'a> = (&'a str, u8, &'a str, &'a str);

const U8: u8 = 0x05;
const U16: u8 = 0x06;
const U32: u8 = 0x07;
const I32: u8 = 0x04;
const TEXT: u8 = 0x09;

impl Objects {
    fn communication(&mut self) {
        self.variable(0x1000, ("Device type", U32, "ro", "0x00020192"));
        self.variable(0x1001, ("Error register", U8, "ro", "0"));
        self.parent(0x1018, "Identity object", 0x09, 5);
        let identity: [Fact<'_>; 5] = [
            ("Number of entries", U8, "ro", "4"),
            ("Vendor-ID", U32, "ro", "0x000001FF"),
            ("Product code", U32, "ro", "0x00000001"),
            ("Revision number", U32, "ro", "0x00010001"),
            ("Serial number", U32, "ro", "0"),
        ];
        for (sub, fact) in (0..).zip(identity) {
            self.member(0x1018, sub, fact);
        }
        self.variable(0x1017, ("Producer heartbeat time", U16, "rw", "1000"));
        self.optional.push(0x1017);
    }

    /// Of eight objects, five are plain, two are records and one is an array.
    fn manufacturer(&mut self, index: u16) {
        self.manufacturer.push(index);
        let name = format!("Parameter {index:04X}");
        match index % 8 {
            3 | 6 => {
                self.parent(index, &name, 0x09, 4);
                self.member(index, 0, ("Number of entries", U8, "ro", "3"));
                self.member(index, 1, ("Gain", U16, "rw", "100"));
                self.member(index, 2, ("Position", I32, "rw", "-250000"));
                self.member(index, 3, ("Status word", U16, "ro", "0x0000"));
            }
            5 => {
                self.parent(index, &name, 0x08, 9);
                self.member(index, 0, ("Number of entries", U8, "ro", "8"));
                for sub in 1..9 {
                    self.member(index, sub, (&format!("Point {sub}"), I32, "rw", "0"));
                }
            }
            7 => self.variable(index, (&name, TEXT, "rw", "text of some length")),
            _ => self.variable(index, (&name, U16, "rw", "0x0010")),
        }
    }

    fn variable(&mut self, index: u16, fact: Fact<'_>) {
        let _ = write!(self.sections, "[{index:X}]\r\n");
        self.value(fact);
    }

    fn member(&mut self, index: u16, sub: u8, fact: Fact<'_>) {
        let _ = write!(self.sections, "[{index:X}sub{sub:X}]\r\n");
        self.value(fact);
    }

    fn parent(&mut self, index: u16, name: &str, object_type: u8, members: u8) {
        let _ = write!(
            self.sections,
            "[{index:X}]\r\nParameterName={name}\r\nObjectType=0x{object_type:X}\r\nSubNumber={members}\r\n\r\n"
        );
    }

    fn value(&mut self, (name, data_type, access, default): Fact<'_>) {
        let _ = write!(
            self.sections,
            "ParameterName={name}\r\nObjectType=0x7\r\nDataType=0x{data_type:04X}\r\nAccessType={access}\r\n\
             DefaultValue={default}\r\nPDOMapping=0\r\n"
        );
        if data_type == I32 && access == "rw" {
            self.sections.push_str("LowLimit=-2000000\r\nHighLimit=2000000\r\n");
        }
        self.sections.push_str("\r\n");
    }

    fn finish(self) -> String {
        let mut text = String::from(
            "[FileInfo]\r\nFileName=bench.eds\r\nFileVersion=1\r\nFileRevision=0\r\nEDSVersion=4.0\r\n\
             Description=Synthesised for a benchmark\r\nCreationTime=08:00AM\r\nCreationDate=01-01-2026\r\n\
             CreatedBy=bench\r\nModificationTime=08:00AM\r\nModificationDate=01-01-2026\r\nModifiedBy=bench\r\n\r\n\
             [DeviceInfo]\r\nVendorName=None\r\nVendorNumber=0x1FF\r\nProductName=Bench\r\nProductNumber=1\r\n\
             RevisionNumber=0x10001\r\nOrderCode=1\r\nBaudRate_10=0\r\nBaudRate_20=0\r\nBaudRate_50=0\r\n\
             BaudRate_125=1\r\nBaudRate_250=1\r\nBaudRate_500=1\r\nBaudRate_800=0\r\nBaudRate_1000=1\r\n\
             SimpleBootUpMaster=0\r\nSimpleBootUpSlave=1\r\nGranularity=8\r\nDynamicChannelsSupported=0\r\n\
             GroupMessaging=0\r\nNrOfRXPDO=0\r\nNrOfTXPDO=0\r\nLSS_Supported=0\r\n\r\n\
             [DummyUsage]\r\nDummy0001=0\r\nDummy0002=0\r\nDummy0003=0\r\nDummy0004=0\r\nDummy0005=0\r\n\
             Dummy0006=0\r\nDummy0007=0\r\n\r\n[Comments]\r\nLines=0\r\n\r\n",
        );
        list(&mut text, "MandatoryObjects", &[0x1000, 0x1001, 0x1018]);
        list(&mut text, "OptionalObjects", &self.optional);
        list(&mut text, "ManufacturerObjects", &self.manufacturer);
        text.push_str(&self.sections);
        text
    }
}

fn list(text: &mut String, name: &str, indices: &[u16]) {
    let _ = write!(text, "[{name}]\r\nSupportedObjects={}\r\n", indices.len());
    for (number, index) in (1..).zip(indices) {
        let _ = write!(text, "{number}=0x{index:04X}\r\n");
    }
    text.push_str("\r\n");
}
