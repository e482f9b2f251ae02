//! The fuzz targets (`cargo xtask fuzz`), run without libFuzzer on the committed inputs and on those that it has found.

#[path = "../../../fuzz/src/lib.rs"]
#[expect(unreachable_pub, reason = "it is a crate of its own, for libFuzzer")]
mod fuzz;

use std::fs;
use std::path::Path;

/// Runs `target` on all files of a folder. Fuzzing starts with the same files.
#[track_caller]
fn check(target: fn(&[u8]), folder: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the tests lie in the workspace");
    let files = fs::read_dir(root.join(folder)).expect("the folder can be read");
    let files: Vec<_> = files.map(|file| file.expect("the folder can be read").path()).collect();
    assert!(!files.is_empty(), "{folder} has inputs");
    for file in files {
        println!("{}", file.display());
        let input = fs::read(&file).expect("the input can be read");
        target(&input);
        // The beginning of an input is an input, too.
        (0..16).for_each(|part| target(&input[..input.len() * part / 16]));
    }
}

#[test]
fn a_device_goes_on() {
    check(fuzz::device, "fuzz/corpus/device");
}

#[test]
fn a_manager_goes_on() {
    check(fuzz::manager, "fuzz/corpus/manager");
}

#[test]
fn transfers_end_well_or_fail() {
    check(fuzz::sdo, "fuzz/corpus/sdo");
}

#[test]
fn any_data_sheet_is_read() {
    check(fuzz::eds, "fuzz/corpus/eds");
}

#[test]
fn what_is_generated_is_rust() {
    check(fuzz::codegen, "fuzz/corpus/codegen");
}

#[test]
fn data_sheets_in_xml() {
    check(fuzz::xdd, "fuzz/corpus/xdd");
}

#[test]
fn any_log_is_read() {
    check(fuzz::log, "fuzz/corpus/log");
}

#[test]
fn a_log_of_any_format_is_read() {
    check(fuzz::logs, "fuzz/corpus/logs");
}

#[test]
fn any_serial_line_is_read() {
    check(fuzz::slcan, "fuzz/corpus/slcan");
}

#[test]
fn any_name_of_a_bus_is_read() {
    check(fuzz::bus_url, "fuzz/corpus/bus_url");
}

#[test]
fn any_script_is_read() {
    check(fuzz::script, "fuzz/corpus/script");
}

#[test]
fn any_machine_is_read() {
    check(fuzz::machine, "fuzz/corpus/machine");
}

#[test]
fn any_bus_yml_is_read() {
    check(fuzz::bus_yml, "fuzz/corpus/bus_yml");
}

#[test]
fn any_backup_of_a_machine_is_read() {
    check(fuzz::archive, "fuzz/corpus/archive");
}

#[test]
fn any_kept_parameters_are_read() {
    check(fuzz::parameters, "fuzz/corpus/parameters");
}

#[test]
fn any_bytes_on_a_serial_port_are_survived() {
    check(fuzz::siko_serial, "fuzz/corpus/siko_serial");
}

#[test]
fn a_drive_on_profibus_goes_on() {
    check(fuzz::profibus, "fuzz/corpus/profibus");
}
