//! The program, as its user runs it. `cargo xtask bless` takes over the pictures in `docs/` and the reports in the README.

#[path = "../../golden.rs"]
mod golden;

use std::process::{Command, Output, Stdio};

fn program(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_circle"));
    command.args(args).stdin(Stdio::null());
    command
}

/// Exit code, stdout and stderr.
fn texts(output: Output) -> (Option<i32>, String, String) {
    let text = |bytes| String::from_utf8(bytes).expect("the program prints UTF-8");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn run(args: &[&str]) -> (Option<i32>, String, String) {
    texts(program(args).output().expect("the program was built for this test"))
}

#[test]
fn the_golden_reports_and_pictures_are_those_of_the_program() {
    golden::check("circle", 3, |args| run(args).1);
}

/// Quick stop of each axis leaves the circle, which a ramp along the path does not.
#[test]
fn a_stop_is_along_the_circle_or_each_axis_on_its_own() {
    for (stop, stays) in [("ramp", true), ("quick", false)] {
        let (code, stdout, stderr) = run(&["--period", "5", "--stop", stop, "--stop-at", "0.9"]);
        assert_eq!(code, Some(1), "{stdout}{stderr}");
        assert_eq!(stdout.matches("at rest").count(), 2, "{stdout}");
        let away = stdout.split("farthest from the circle: ").nth(1).and_then(|rest| rest.split(' ').next());
        let away: f64 = away.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{stdout}"));
        assert_eq!(away < 2.0, stays, "{stdout}");
    }
}

#[test]
fn what_cannot_begin_is_said_with_exit_code_2() {
    for (args, said) in [
        (&["--bus", "slcan:/dev/nothing"][..], "there is no serial port /dev/nothing"),
        (&["nowhere.toml"], "cannot read nowhere.toml"),
        (&["../../cli/Cargo.toml"], "unknown section `package`"),
        (&["--pace", "slow"], "possible values"),
        (&["--period", "0"], "1..=10"),
        (&["--radius", "1e12"], "a number from 0.01 to"),
    ] {
        let (code, stdout, stderr) = run(args);
        assert_eq!((code, stdout.as_str()), (Some(2), ""), "{args:?}: {stderr}");
        assert!(stderr.contains(said), "{args:?}: {stderr}");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_stops_both_axes() {
    use std::io::Read as _;

    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;

    let mut command = program(&["--pace", "real", "--period", "10", "--seconds", "60"]);
    let mut process = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it was built");
    // It prints a line when it sets off.
    let mut byte = [0];
    process.stderr.as_mut().expect("it is piped").read_exact(&mut byte).expect("it sets off");
    kill(Pid::from_raw(process.id() as i32), Signal::SIGINT).expect("it runs");
    let (code, stdout, stderr) = texts(process.wait_with_output().expect("it ends"));
    assert_eq!(code, Some(1), "{stdout}{stderr}");
    assert!(stdout.contains("cancelled"), "{stdout}");
    assert_eq!(stdout.matches("at rest").count(), 2, "{stdout}");
}
