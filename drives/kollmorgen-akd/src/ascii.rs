//! The drive's ASCII commands, such as `DRV.FAULTS`: text through object 2026h, four characters at a time (6.2.2.3,
//! 7.2.1.9).
//!
//! [`ask`] is a sequence, and runs in either shell:
//!
//! ```no_run
//! # use kollmorgen_akd::ascii;
//! # use kollmorgen_akd::driver::{Drive, DriveContext, Error};
//! # use lexican_runtime::host::VirtualLink;
//! # fn show(drive: &mut Drive<VirtualLink>) -> Result<(), Error> {
//! let faults = drive.run(async |context: DriveContext| ascii::ask(&context, "DRV.FAULTS").await)?;
//! println!("{faults}");
//! # Ok(())
//! # }
//! ```
//!
//! While the drive is operated by its control word, ASCII commands must not order motion (6.4.1.2).

use lexican_driver::{DriveContext, Error};
use lexican_runtime::object::Address;

use crate::od;

/// The longest answer that is read.
const MOST: usize = 4096;

/// The end of an answer: an empty line after the last line, whether or not that ends with a carriage return.
const END: &str = "\n\r\n";

/// Sends a command, and returns the lines of the answer, without the prompt and the end.
pub async fn ask(drive: &DriveContext, command: &str) -> Result<String, Error> {
    let (to, from) = (od::ASCII_CHANNEL.command().address(), od::ASCII_CHANNEL.response().address());
    let line = format!("{command}\r\n");
    for characters in line.as_bytes().chunks(4) {
        drive.write_bytes(to, characters).await?;
    }
    let mut answer = String::new();
    while answer.len() < MOST {
        let more = text(drive, from).await?;
        answer.push_str(&more);
        if more.is_empty() || answer.ends_with(END) {
            break;
        }
    }
    Ok(answer.trim_start_matches(['-', '>']).trim().to_owned())
}

/// The next characters of the answer; empty if there are none.
async fn text(drive: &DriveContext, from: Address) -> Result<String, Error> {
    let characters = drive.read_bytes(from).await?;
    Ok(characters.into_iter().filter(|character| *character != 0).map(char::from).collect())
}
