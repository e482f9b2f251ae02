//! `lexican bench` on the command line; `page` tests it in a browser.
#![cfg(unix)]

use std::path::Path;

use crate::bench::Bench;
use crate::browser::Browser;
use crate::common::{files, folder, lexican, lexican_in};

#[test]
fn it_says_what_it_needs() {
    lexican(&["bench"]).on_stderr(2, "--demo");
    lexican(&["bench", "--demo", "--bus", "can0"]).on_stderr(2, "cannot be used with");
    lexican(&["bench", "--demo", "--listen", "localhost"]).on_stderr(2, "127.0.0.1:8080");
    lexican(&["bench", "--demo", "--lang", "fr"]).on_stderr(2, "de, en");
    lexican(&["bench", "--demo", "--overlay", "99=a.toml"]).on_stderr(2, "--device 99=FILE");
    lexican(&["bench", "--demo", "--device", "5=no/such"]).on_stderr(2, "no/such");
    lexican(&["bench", "--bus", "log:no-such.log"]).on_stderr(2, "no-such.log");
}

#[test]
fn an_address_that_is_taken_is_named() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = listener.local_addr().unwrap();
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
        let bench = Bench::begin(&folder, bus);
        assert!(bench.url.starts_with("http://127.0.0.1:") && bench.token().len() == 32, "{}", bench.url);
        assert_eq!(bench.interrupt(), Some(0), "{bus:?}");
    }
}

/// Node 5 is declared as a drive, but is not there, so it cannot confirm a standstill.
const ABSENT: &[&str] = &["--bus", "sim:siko/ag03-1?node=6", "--device", "5=siko/ag03-1"];

#[test]
fn a_drive_that_does_not_confirm_its_stop_is_in_the_exit_code() {
    let bench = Bench::begin(&folder("bench-unconfirmed"), ABSENT);
    assert_eq!(bench.interrupt(), Some(2));
}

#[test]
fn a_second_interrupt_ends_it_at_once() {
    let bench = Bench::begin(&folder("bench-twice"), ABSENT);
    assert_eq!(bench.interrupt_twice(), Some(130), "the first one alone would wait for node 5, and end with 2");
}

/// On Linux and the BSDs, the program that opens a browser is found by its name, so the test can replace it.
#[cfg(not(target_os = "macos"))]
#[test]
fn the_browser_is_opened_without_naming_the_token() {
    use std::os::unix::fs::PermissionsExt;

    let folder = folder("bench-opens");
    let (program, runtime) = (folder.join("xdg-open"), folder.join("run"));
    std::fs::create_dir(&runtime).unwrap();
    std::fs::write(&program, "#!/bin/sh\necho \"$@\" > asked.new && mv asked.new asked\n").unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o700)).unwrap();
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap());
    let environment = [("PATH", &*path), ("DISPLAY", ":0"), ("XDG_RUNTIME_DIR", runtime.to_str().unwrap())];
    let bench = Bench::begin_with(&folder, &["--demo", "--lang", "de"], &environment);
    let asked = loop {
        match std::fs::read_to_string(folder.join("asked")) {
            Ok(asked) => break asked,
            Err(_) => std::thread::yield_now(),
        }
    };
    assert!(!asked.contains(bench.token()), "{asked}");
    let page = Path::new(asked.trim());
    assert!(page.starts_with(&runtime), "{asked}");
    assert_eq!(page.metadata().unwrap().permissions().mode() & 0o777, 0o600);
    let text = std::fs::read_to_string(page).unwrap();
    assert!(bench.url.ends_with("&lang=de"), "{}", bench.url);
    assert!(text.contains(&format!("url={}", bench.url.replace('&', "&amp;"))), "{text}");
    if let Some(browser) = Browser::start(&folder) {
        let window = browser.window();
        window.opens(&format!("file://{}", page.display()));
        window.is_led_on();
        window.reads("connection", "verbunden");
    }
    assert_eq!(bench.interrupt(), Some(0));
    assert_eq!(files(&runtime), [""; 0]);
}

#[test]
fn a_log_that_is_none_is_refused() {
    let folder = folder("bench-no-log");
    std::fs::write(folder.join("text.log"), "no frames here\n").unwrap();
    lexican_in(&folder, &["bench", "--no-open", "--bus", "log:text.log"]).on_stderr(2, "text.log");
}
