//! A simulated AG02 on a pseudo-terminal, in real time: prints the terminal's path, and serves it until it is ended.
//! With `echo`, it returns what it receives first, as an RS-485 adapter with two wires may.
//!
//! ```text
//! cargo run -p lexican-siko-serial --features serialport --example simulate
//! ```

#[cfg(unix)]
fn main() -> Result<(), lexican_runtime::host::MainError> {
    use lexican_runtime::{Duration, Instant};
    use serialport::{SerialPort, TTYPort};
    use siko_serial::sim::SerialDrive;
    use siko_serial::{Line, Port};

    // The clock is read at least every 20 ms, so a deadline of the drive is late by that at most.
    const READ: std::time::Duration = std::time::Duration::from_millis(1);
    const LOOK: Duration = Duration::from_millis(20);

    let echo = std::env::args().any(|argument| argument == "echo");
    let (mut terminal, far) = TTYPort::pair()?;
    terminal.set_timeout(READ)?;
    println!("{}", far.name().unwrap_or_default());
    // The far end stays open here, so that a program that closes it does not end the terminal.
    let (mut line, mut drive, mut buffer) = (Port::new(terminal), SerialDrive::default(), [0; 64]);
    loop {
        let until = drive.poll_timeout().unwrap_or(Instant::MAX).min(line.now() + LOOK);
        let len = line.receive(until, &mut buffer)?;
        let now = line.now();
        if drive.poll_timeout().is_some_and(|deadline| deadline <= now) {
            drive.handle_timeout(now);
        }
        if echo {
            line.send(&buffer[..len])?;
        }
        drive.handle_bytes(now, &buffer[..len]);
        while let Some(answer) = drive.poll_transmit() {
            line.send(answer.as_bytes())?;
        }
    }
}

/// There are no pseudo-terminals elsewhere.
#[cfg(not(unix))]
fn main() {}
