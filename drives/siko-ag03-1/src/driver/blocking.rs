//! The driver over a link, one operation after the other.

use std::future::Future;
use std::pin::pin;
use std::task::Poll;

use lexican_runtime::host::Link;
use lexican_runtime::object::{Object, Readable, Value, Writable};
use lexican_runtime::{Duration, NodeId};

use super::description::{AG03_1, Description};
use super::error::{Error, Outcome, VelocityOutcome};
use super::sequence::{self, Difference, Progress, Setting};
use super::session::Session;
use super::units::Units;
use super::{Desk, Mode};
use crate::Direction;
use crate::fault::Cause;
use crate::od;
use crate::parameter::ParameterSet;
use crate::state::State;

/// A drive at the other end of a link. Every method blocks until its operation is over.
///
/// A drive that is dropped while it may be moving is told to stop, and standard error says so. A process that is
/// killed drops nothing: see [the module](super) for what to arm.
#[derive(Debug)]
pub struct Drive<L: Link> {
    link: Option<L>,
    session: Session,
    patience: Duration,
}

impl<L: Link> Drive<L> {
    /// Connects to the AG03/1 at `node`, and makes sure that it is one. Nothing is changed in the drive.
    ///
    /// # Errors
    ///
    /// [`Error::NotThisDrive`]; [`Error::Sdo`] when nobody answers.
    pub fn connect(link: L, node: NodeId) -> Result<Self, Error> {
        Drive::connect_as(link, node, &AG03_1)
    }

    /// The same for a drive with another description.
    ///
    /// # Errors
    ///
    /// As [`Drive::connect`].
    pub fn connect_as(link: L, node: NodeId, description: &'static Description) -> Result<Self, Error> {
        let session = Session::new(node, description);
        let mut drive = Drive { link: Some(link), session, patience: Duration::from_secs(600) };
        match drive.identify() {
            // Its power has only just come on: now it is there.
            Err(Error::Restarted) => drive.identify()?,
            identified => identified?,
        }
        Ok(drive)
    }

