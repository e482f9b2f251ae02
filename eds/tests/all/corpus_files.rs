//! Real files of many vendors, which are not part of this project: `LEXICAN_CORPUS` names a folder with them, or
//! an archive of one, as `cargo xtask ci sheets` does.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;
use std::{env, fs};

/// The files, unpacked once for all tests of a program.
static FILES: LazyLock<Option<Vec<PathBuf>>> = LazyLock::new(find);

/// The files; if there are none, says so.
pub(crate) fn corpus() -> Option<Vec<PathBuf>> {
    FILES.clone()
}

fn find() -> Option<Vec<PathBuf>> {
    let Some(place) = env::var_os("LEXICAN_CORPUS").map(PathBuf::from) else {
        eprintln!("SKIPPED: LEXICAN_CORPUS names no data sheets");
        return None;
    };
    let folder = if place.is_dir() { place } else { unpacked(&place)? };
    let mut files = Vec::new();
    walk(&folder, &mut files);
    files.sort();
    Some(files)
}

/// Unpacks the archive with the system's tar.
fn unpacked(archive: &Path) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("corpus");
    fs::create_dir_all(&folder).expect("the target folder is writable");
    let status = Command::new("tar").arg("-xf").arg(archive).arg("-C").arg(&folder).status();
    if !status.is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: tar cannot unpack {}", archive.display());
        return None;
    }
    Some(folder)
}

fn walk(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the corpus is readable") {
        let path = entry.expect("the corpus is readable").path();
        if path.is_dir() {
            walk(&path, files);
        } else {
            files.push(path);
        }
    }
}
