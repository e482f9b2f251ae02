//! How much space is left where cargo builds. A full disk has many faces (a linker that dies of a bus error, a test
//! that cannot write, a guest that does not come up), and none of them says what it is.

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::Command;

const GIB: u64 = 1 << 30;

/// Space that is free.
pub(crate) struct Free {
    bytes: u64,
    folder: PathBuf,
}

impl Free {
    /// Where cargo builds. `None` where there is no `df` to ask, as on Windows.
    pub(crate) fn for_builds(root: &Path) -> Option<Self> {
        let folder = crate::workspace::target_folder(root);
        // Before the first build the folder is not there yet.
        let there = folder.ancestors().find(|folder| folder.exists())?;
        let output = Command::new("df").arg("-Pk").arg(there).output().ok().filter(|output| output.status.success())?;
        Some(Free { bytes: available(&String::from_utf8_lossy(&output.stdout))?, folder })
    }

    /// With less than 1 GiB, a job that fails has most likely failed for want of it.
    pub(crate) fn is_short(&self) -> bool {
        self.bytes < GIB
    }
}

impl fmt::Display for Free {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let gib = self.bytes as f64 / GIB as f64;
        write!(f, "{gib:.1} GiB are free for {}", self.folder.display())
    }
}

/// What `df -Pk` (POSIX) has in its fourth column: available blocks of 1024 bytes.
fn available(table: &str) -> Option<u64> {
    let row = table.lines().nth(1)?;
    // The name of the file system comes first, and may have spaces in it: the mark is the share that is used.
    let words: Vec<&str> = row.split_ascii_whitespace().collect();
    let share = words.iter().position(|word| word.ends_with('%'))?;
    words.get(share.checked_sub(1)?)?.parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "Filesystem     1024-blocks     Used Available Capacity Mounted on\n";

    #[test]
    fn the_available_blocks_are_told_from_the_others() {
        let table = |row: &str| available(&format!("{HEAD}{row}\n"));
        assert_eq!(table("/dev/vda         263174212 19000000  76000000      20% /"), Some(76_000_000 * 1024));
        assert_eq!(table("//server/a share 263174212 19000000  76000000      20% /home/a b"), Some(76_000_000 * 1024));
        assert_eq!(table("none                     0        0         0       - /proc"), None);
        assert_eq!(available(HEAD), None);
    }

    #[test]
    fn less_than_a_gibibyte_is_short() {
        let free = |bytes| Free { bytes, folder: PathBuf::from("target") };
        assert!(free(GIB - 1).is_short());
        assert!(!free(GIB).is_short());
        assert_eq!(free(GIB / 2).to_string(), "0.5 GiB are free for target");
    }
}