    fn identify(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::identify(&desk).await)
    }

    /// How long travels may take until they count as timed out; ten minutes unless told otherwise.
    pub fn set_patience(&mut self, patience: Duration) {
        self.patience = patience;
    }

    /// Leaves the drive as it is, moving or not, and gives the link back.
    #[must_use]
    pub fn release(mut self) -> L {
        self.session.desk().lock().moving = false;
        self.link.take().expect("a drive has its link until it is released")
    }

    /// The state of the state machine.
    ///
    /// # Errors
    ///
    /// When the drive cannot be read.
    pub fn state(&mut self) -> Result<State, Error> {
        self.run(async |desk: Desk| sequence::state(&desk).await)
    }

    /// Leads the drive to OPERATION ENABLED, by way of NMT OPERATIONAL.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] without supply; [`Error::Fault`] in FAULT; [`Error::NoReaction`].
    pub fn enable(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::enable(&desk).await)
    }

    /// Stops the drive with its programmed deceleration, then releases the motor.
    ///
    /// # Errors
    ///
    /// [`Error::NoReaction`], [`Error::Fault`].
    pub fn disable(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::disable(&desk).await)
    }

    /// Brakes with full deceleration and forgets the travel; the motor keeps its torque.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] outside OPERATION ENABLED, where nothing is to be stopped; [`Error::NotStopped`].
    pub fn quick_stop(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::quick_stop(&desk).await)
    }

    /// Resets a fault and says what it was; `None` when there was none.
    ///
    /// # Errors
    ///
    /// [`Error::Fault`] when its cause is still there.
    pub fn reset_fault(&mut self) -> Result<Option<Cause>, Error> {
        self.run(async |desk: Desk| sequence::reset_fault(&desk).await)
    }

    /// Changes the operating mode, unless it is set already.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] while a travel is under way.
    pub fn set_mode(&mut self, mode: Mode) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::set_mode(&desk, mode).await)
    }

    /// Travels to `target`, in units of positions, and waits for the end.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] with every condition that is not met, before anything moves.
    pub fn move_to(&mut self, target: i32) -> Result<Outcome, Error> {
        self.move_to_watched(target, |_| {})
    }

    /// The same, and tells how far the travel has come whenever the drive says so.
    ///
    /// # Errors
    ///
    /// As [`Drive::move_to`].
    pub fn move_to_watched(&mut self, target: i32, watch: impl FnMut(Progress) + Send) -> Result<Outcome, Error> {
        self.start_moving_to(target)?;
        self.finish_watched(watch)
    }

    /// Starts to travel to `target`; returns once the drive has taken the order.
    ///
    /// # Errors
    ///
    /// As [`Drive::move_to`].
    pub fn start_moving_to(&mut self, target: i32) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::start_travel(&desk, target).await)
    }

    /// Waits until the travel under way is over.
    ///
    /// # Errors
    ///
    /// When the drive cannot be read.
    pub fn finish(&mut self) -> Result<Outcome, Error> {
        self.finish_watched(|_| {})
    }

    /// The same, and tells how far the travel has come whenever the drive says so.
    ///
    /// # Errors
    ///
    /// As [`Drive::finish`].
    pub fn finish_watched(&mut self, mut watch: impl FnMut(Progress) + Send) -> Result<Outcome, Error> {
        let patience = self.patience;
        self.run(async |desk: Desk| sequence::finish(&desk, patience, &mut watch).await)
    }

    /// Interrupts the travel under way; returns once the drive stands.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] when no travel is under way.
    pub fn interrupt(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::interrupt(&desk).await)
    }

    /// Goes on with an interrupted travel, also after torque deactivation.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] when no travel is under way.
    pub fn resume(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::resume(&desk).await)
    }

    /// Inching operation 1: travels once by 2415h, and waits for the end.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] before anything moves.
    pub fn step(&mut self) -> Result<Outcome, Error> {
        let patience = self.patience;
        self.run(async |desk: Desk| sequence::step(&desk, patience).await)
    }

    /// Inching operation 2: moves until [`Drive::stop_inching`], or until a limit is passed.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] before anything moves.
    pub fn inch(&mut self, direction: Direction) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::inch(&desk, direction).await)
    }

    /// Ends inching operation 2, and says where the drive stands.
    ///
    /// # Errors
    ///
    /// When the drive cannot be read.
    pub fn stop_inching(&mut self) -> Result<i32, Error> {
        self.run(async |desk: Desk| sequence::stop_inching(&desk).await)
    }

    /// Runs at `velocity`, in rev/min, whose sign is the direction; waits until it is reached.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] before anything moves.
    pub fn run_at(&mut self, velocity: i32) -> Result<VelocityOutcome, Error> {
        let patience = self.patience;
        self.run(async |desk: Desk| sequence::run_at(&desk, velocity, patience).await)
    }

    /// Stops the drive in velocity mode; returns once it stands.
    ///
    /// # Errors
    ///
    /// When the drive cannot be read.
    pub fn stop(&mut self) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::stop(&desk).await)
    }

    /// Makes `position` the actual position.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] while a travel is under way; [`Error::Sdo`] when it is outside the limits.
    pub fn calibrate(&mut self, position: i32) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::calibrate(&desk, position).await)
    }

    /// Restores a set of parameters to factory settings; all of them for `None`.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] while a travel is under way.
    pub fn restore(&mut self, set: Option<ParameterSet>) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::restore(&desk, set).await)
    }

    /// Reads all parameters of table 6.
    ///
    /// # Errors
    ///
    /// When the drive cannot be read.
    pub fn read_parameters(&mut self) -> Result<Vec<Setting>, Error> {
        self.run(async |desk: Desk| sequence::read_parameters(&desk).await)
    }

    /// Which of the settings the drive does not have.
    ///
    /// # Errors
    ///
    /// When the drive cannot be read.
    pub fn compare_parameters(&mut self, settings: &[Setting]) -> Result<Vec<Difference>, Error> {
        self.run(async |desk: Desk| sequence::compare_parameters(&desk, settings).await)
    }

    /// Writes those settings that differ.
    ///
    /// # Errors
    ///
    /// [`Error::Refused`] while a travel is under way; [`Error::Sdo`] with the first one that the drive refuses.
    pub fn write_parameters(&mut self, settings: &[Setting]) -> Result<(), Error> {
        self.run(async |desk: Desk| sequence::write_parameters(&desk, settings).await)
    }

    /// What one count of a position is worth, as the drive is set up.
    ///
    /// # Errors
    ///
    /// When the drive cannot be read.
    pub fn units(&mut self) -> Result<Units, Error> {
        Ok(Units {
            spindle_pitch_10um: self.read(od::SPINDLE_PITCH)?.0,
            numerator: self.read(od::GEAR_RATIO.numerator())?,
            denominator: self.read(od::GEAR_RATIO.denominator())?,
        })
    }

    /// Reads an object.
    ///
    /// # Errors
    ///
    /// [`Error::Sdo`].
    pub fn read<T: Value, A: Readable, M>(&mut self, object: Object<T, A, M>) -> Result<T, Error> {
        self.run(async |desk: Desk| desk.read(object).await)
    }

    /// Writes an object.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] before anything is sent; [`Error::Sdo`].
    pub fn write<T: Value, A: Writable, M>(&mut self, object: Object<T, A, M>, value: T) -> Result<(), Error> {
        self.run(async |desk: Desk| desk.write(object, value).await)
    }

    /// Lets time pass, and keeps listening meanwhile.
    ///
    /// # Errors
    ///
    /// [`Error::Link`], [`Error::Restarted`].
    pub fn pass(&mut self, span: Duration) -> Result<(), Error> {
        self.run(async |desk: Desk| desk.pass(span).await)
    }

    /// Runs a sequence to its end: this is all that the shell does.
    ///
    /// # Errors
    ///
    /// Those of the sequence, and [`Error::Link`].
    pub fn run<T, F>(&mut self, sequence: impl FnOnce(Desk) -> F) -> Result<T, Error>
    where
        F: Future<Output = Result<T, Error>>,
    {
        let session = &mut self.session;
        let link = self.link.as_mut().expect("a drive has its link until it is released");
        // What came since the last operation is old, and may be older than what is sent now.
        while let Some(frame) = link.receive_frame(link.now())? {
            session.handle_frame(link.now(), &frame);
        }
        session.begin(link.now());
        let mut sequence = pin!(sequence(session.desk()));
        loop {
            let polled = session.poll(link.now(), sequence.as_mut());
            while let Some(frame) = session.poll_transmit(link.now()) {
                link.send(&frame)?;
            }
            if let Poll::Ready(result) = polled {
                return result;
            }
            let until = session.poll_timeout().unwrap_or(link.now());
            match link.receive_frame(until)? {
                Some(frame) => session.handle_frame(link.now(), &frame),
                None => session.handle_timeout(link.now()),
            }
        }
    }
}

impl<L: Link> Drop for Drive<L> {
    fn drop(&mut self) {
        let Some(stop) = self.session.desk().let_go() else { return };
        let told = self.link.as_mut().is_some_and(|link| link.send(&stop).is_ok());
        let what = if told { "it has been told to stop" } else { "it could not be told to stop" };
        eprintln!("the drive at node {} was let go while it may be moving: {what}", self.session.node());
    }
}
