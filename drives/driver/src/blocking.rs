//! The driver over a link, one operation after the other.

use std::fmt;
use std::future::Future;
use std::marker::PhantomData;
use std::pin::pin;
use std::task::Poll;

use lexican_runtime::host::{Link, LinkError};
use lexican_runtime::object::{Object, Readable, Value, Writable};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, NodeId};

use crate::description::Approach;
use crate::desk::Desk;
use crate::direction::Direction;
use crate::error::{Error, Outcome, VelocityOutcome};
use crate::fault::Cause;
use crate::kind::Kind;
use crate::mode::Mode;
use crate::operations::operations;
use crate::parameter::ParameterSet;
use crate::sequence::{self, Difference, Progress, Setting};
use crate::session::Session;
use crate::units::Units;

/// A drive of the kind `K` at the other end of a link. Every method blocks until its operation is over.
///
/// A drive that is dropped while it may be moving is told to stop, and standard error says so. A process that is
/// killed drops nothing: see [the crate](crate#what-stops-the-drive-when-the-application-does-not).
pub struct Drive<L: Link, K: Kind> {
    link: Option<L>,
    session: Session,
    kind: PhantomData<fn() -> K>,
}

impl<L: Link, K: Kind> Drive<L, K> {
    /// Connects to the drive at `node`, and makes sure that it is of this kind, and has the COB-IDs that the driver
    /// goes by. Nothing is changed in the drive.
    ///
    /// # Errors
    ///
    /// [`Error::NotThisDrive`], [`Error::OtherCobId`]; [`Error::Sdo`] when nobody answers.
    pub fn connect(link: L, node: NodeId) -> Result<Self, Error> {
        let session = Session::new(node, K::DESCRIPTION);
        let mut drive = Drive { link: Some(link), session, kind: PhantomData };
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
        self.session.desk().lock().patience = patience;
    }

    /// Leaves the drive as it is, moving or not, and gives the link back.
    #[must_use]
    pub fn release(mut self) -> L {
        self.session.desk().lock().moving = false;
        self.link.take().expect("a drive has its link until it is released")
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
        catch_up(link, session)?;
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

/// Hears all that has come by now: it is old, and may be older than what is sent next.
fn catch_up<L: Link>(link: &mut L, session: &mut Session) -> Result<(), LinkError> {
    while let Some(frame) = link.receive_frame(link.now())? {
        session.handle_frame(link.now(), &frame);
    }
    Ok(())
}

macro_rules! blocking {
    ($(
        $(#[$doc:meta])*
        fn $name:ident $([$($generics:tt)*])? ($desk:ident $(, $argument:ident: $type:ty)*) -> $result:ty = $call:expr;
    )*) => {
        impl<L: Link, K: Kind> Drive<L, K> {
            $(
                $(#[$doc])*
                pub fn $name $(<$($generics)*>)? (&mut self $(, $argument: $type)*) -> Result<$result, Error> {
                    self.run(async |desk: Desk| {
                        let $desk = &desk;
                        $call.await
                    })
                }
            )*
        }
    };
}

operations!(blocking);

impl<L: Link, K: Kind> fmt::Debug for Drive<L, K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Drive")
            .field("kind", &K::DESCRIPTION.name)
            .field("node", &self.session.node())
            .finish_non_exhaustive()
    }
}

impl<L: Link, K: Kind> Drop for Drive<L, K> {
    fn drop(&mut self) {
        // The drive may have said that it is not enabled any more; a link that fails now fails again below.
        let _ = self.link.as_mut().map(|link| catch_up(link, &mut self.session));
        let Some(stop) = self.session.desk().let_go() else { return };
        let told = self.link.as_mut().is_some_and(|link| link.send(&stop).is_ok());
        let what = if told { "it has been told to stop" } else { "it could not be told to stop" };
        eprintln!("the drive at node {} was let go while it may be moving: {what}", self.session.node());
    }
}
