//! `lexican bench` on the command line; `bench_page` has it in a browser.
#![cfg(unix)]

#[path = "common/mod.rs"]
mod common;

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use common::{folder, lexican, lexican_in};

#[test]
fn it_says_what_it_needs() {
    lexican(&["bench"]).on_stderr(2, "--demo");
    lexican(&["bench", "--demo", "--bus", "can0"]).on_stderr(2, "cannot be used with");
    lexican(&["bench", "--demo", "--listen", "localhost"]).on_stderr(2, "127.0.0.1:8080");
    lexican(&["bench", "--demo", "--overlay", "99=a.toml"]).on_stderr(2, "--device 99=FILE");
    lexican(&["bench", "--demo", "--device", "5=no/such"]).on_stderr(2, "no/such");
    lexican(&["bench", "--bus", "log:no-such.log"]).on_stderr(2, "no-such.log");
}

#[test]
fn an_address_that_is_taken_is_named() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let _listener = std::net::TcpListener::bind(taken).unwrap();
    lexican(&["bench", "--demo", "--no-open", "--listen", &taken.to_string()]).on_stderr(2, &taken.to_string());
}

#[test]
fn it_prints_its_address_and_ends_when_it_is_told_to() {
    let folder = folder("bench-ends");
    let log = folder.join("bus.log");
    std::fs::write(&log, "(1.000000) can0 705#7F\n(1.100000) can0 705#7F\n").unwrap();
    for bus in
        [&["--demo"][..], &["--bus", "sim:siko/ag03-1?node=5"], &["--bus", "log:bus.log", "--device", "5=siko/ag03-1"]]
    {
        let mut process = Command::new(env!("CARGO_BIN_EXE_lexican"))
            .args([&["bench", "--no-open"], bus].concat())
            .current_dir(&folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut url = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut url).unwrap();
        let token = url.trim().split_once("/?token=").unwrap_or_else(|| panic!("{bus:?}: {url}")).1;
        assert!(url.starts_with("http://127.0.0.1:") && token.len() == 32, "{url}");
        assert!(Command::new("kill").args(["-TERM", &process.id().to_string()]).status().unwrap().success());
        assert_eq!(process.wait().unwrap().code(), Some(0), "{bus:?}");
    }
}

#[test]
fn a_log_that_is_none_is_refused() {
    let folder = folder("bench-no-log");
    std::fs::write(folder.join("text.log"), "no frames here\n").unwrap();
    lexican_in(&folder, &["bench", "--no-open", "--bus", "log:text.log"]).on_stderr(2, "text.log");
}
