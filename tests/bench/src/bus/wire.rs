//! What the frames go through: vcan0 of this kernel, or two pseudo-terminals back to back.

use std::io::{self, ErrorKind, Read, Write};
use std::time::Duration;

use serialport::{SerialPort, TTYPort};

use super::player::{Outcome, Player, ourselves};

/// A bus with two ends.
pub(super) struct Wire {
    pub(super) name: &'static str,
    /// The URL for the device.
    pub(super) near: String,
    /// The URL for the client.
    pub(super) far: String,
    /// The process that carries the bytes, if one must.
    _crossing: Option<Player>,
}

impl Wire {
    pub(super) fn new(link: &str) -> Outcome<Self> {
        if link == "vcan" {
            let url = "socketcan:vcan0".to_owned();
            return Ok(Wire { name: "vcan", near: url.clone(), far: url, _crossing: None });
        }
        let mut crossing = Player::start(ourselves(&["wire"])?)?;
        let (near, far) = (crossing.line()?, crossing.line()?);
        Ok(Wire { name: "slcan over a pty", near, far, _crossing: Some(crossing) })
    }
}

/// Prints the URLs of two terminals, and carries what one end's program writes to the other's, until standard
/// input ends.
pub(super) fn cross() -> Outcome<()> {
    // The ends stay open here, too, so that they outlive the programs that open them.
    let ((left, _left_end), (right, _right_end)) = (terminal()?, terminal()?);
    let (left_again, right_again) = (left.try_clone_native()?, right.try_clone_native()?);
    std::thread::spawn(move || carry(left_again, right_again));
    std::thread::spawn(move || carry(right, left));
    std::io::stdin().read_to_end(&mut Vec::new())?;
    Ok(())
}

fn terminal() -> Outcome<(TTYPort, TTYPort)> {
    let (master, end) = TTYPort::pair()?;
    println!("slcan:{}", end.name().ok_or("a terminal has a name")?);
    Ok((master, end))
}

fn carry(mut from: TTYPort, mut to: TTYPort) -> io::Result<()> {
    from.set_timeout(Duration::from_secs(3600))?;
    let mut buffer = [0; 4096];
    loop {
        let len = match from.read(&mut buffer) {
            Ok(len) => len,
            Err(error) if error.kind() == ErrorKind::TimedOut => continue,
            Err(error) => return Err(error),
        };
        match to.write_all(&buffer[..len]) {
            // No program has that end open.
            Err(error) if error.kind() == ErrorKind::TimedOut => {}
            outcome => outcome?,
        }
    }
}
