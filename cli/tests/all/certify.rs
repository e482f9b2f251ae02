//! The page "Certify a device in ten minutes", followed to the letter; `LEXICAN_BLESS=1` writes the output of the
//! commands.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{files, folder, lexican_in};
use crate::page::follow;

/// The output of a line of the page in a folder. A test whose cases fail exits with 1.
fn typed(folder: &Path, line: &str) -> String {
    let words: Vec<&str> = line.split_whitespace().collect();
    match words[..] {
        ["lexican", ref args @ ..] => {
            let run = lexican_in(folder, args);
            let failed = run.stdout.lines().any(|line| line.starts_with("failed "));
            assert_eq!(run.code, Some(i32::from(failed)), "{run}");
            run.stdout
        }
        ["sed", ..] => {
            let status = Command::new("sh").args(["-c", line]).current_dir(folder).status().expect("there is a shell");
            assert!(status.success(), "{line}");
            String::new()
        }
        _ => panic!("a line that the test does not follow: {line}"),
    }
}

#[test]
fn the_golden_page_certifies_an_encoder() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = folder("certify");
    fs::copy(root.join("tests/conformance/encoder.eds"), folder.join("encoder.eds")).expect("there is its data sheet");
    follow(&root.join("conform/certify-a-device.md"), "certify", str::to_owned, |language, line| {
        assert_eq!(language, "sh", "a block that the test does not follow");
        typed(&folder, line)
    });
    assert_eq!(files(&folder), ["encoder.eds", "report.html", "report.json", "report.xml", "wrong.eds"]);
}
