//! Shows a recorded log, through which clients can move.

use std::sync::{Arc, Condvar, Mutex, PoisonError};

use lexican_runtime::{Duration, Frame, Instant};
use tokio::sync::oneshot;

use super::hub::Ports;
use super::lock::lock;
use crate::model::Model;
use crate::request::{Answer, Refused};
use crate::view;

/// The interval of showing more while the log is played.
const STEP: Duration = Duration::from_millis(20);

/// The interval otherwise, to notice the end of the bench.
const LOOK: Duration = Duration::from_millis(100);

/// The number of frames after which clients can lock the model.
const CHUNK: usize = 256;

type Sender = oneshot::Sender<Result<Answer, Refused>>;

/// Where clients want to go in a recorded log.
#[derive(Default)]
pub(super) struct Recording {
    wanted: Mutex<Wanted>,
    changed: Condvar,
}

#[derive(Default)]
struct Wanted {
    seek: Option<Seek>,
    speed: f64,
}

struct Seek {
    /// `None` to stay at the present position.
    to: Option<Duration>,
    /// Whether to begin from the first frame, to decode everything again.
    anew: bool,
    sender: Option<Sender>,
}

/// The log with its present position.
struct Player {
    recording: Arc<Recording>,
    ports: Ports,
    model: Arc<Mutex<Model>>,
    frames: Vec<(Instant, Frame)>,
    next: usize,
    position: Duration,
}

/// Starts showing a log, at first from its first to its last frame.
pub(super) fn begin(
    mut frames: Vec<(Instant, Frame)>,
    ports: Ports,
    model: Arc<Mutex<Model>>,
) -> std::io::Result<Arc<Recording>> {
    // Times recorded by several clocks may go back a little.
    let mut last = Instant::ZERO;
    for (at, _) in &mut frames {
        last = last.max(*at);
        *at = last;
    }
    let recording = Arc::new(Recording::default());
    let player = Player { recording: Arc::clone(&recording), ports, model, frames, next: 0, position: Duration::ZERO };
    recording.seek(player.length(), None);
    player.show(0.0);
    std::thread::Builder::new().name("log".to_owned()).spawn(move || player.run())?;
    Ok(recording)
}

impl Recording {
    /// Moves to a time, and pauses there.
    pub(super) fn seek(&self, to: Duration, sender: Option<Sender>) {
        self.want(|wanted| {
            wanted.speed = 0.0;
            wanted.seek = Some(Seek { to: Some(to), anew: false, sender });
        });
    }

    /// Plays at a multiple of the recording's speed; 0 pauses.
    pub(super) fn play(&self, speed: f64) {
        self.want(|wanted| wanted.speed = speed);
    }

    /// Decodes everything again, after a node got a data sheet.
    pub(super) fn show_anew(&self) {
        self.want(|wanted| match &mut wanted.seek {
            Some(seek) => seek.anew = true,
            None => wanted.seek = Some(Seek { to: None, anew: true, sender: None }),
        });
    }

    fn want(&self, change: impl FnOnce(&mut Wanted)) {
        change(&mut lock(&self.wanted));
        self.changed.notify_all();
    }

    /// Waits for the next seek or step of playing; returns the seek and the speed.
    fn next(&self) -> (Option<Seek>, f64) {
        let mut wanted = lock(&self.wanted);
        if wanted.seek.is_none() {
            let patience = if wanted.speed > 0.0 { STEP } else { LOOK };
            wanted = self.changed.wait_timeout(wanted, patience.into()).unwrap_or_else(PoisonError::into_inner).0;
        }
        (wanted.seek.take(), wanted.speed)
    }
}

impl Player {
    fn run(mut self) {
        #[expect(clippy::disallowed_methods, reason = "a log is played in real time")]
        let mut before = std::time::Instant::now();
        while !self.ports.is_over() {
            let (seek, mut speed) = self.recording.next();
            let elapsed = before.elapsed();
            before += elapsed;
            let mut answer = None;
            if let Some(seek) = seek {
                let is_there = self.go(seek.to.unwrap_or(self.position), seek.anew);
                let result = if is_there { Ok(Answer::Done) } else { Err(Refused::new("another time was asked for")) };
                answer = seek.sender.map(|sender| (sender, result));
            } else if speed > 0.0 {
                self.go(self.position + micros(elapsed.as_secs_f64() * speed), false);
                if self.position == self.length() {
                    speed = 0.0;
                    self.recording.play(speed);
                }
            }
            // Update the view first: a client with its answer sees the new position.
            self.show(speed);
            if let Some((sender, result)) = answer {
                // Ignore an error: the client may be gone.
                let _ = sender.send(result);
            }
        }
    }

    /// Moves to a time; `false` if another seek interrupts it.
    fn go(&mut self, to: Duration, anew: bool) -> bool {
        let to = to.min(self.length());
        if anew || to < self.position {
            lock(&self.model).rewind();
            self.next = 0;
        }
        let first = self.first();
        let end = self.frames.partition_point(|(at, _)| at.since(first) <= to);
        while self.next < end {
            if self.ports.is_over() || lock(&self.recording.wanted).seek.is_some() {
                return false;
            }
            let chunk = &self.frames[self.next..end.min(self.next + CHUNK)];
            let mut model = lock(&self.model);
            chunk.iter().for_each(|(at, frame)| model.observe(*at, frame));
            self.next += chunk.len();
            self.position = chunk.last().map_or(to, |(at, _)| at.since(first));
            drop(model);
            self.show(0.0);
        }
        self.position = to;
        lock(&self.model).pass(first + to);
        true
    }

    fn show(&self, speed: f64) {
        let (seconds, position) = (self.length().as_secs_f64(), self.position.as_secs_f64());
        lock(&self.model).log = Some(view::Log { seconds, position, speed });
    }

    fn first(&self) -> Instant {
        self.frames.first().map_or(Instant::ZERO, |(at, _)| *at)
    }

    fn length(&self) -> Duration {
        self.frames.last().map_or(Duration::ZERO, |(at, _)| at.since(self.first()))
    }
}

/// Seconds as a duration; zero if negative.
pub(super) fn micros(seconds: f64) -> Duration {
    Duration::from_micros((seconds * 1e6) as u64)
}
