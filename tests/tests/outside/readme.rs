//! The README's recipe for a device of one's own, followed to the letter.

use crate::outside;
use std::path::Path;

const README: &str = include_str!("../../../README.md");

#[test]
fn the_recipe_gives_a_device() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("readme/valve");
    let files = outside::files_of(README, "valve");
    assert_eq!(files.iter().map(|(path, _)| *path).collect::<Vec<_>>(), ["Cargo.toml", "build.rs", "src/main.rs"]);
    for (path, text) in files {
        outside::write(&folder, path, text);
    }
    outside::write(&folder, "eds/valve.eds", include_str!("../../downstream/no_std/eds/valve.eds"));
    let folder = folder.to_str().expect("the target folder has a name in UTF-8");
    outside::succeeds(folder, &["clippy", "--", "-D", "warnings"]);
    assert_eq!(outside::output(folder, &["run", "--quiet"]), "valve at 250\n");
}

#[test]
fn no_block_of_the_readme_is_left_unchecked() {
    outside::has_no_other_blocks(README, &outside::files_of(README, "valve"));
}
