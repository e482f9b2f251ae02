//! The GSD files of this project can be parsed, and match the simulated slaves.

use std::path::Path;

use gsd_parser::SupportedSpeeds;
use lexican_profibus::dp::Lengths;
use lexican_profibus::{Slave, dp};
use lexican_runtime::Duration;
use profirust::dp::PeripheralOptions;
use siko_profibus::{AG02, AG03_1, Model, PPO, ProfibusDrive, bus};

fn check(model: &'static Model, file: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../eds/devices/siko").join(file);
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("THIS IS NOT THE VENDOR'S FILE"), "{file}");
    assert!(file.contains(&format!("{:04X}", model.identity.ident)), "its name has the ident number");
    let gsd = gsd_parser::parse_from_file(&path);
    assert_eq!((gsd.vendor.as_str(), gsd.ident_number), ("SIKO GmbH", model.identity.ident));
    assert_eq!(gsd.model, format!("{} (lexican)", model.name));
    assert_eq!(gsd.software_release, format!("{:X}.{:02X}", model.version >> 8, model.version & 0xFF));
    assert_eq!((gsd.sync_mode_supported, gsd.freeze_mode_supported), (model.identity.sync, model.identity.freeze));
    assert!(gsd.auto_baud_supported && !gsd.set_slave_addr_supported && !gsd.fail_safe && !gsd.modular_station);
    assert_eq!(gsd.max_diag_data_length, 6);
    // 9.6 kBd to 12 MBd, without 31.25 and 45.45 kBd, which the manual does not have.
    let speeds = SupportedSpeeds::all() - SupportedSpeeds::B31250 - SupportedSpeeds::B45450;
    assert_eq!(gsd.supported_speeds, speeds);
    let [module] = gsd.available_modules.as_slice() else { panic!("one module") };
    assert_eq!(module.config, model.identity.configuration);
    assert_eq!(dp::lengths(&module.config), Some(Lengths { inputs: 14, outputs: 14 }));
    assert_eq!((PPO.lengths(), model.identity.is_consistent()), (Lengths { inputs: 14, outputs: 14 }, true));

    // A master configured by the file works with the drive.
    let (mut bus, _) = bus::with(model, 3);
    let options = PeripheralOptions {
        ident_number: gsd.ident_number,
        sync_mode: gsd.sync_mode_supported,
        freeze_mode: gsd.freeze_mode_supported,
        groups: 1,
        max_tsdr: gsd.max_tsdr.b500000,
        fail_safe: gsd.fail_safe,
        user_parameters: Some(&[]),
        config: Some(Vec::leak(module.config.clone())),
    };
    let slave = Slave::new(7, model.identity, bus.bit_rate(), ProfibusDrive::new(bus.now(), model, 7));
    let drive = bus.attach(slave, options, (14, 14));
    assert!(bus.run_until(Duration::from_secs(1), |bus| bus.exchanges(drive) > 1));
}

#[test]
fn the_file_of_the_ag03_1_says_what_it_is() {
    check(&AG03_1, "ag03-1/SIKO0AC5.GSD");
}

#[test]
fn the_file_of_the_ag02_says_what_it_is() {
    check(&AG02, "ag02/SIKO08C9.GSD");
}
