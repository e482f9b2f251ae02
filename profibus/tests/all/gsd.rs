//! GSD files: what a master takes from them, and what is refused, with what there is.

use std::path::Path;

use lexican_profibus::dp::Lengths;
use lexican_profibus::gsd::{Configuration, GsdError};
use profirust::Baudrate;

const EXPECTED: Lengths = Lengths { inputs: 14, outputs: 14 };

const SLAVE: &str = "#Profibus_DP
GSD_Revision = 3
Vendor_Name = \"Somebody\"
Model_Name = \"Slave\"
Ident_Number = 0x1234
Modular_Station = 1
Max_Module = 2
MaxTsdr_93.75 = 61
MaxTsdr_500 = 99
Ext_User_Prm_Data_Const(0) = 0x00,0x07
Module = \"PKW\" 0xF3
EndModule
Module = \"3 words\" 0xF2
Ext_User_Prm_Data_Const(0) = 0x55
EndModule
Module = \"2 words\" 0xF1
EndModule
";

fn read(text: &str, modules: Option<&str>, bit_rate: Baudrate) -> Result<Configuration, GsdError> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    Configuration::read(file.path(), modules, EXPECTED, bit_rate)
}

#[test]
fn configuration_and_parameters_are_those_of_the_modules_that_are_plugged_in() {
    for (bit_rate, max_tsdr) in [(Baudrate::B500000, 99), (Baudrate::B93750, 61)] {
        let read = read(SLAVE, Some("PKW | 3 words"), bit_rate).unwrap();
        let expected = Configuration {
            model: "Slave".into(),
            ident: 0x1234,
            configuration: vec![0xF3, 0xF2],
            parameters: vec![0x00, 0x07, 0x55],
            max_tsdr,
        };
        assert_eq!(read, expected);
        let options = read.into_options();
        assert_eq!((options.ident_number, options.max_tsdr), (0x1234, max_tsdr));
        assert_eq!((options.config, options.user_parameters), (Some(&[0xF3, 0xF2][..]), Some(&[0x00, 0x07, 0x55][..])));
    }
    // The only one that carries what is expected, also in the special format, need not be named.
    let whole = SLAVE.replace("\"2 words\" 0xF1", "\"whole\" 0xC0,0xC6,0xC6");
    assert_eq!(read(&whole, None, Baudrate::B500000).unwrap().configuration, [0xC0, 0xC6, 0xC6]);
}

#[test]
fn what_does_not_fit_is_refused_with_what_there_is() {
    let said = |text: &str, modules| read(text, modules, Baudrate::B500000).unwrap_err().to_string();
    let all = "\"PKW\", \"3 words\", \"2 words\"";
    assert!(said(SLAVE, Some("PZD")).ends_with(&format!("there is no module \"PZD\"; there is {all}")));
    let which = "which module carries 14 bytes of inputs and 14 of outputs? There is ";
    assert!(said(SLAVE, None).ends_with(&format!("{which}{all}")));
    let other = "PKW | 2 words carries 12 bytes of inputs and 12 of outputs, and 14 bytes of inputs and 14 of outputs are expected";
    assert!(said(SLAVE, Some("PKW|2 words")).ends_with(other));
    // Neither a file of another kind, nor one that refers to what it does not have.
    let foreign = said("[FileInfo]", None);
    assert!(foreign.contains(": no GSD file, expected ") && foreign.ends_with(" at \"[FileInfo]\""), "{foreign}");
    let broken = SLAVE.replace("Ext_User_Prm_Data_Const(0) = 0x00,0x07", "Ext_User_Prm_Data_Ref(0) = 9");
    assert!(
        said(&broken, Some("PKW|3 words"))
            .ends_with("refers to what it does not define, or a default is outside its range")
    );
    let missing = Configuration::read(Path::new("/dev/nothing.gsd"), None, EXPECTED, Baudrate::B500000).unwrap_err();
    assert!(missing.to_string().starts_with("/dev/nothing.gsd: "), "{missing}");
}
