//! Writes the data sheet with all the PDOs and, beside the generated code, the list of what they map.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::{env, fs};

/// The data types of a fixed size: code, bits, the type in Rust, and whether it has a sign.
const TYPES: [(u16, u32, &str, bool); 23] = [
    (0x01, 1, "bool", false),
    (0x02, 8, "i8", true),
    (0x03, 16, "i16", true),
    (0x04, 32, "i32", true),
    (0x05, 8, "u8", false),
    (0x06, 16, "u16", false),
    (0x07, 32, "u32", false),
    (0x08, 32, "f32", false),
    (0x0C, 48, "TimeOfDay", false),
    (0x0D, 48, "TimeDifference", false),
    (0x10, 24, "I24", true),
    (0x11, 64, "f64", false),
    (0x12, 40, "I40", true),
    (0x13, 48, "I48", true),
    (0x14, 56, "I56", true),
    (0x15, 64, "i64", true),
    (0x16, 24, "U24", false),
    (0x18, 40, "U40", false),
    (0x19, 48, "U48", false),
    (0x1A, 56, "U56", false),
    (0x1B, 64, "u64", false),
    // A type that the device defines (a DEFTYPE) is an unsigned number of whole bytes.
    (0x60, 12, "u16", false),
    (0x61, 24, "U24", false),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("a build script has a folder")?);
    let mut sheet = Sheet::default();
    for (row, &(code, bits, name, signed)) in TYPES.iter().enumerate() {
        let row = row as u16;
        sheet.object(0x2000 + row, code);
        sheet.whole(row, bits, name);
        if signed {
            sheet.cut(row, bits, name);
        }
    }
    fs::write(out.join("bits.eds"), sheet.text())?;
    fs::write(out.join("cases.rs"), format!("{}}}\n", sheet.cases))?;
    lexican_codegen::Config::new().eds(out.join("bits.eds")).generate()?;
    Ok(())
}

struct Sheet {
    sections: String,
    indices: Vec<u16>,
    /// The number of PDOs: first the transmit PDOs, then the receive PDOs.
    pdos: u16,
    cases: String,
}

impl Default for Sheet {
    fn default() -> Self {
        let mut sheet = Sheet { sections: String::new(), indices: Vec::new(), pdos: 0, cases: String::new() };
        sheet.cases += "/// Looks at every field of every PDO.\n#[test]\nfn all_pdos() {\n";
        for (index, bits) in [(0x60, 12), (0x61, 24)] {
            let definition = format!("ObjectType=5\nDataType=7\nAccessType=ro\nDefaultValue={bits}\n");
            sheet.section(&format!("{index:04X}"), "Definition", &definition);
            sheet.indices.push(index);
        }
        sheet
    }
}

impl Sheet {
    /// An array with as many elements as fields of one bit fit into a frame.
    fn object(&mut self, index: u16, code: u16) {
        self.indices.push(index);
        self.section(&format!("{index:04X}"), &format!("Values {index:04X}"), "ObjectType=8\nSubNumber=65\n");
        self.section(&format!("{index:04X}sub0"), "n", "DataType=5\nAccessType=ro\nDefaultValue=64\n");
        for sub in 1..=64 {
            let keys = format!("DataType=0x{code:02X}\nAccessType=rw\nPDOMapping=1\n");
            self.section(&format!("{index:04X}sub{sub:X}"), &format!("Value {sub}"), &keys);
        }
    }

    /// PDOs in which the type is at every offset: several in a row, from each of the first offsets on.
    fn whole(&mut self, row: u16, bits: u32, name: &str) {
        for first in 0..bits.min(65 - bits) {
            let fields = (64 - first) / bits;
            self.pdo(row, name, first, &vec![bits; fields as usize]);
        }
    }

    /// PDOs in which the type has all smaller lengths.
    fn cut(&mut self, row: u16, bits: u32, name: &str) {
        for first in [0, 1, 5] {
            let mut lengths = Vec::new();
            for length in 1..bits {
                if first + length + lengths.iter().sum::<u32>() > 64 {
                    self.pdo(row, name, first, &std::mem::take(&mut lengths));
                }
                if first + length <= 64 {
                    lengths.push(length);
                }
            }
            self.pdo(row, name, first, &lengths);
        }
    }

    /// A PDO with a gap of `first` bits and then fields of these lengths.
    fn pdo(&mut self, row: u16, name: &str, first: u32, lengths: &[u32]) {
        if lengths.is_empty() {
            return;
        }
        let (base, what, number) =
            if self.pdos < 512 { (0x1800, "Tpdo", self.pdos) } else { (0x1400, "Rpdo", self.pdos - 512) };
        assert!(number < 512, "there are no more PDOs");
        self.pdos += 1;
        let gap = (first > 0).then(|| format!("0x000100{first:02X}"));
        let fields = (1..).zip(lengths).map(|(sub, bits)| format!("0x{:04X}{sub:02X}{bits:02X}", 0x2000 + row));
        let words: Vec<String> = gap.into_iter().chain(fields).collect();
        for (index, count) in [(base + number, 1), (base + 0x200 + number, words.len())] {
            self.indices.push(index);
            self.section(
                &format!("{index:04X}"),
                &format!("Parameter {index:04X}"),
                &format!("ObjectType=9\nSubNumber={}\n", count + 1),
            );
            self.section(
                &format!("{index:04X}sub0"),
                "n",
                &format!("DataType=5\nAccessType=rw\nDefaultValue={count}\n"),
            );
        }
        self.section(
            &format!("{:04X}sub1", base + number),
            "COB-ID",
            "DataType=7\nAccessType=rw\nDefaultValue=0x80000000\n",
        );
        for (word, sub) in words.iter().zip(1..) {
            let keys = format!("DataType=7\nAccessType=rw\nDefaultValue={word}\n");
            self.section(&format!("{:04X}sub{sub:X}", base + 0x200 + number), &format!("Mapped {sub}"), &keys);
        }
        let mut low = first;
        for (bits, sub) in lengths.iter().zip(1..) {
            let pdo = format!("od::{what}{}", number + 1);
            let _ = writeln!(self.cases, "    case!({pdo}, value_{sub}: {name}, {low}, {bits});");
            low += bits;
        }
    }

    fn section(&mut self, section: &str, name: &str, keys: &str) {
        let _ = writeln!(self.sections, "[{section}]\nParameterName={name}\n{keys}");
    }

    fn text(&self) -> String {
        let mut list = format!("[OptionalObjects]\nSupportedObjects={}\n", self.indices.len());
        for (number, index) in (1..).zip(&self.indices) {
            let _ = writeln!(list, "{number}=0x{index:04X}");
        }
        format!("[DeviceInfo]\nGranularity=1\n{list}\n{}", self.sections)
    }
}
