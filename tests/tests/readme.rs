//! The README's recipe for a device of one's own, followed to the letter.

mod outside;

use std::fs;
use std::path::{Path, PathBuf};

const README: &str = include_str!("../../README.md");

/// The files that the recipe has: a block of code whose first line is a comment with the file's path.
fn files() -> Vec<(&'static str, &'static str)> {
    let blocks = README.split("\n```").skip(1).step_by(2);
    let file = |block: &'static str| {
        let (_, text) = block.split_once('\n')?;
        let first = text.lines().next()?;
        let path = first.strip_prefix("// ").or(first.strip_prefix("# "))?.strip_prefix("valve/")?;
        Some((path, text))
    };
    blocks.filter_map(file).collect()
}

#[test]
fn the_recipe_gives_a_device() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the tests lie in the workspace");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("readme/valve");
    let write = |path: &str, bytes: &[u8]| {
        let path: PathBuf = folder.join(path);
        fs::create_dir_all(path.parent().expect("it is in a folder")).expect("a folder can be made");
        fs::write(path, bytes).expect("a file can be written");
    };
    let files = files();
    assert_eq!(files.iter().map(|(path, _)| *path).collect::<Vec<_>>(), ["Cargo.toml", "build.rs", "src/main.rs"]);
    for (path, text) in files {
        // The checkout has any name, and need not lie beside.
        write(path, text.replace("../lexican", &root.to_string_lossy()).as_bytes());
    }
    write("eds/valve.eds", include_bytes!("../downstream/no_std/eds/valve.eds"));
    let folder = folder.to_str().expect("the target folder has a name in UTF-8");
    outside::succeeds(folder, &["clippy", "--", "-D", "warnings"]);
    let output = outside::cargo(folder).args(["run", "--quiet"]).output().expect("cargo can be started");
    assert_eq!(String::from_utf8_lossy(&output.stdout), "valve at 250\n");
}

#[test]
fn no_block_of_the_readme_is_left_unchecked() {
    let ignored = README.matches("rust,ignore").count();
    let followed = files().iter().filter(|(path, _)| path.ends_with(".rs")).count();
    assert_eq!(ignored, followed, "every other block is a test of documentation");
}
