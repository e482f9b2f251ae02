//! Writes the descriptions of zencan's two devices, and has zencan generate their code.

use std::fmt::Write;
use std::path::PathBuf;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let folder = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    for (name, objects, pdos) in [("SMALL", 10, false), ("LARGE", 1000, false), ("PDOS", 10, true)] {
        let path = folder.join(format!("{name}.toml"));
        std::fs::write(&path, description(objects, pdos)).expect("OUT_DIR can be written");
        zencan_build::build_node_from_device_config(name, &path).expect("the description is one of zencan's");
    }
}

/// `objects` numbers from 2000h on, and three pieces of bytes from 4000h on.
fn description(objects: u16, pdos: bool) -> String {
    let mut toml = String::from(
        "device_name = 'bench'\n[identity]\nvendor_id = 1\nproduct_code = 2\nrevision_number = 3\n\
         [pdos]\nnum_rpdo = 4\nnum_tpdo = 4\n",
    );
    for pdo in (0..4).filter(|_| pdos) {
        for (kind, cob_id) in [("rpdo", 0x200), ("tpdo", 0x180)] {
            let cob_id = cob_id + 0x100 * pdo;
            let _ = write!(
                toml,
                "[pdos.{kind}.{pdo}]\nenabled = true\ncob_id = {cob_id}\nadd_node_id = true\n\
                 transmission_type = 254\nmappings = [{{ index = 0x2000, sub = 0, size = 32 }}]\n"
            );
        }
    }
    for index in 0x2000..0x2000 + objects {
        object(&mut toml, index, "uint32");
    }
    for (index, len) in [(0x4000, 32), (0x4001, 1200), (0x4002, 65536)] {
        object(&mut toml, index, &format!("octetstring({len})"));
    }
    toml
}

fn object(toml: &mut String, index: u16, data_type: &str) {
    let _ = write!(
        toml,
        "[[objects]]\nindex = {index}\nparameter_name = 'Object {index}'\nobject_type = 'var'\n\
         data_type = '{data_type}'\naccess_type = 'rw'\npdo_mapping = 'both'\n"
    );
}
