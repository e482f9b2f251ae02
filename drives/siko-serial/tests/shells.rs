//! The shells over real streams: tokio's over a duplex stream, the blocking one over a pseudo-terminal.

#[cfg(feature = "tokio")]
mod tokio_shell {
    use lexican_driver::Direction;
    use lexican_runtime::{Duration, Instant};
    use siko_ag02::od::{Position, serial};
    use siko_serial::answer::Answer;
    use siko_serial::command::{Command, Long};
    use siko_serial::error::ErrorNumber;
    use siko_serial::sim::SerialDrive;
    use siko_serial::tokio::Connection;
    use siko_serial::{Error, Settings};
    use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};

    /// Serves a simulated drive in tokio's time.
    async fn serve(mut stream: DuplexStream) {
        let (mut drive, mut buffer, origin) = (SerialDrive::default(), [0; 64], tokio::time::Instant::now());
        loop {
            let now = || Instant::ZERO + origin.elapsed().into();
            let span = drive.poll_timeout().unwrap_or(Instant::MAX).since(now()).min(Duration::from_secs(60));
            match tokio::time::timeout(span.into(), stream.read(&mut buffer)).await {
                Err(_) => drive.handle_timeout(now()),
                Ok(Ok(len @ 1..)) => drive.handle_bytes(now(), &buffer[..len]),
                Ok(_) => return,
            }
            while let Some(answer) = drive.poll_transmit() {
                stream.write_all(answer.as_bytes()).await.unwrap();
            }
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_drive_is_moved_and_inched() {
        let (near, far) = tokio::io::duplex(64);
        let served = tokio::spawn(serve(far));
        let mut drive = Connection::new(near, Settings::default());
        drive.request(Command::WriteLong(Long::Setpoint, 5000)).await.unwrap();
        drive.request(Command::Start).await.unwrap();
        let refused = drive.request(Command::Step).await.unwrap_err();
        assert!(matches!(refused, Error::Refused(ErrorNumber::OPERATING_STATE)));
        drive.wait(Duration::from_secs(30)).await.unwrap();
        assert_eq!(drive.request(Command::Position).await.unwrap(), Answer::Long(5000));
        drive.start_inching(Direction::Positive);
        drive.wait(Duration::from_secs(2)).await.unwrap();
        assert_eq!(drive.request(Command::Velocity).await.unwrap(), Answer::Velocity(50));
        drive.stop_inching();
        drive.wait(Duration::from_secs(1)).await.unwrap();
        assert_eq!(drive.request(Command::Velocity).await.unwrap(), Answer::Velocity(0));
        drive.write(serial::UPPER_LIMIT, Position(250_000)).await.unwrap();
        assert_eq!(drive.read(serial::UPPER_LIMIT).await.unwrap(), Position(250_000));
        assert!(matches!(drive.read(serial::TARGET_VELOCITY).await, Err(Error::Elsewhere(_))));
        drop(drive);
        served.await.unwrap();
    }

    #[tokio::test(start_paused = true)]
    async fn a_request_that_is_dropped_is_followed_by_another_one() {
        let (near, far) = tokio::io::duplex(64);
        let served = tokio::spawn(serve(far));
        let mut drive = Connection::new(near, Settings::default());
        drive.request(Command::Flags).await.unwrap();
        for _ in 0..10 {
            // It has been sent, and its answer is on its way.
            let cut = tokio::time::timeout(std::time::Duration::ZERO, drive.request(Command::Faults)).await;
            assert!(cut.is_err());
            assert_eq!(drive.request(Command::Position).await.unwrap(), Answer::Long(0));
        }
        served.abort();
        let _ = served.await;
        let error = drive.request(Command::Position).await.unwrap_err();
        assert!(matches!(error, Error::Line(_)), "{error}");
    }
}

#[cfg(all(feature = "serialport", unix))]
mod terminal {
    use std::io::{Read, Write};

    use serialport::{SerialPort, TTYPort};
    use siko_serial::answer::Answer;
    use siko_serial::client::Trouble;
    use siko_serial::command::{Command, Long, Short};
    use siko_serial::sim::SerialDrive;
    use siko_serial::{Connection, Error, Port, Settings};

    #[test]
    fn a_drive_answers_over_a_terminal_until_it_is_gone() {
        let (mut near, far) = TTYPort::pair().unwrap();
        let path = far.name().unwrap();
        near.set_timeout(std::time::Duration::from_millis(1)).unwrap();
        // The drive is at the controlling end, and ends when it is asked for its bit rate.
        let served = std::thread::spawn(move || {
            let (mut drive, mut buffer) = (SerialDrive::default(), [0; 64]);
            loop {
                let Ok(len) = near.read(&mut buffer) else { continue };
                if buffer[..len].starts_with(b"G12") {
                    return near;
                }
                drive.handle_bytes(lexican_runtime::Instant::ZERO, &buffer[..len]);
                while let Some(answer) = drive.poll_transmit() {
                    near.write_all(answer.as_bytes()).unwrap();
                }
            }
        });
        let mut drive = Connection::new(Port::open(&path, 9600).unwrap(), Settings::default());
        assert_eq!(drive.request(Command::WriteLong(Long::Setpoint, -7)).unwrap(), Answer::Done);
        assert_eq!(drive.number(Command::ReadLong(Long::Setpoint)).unwrap(), -7);
        let silent = drive.request(Command::ReadShort(Short::BitRate)).unwrap_err();
        assert!(matches!(silent, Error::Trouble(Trouble::TimedOut)), "{silent}");
        drop(served.join().unwrap());
        drop(far);
        assert!(matches!(drive.request(Command::Status), Err(Error::Line(_))), "a line that is gone is an error");
        assert!(Port::open("/dev/nonexistent", 9600).is_err());
    }
}
