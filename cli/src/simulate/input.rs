//! Reads lines from stdin.

#[cfg(unix)]
use std::io::IsTerminal;
use std::io::{BufRead, Read};
use std::sync::mpsc::{Receiver, sync_channel};

/// The lines from stdin, if it may be read. The reader waits while too many lines are not handled yet.
pub(super) fn lines() -> Receiver<String> {
    const WAITING: usize = 64;
    let (sender, receiver) = sync_channel(WAITING);
    if is_listening() {
        std::thread::spawn(move || {
            let mut stdin = std::io::stdin().lock();
            while let Ok(Some(line)) = read_line(&mut stdin) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
    }
    receiver
}

/// A line without its end, cut off if it is too long for a command; `None` at the end of the input.
fn read_line(input: &mut impl BufRead) -> std::io::Result<Option<String>> {
    const LONGEST: u64 = 4096;
    let mut line = Vec::new();
    if input.by_ref().take(LONGEST).read_until(b'\n', &mut line)? == 0 {
        return Ok(None);
    }
    if !line.ends_with(b"\n") {
        input.skip_until(b'\n')?;
    }
    Ok(Some(String::from_utf8_lossy(&line).trim_end().to_owned()))
}

/// Whether stdin may be read: a background process that reads from its terminal would be stopped.
#[cfg(unix)]
pub(super) fn is_listening() -> bool {
    use nix::unistd::{getpgrp, tcgetpgrp};
    let stdin = std::io::stdin();
    !stdin.is_terminal() || tcgetpgrp(stdin).is_ok_and(|foreground| foreground == getpgrp())
}

#[cfg(not(unix))]
pub(super) fn is_listening() -> bool {
    true
}
