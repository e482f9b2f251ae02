//! Paths in pages: each file and folder that a page names is there.

use std::fs;
use std::path::Path;

use crate::checkout;
use crate::workspace::entries;

/// What the pages name that is not there. Of the changelog only links count: what it says was true when it was written.
pub(super) fn findings(root: &Path) -> Result<Vec<String>, String> {
    let rooms = entries(root)?.into_iter().filter(|path| path.is_dir());
    let rooms: Vec<String> = rooms.filter_map(|path| Some(path.file_name()?.to_str()?.to_owned())).collect();
    let mut found = Vec::new();
    for page in checkout::files(root)?.iter().filter(|page| page.ends_with(".md")) {
        let text = fs::read_to_string(root.join(page)).map_err(|error| format!("{page}: {error}"))?;
        let folder = root.join(page).with_file_name("");
        for (line, named) in named(&text, &rooms, page != "CHANGELOG.md") {
            if !folder.join(&named).exists() && !root.join(&named).exists() {
                found.push(format!("{page}:{line}: {named} is not there"));
            }
        }
    }
    Ok(found)
}

/// The links of a page to files, and, if wanted, what stands between backquotes and begins with one of our rooms.
fn named(text: &str, rooms: &[String], spans: bool) -> Vec<(usize, String)> {
    let mut all = Vec::new();
    let mut is_block = false;
    for (line, text) in text.lines().enumerate().map(|(at, text)| (at + 1, text)) {
        if text.trim_start().starts_with("```") {
            is_block = !is_block;
        }
        if is_block {
            continue;
        }
        let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        let links = links.map(|link| link.split('#').next().unwrap_or_default());
        all.extend(links.filter(|link| !link.is_empty() && !link.contains("://")).map(|link| (line, link.to_owned())));
        let words = text.split('`').skip(1).step_by(2).filter(|_| spans);
        let is_path = |word: &&str| {
            let room = word.split_once('/').map(|(room, _)| room);
            room.is_some_and(|room| rooms.iter().any(|known| known == room))
                && word.chars().all(|c| c.is_ascii_alphanumeric() || "/._-".contains(c))
        };
        all.extend(words.filter(is_path).map(|word| (line, word.to_owned())));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_and_paths_of_our_rooms_are_read() {
        let text = "See [it](a.md#part), [them](https://x.org/y.md), `eds/src/lib.rs`, `siko/ag02` and `cli/<command>.rs`.\n\
                    ```sh\ncat eds/none.rs\n```\n`eds/last`";
        let rooms = ["eds".to_owned(), "cli".to_owned()];
        let expected =
            [(1, "a.md"), (1, "eds/src/lib.rs"), (5, "eds/last")].map(|(line, path)| (line, path.to_owned()));
        assert_eq!(named(text, &rooms, true), expected);
        assert_eq!(named(text, &rooms, false), expected[..1]);
    }

    #[test]
    fn the_pages_of_the_project_name_what_is_there() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace is above");
        assert_eq!(findings(root), Ok(vec![]));
    }
}
