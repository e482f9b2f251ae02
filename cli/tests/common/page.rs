//! Carries out a page of the documentation to the letter.

use std::fs;
use std::path::Path;

/// Follows a page, and compares each block of language `text` with the output of the block before it; `LEXICAN_BLESS=1`
/// writes those that differ. `alike` removes differences between runs. `act` gets the language and the text of each
/// line of the other blocks, and returns its output.
pub(crate) fn follow(
    path: &Path,
    test: &str,
    alike: impl Fn(&str) -> String,
    mut act: impl FnMut(&str, &str) -> String,
) {
    let page = fs::read_to_string(path).expect("there is the page");
    let (mut followed, mut printed, mut shown) = (String::new(), String::new(), String::new());
    let mut block: Option<&str> = None;
    for line in page.lines() {
        match (block, line.strip_prefix("```")) {
            (Some("text"), None) => {
                shown += &format!("{line}\n");
                continue;
            }
            (Some(language), Some(_)) => {
                if language == "text" {
                    let same = alike(&shown) == alike(&printed);
                    followed += if same { &shown } else { &printed };
                    (printed, shown) = (String::new(), String::new());
                }
                block = None;
            }
            (Some(language), None) => printed += &act(language, line),
            (None, Some(language)) => {
                if language != "text" {
                    printed.clear();
                }
                block = Some(language);
            }
            (None, None) => {}
        }
        followed += &format!("{line}\n");
    }
    if std::env::var_os("LEXICAN_BLESS").is_some() {
        fs::write(path, followed).expect("the page can be written");
    } else {
        assert_eq!(page, followed, "write the page anew: LEXICAN_BLESS=1 cargo test -p lexican --test all {test}");
    }
}
