//! Crates outside of the workspace, as users write them: they build, their tests pass, and clippy has no warnings.

use crate::outside;
#[test]
fn a_user_reads_and_writes_with_types() {
    check("downstream/basic", &["test"]);
}

#[test]
fn a_firmware_without_std_serves_its_dictionary() {
    check("downstream/no_std", &["test"]);
}

#[test]
fn two_devices_live_in_one_crate() {
    check("downstream/two_devices", &["run"]);
}

#[test]
fn a_build_script_of_any_name_is_not_run_again_for_nothing() {
    outside::succeeds("downstream/two_devices", &["build"]);
    let again = outside::cargo("downstream/two_devices").arg("build").output().expect("cargo can be started");
    let said = String::from_utf8_lossy(&again.stderr);
    assert!(again.status.success() && !said.contains("Compiling"), "{said}");
}

#[test]
fn a_crate_that_reexports_the_runtime_is_enough() {
    check("downstream/reexport", &["test"]);
}

#[test]
fn a_program_may_deny_every_lint() {
    check("downstream/strict", &["run"]);
}

#[test]
fn a_drive_takes_no_line_beyond_its_data_sheet() {
    check("downstream/servo", &["test"]);
}

#[test]
fn a_machine_is_typed_and_boots_its_simulation() {
    check("downstream/machine", &["test"]);
}

#[test]
fn every_type_goes_through_a_pdo_at_every_bit() {
    check("downstream/bits", &["test"]);
}

#[track_caller]
fn check(folder: &str, task: &[&str]) {
    outside::succeeds(folder, task);
    outside::succeeds(folder, &["clippy", "--all-targets", "--", "-D", "warnings"]);
}
