//! The driver for programs that block, with any number of drives on one network.
//!
//! [`blocking`](crate::Drive) drives have a link each, so an adapter serves only one. Here a [`Runner`] runs the
//! network of all drives: two of them travel at once when both have been started, or in two threads.

use std::fmt;
use std::future::Future;
use std::ops::DerefMut;
use std::sync::Arc;

use ::tokio::sync::watch;
use lexican_runtime::Duration;
use lexican_runtime::host::tokio::Runner;
use lexican_runtime::object::{Mapping, Object, Readable, Rpdo, Tpdo, Value, Values, Writable};
use lexican_runtime::procedure::PdoSettings;
use lexican_runtime::profile::cia402::State;

use crate::context::DriveContext;
use crate::cyclic::{Axis, AxisSettings};
use crate::description::{Approach, Reaction, Trigger};
use crate::direction::Direction;
use crate::error::Error;
use crate::fault::Cause;
use crate::mode::Mode;
use crate::operations::operations;
use crate::outcome::{HomingOutcome, Outcome, VelocityOutcome};
use crate::parameter::ParameterSet;
use crate::protection::Protection;
use crate::sequence::{self, Difference, Progress, Recovered, Recovery, Setting, UnpacedPdo};
use crate::set_point::SetPoint;
use crate::tokio;
use crate::units::Units;

/// Stops all drives that share it, from another thread: a call under way ends with [`Error::Cancelled`] once its drive
/// stands, and so does the next call of each other drive, before it sends anything else. Clones stop the same drives.
#[derive(Clone, Debug, Default)]
pub struct StopHandle(Arc<watch::Sender<()>>);

impl StopHandle {
    /// Stops, and returns at once.
    pub fn stop(&self) {
        self.0.send_replace(());
    }

    /// The output of `done`; `None` if the drives are stopped before it is ready.
    pub async fn unless_stopped<T>(&self, done: impl Future<Output = T>) -> Option<T> {
        let mut ordered = self.0.subscribe();
        ::tokio::select! {
            biased;
            _ = ordered.changed() => None,
            done = done => Some(done),
        }
    }
}

/// A drive on a network that a [`Runner`] runs; every method blocks until its operation is over. `W` is the type that
/// wraps the drive, if any.
///
/// A drive that is dropped while it may be moving is sent a stop, and standard error says so.
pub struct Drive<K, W = Box<tokio::Drive<K>>> {
    drive: W,
    runner: Runner,
    stop: StopHandle,
    ordered: watch::Receiver<()>,
    kind: std::marker::PhantomData<fn() -> K>,
}

impl<K, W: DerefMut<Target = tokio::Drive<K>>> Drive<K, W> {
    /// `stop` stops the drive, along with all others that share it.
    #[must_use]
    pub fn new(drive: W, runner: Runner, stop: StopHandle) -> Self {
        Drive { drive, runner, ordered: stop.0.subscribe(), stop, kind: std::marker::PhantomData }
    }

    /// The wrapped drive.
    pub fn inner(&mut self) -> &mut W {
        &mut self.drive
    }

    /// The handle that it was made with.
    #[must_use]
    pub fn stop_handle(&self) -> StopHandle {
        self.stop.clone()
    }

    /// Runs an operation of the wrapped drive to its end, unless it is stopped.
    ///
    /// Errors: those of the call, and [`Error::Cancelled`].
    pub fn call<T, E: From<Error>>(&mut self, call: impl AsyncFnOnce(&mut W) -> Result<T, E>) -> Result<T, E> {
        let Drive { drive, ordered, .. } = self;
        self.runner.block_on(async {
            let done = ::tokio::select! {
                biased;
                _ = ordered.changed() => None,
                done = call(drive) => Some(done),
            };
            match done {
                Some(done) => done,
                None => Err(drive.cancel().await.into()),
            }
        })
    }

    /// Runs a sequence to its end.
    ///
    /// Errors: those of the sequence, [`Error::Cancelled`] and [`Error::MayBeMoving`].
    pub fn run<T, F>(&mut self, sequence: impl FnOnce(DriveContext) -> F) -> Result<T, Error>
    where
        F: Future<Output = Result<T, Error>>,
    {
        self.call(async |drive| drive.run(sequence).await)
    }

    /// As [`tokio::Drive::recover`].
    pub fn recover(&mut self, recovery: &Recovery) -> Result<Recovered, Error> {
        self.call(async |drive| drive.recover(recovery).await)
    }

    /// As [`tokio::Drive::unprotect`].
    pub fn unprotect(&mut self) -> Result<(), Error> {
        self.call(async |drive| drive.unprotect().await)
    }

    /// How the drive notices that this program is gone.
    #[must_use]
    pub fn protection(&self) -> Protection {
        self.drive.protection()
    }
}

macro_rules! shared {
    ($(
        $(#[$doc:meta])*
        fn $name:ident $([$($generics:tt)*])? ($context:ident $(, $argument:ident: $type:ty)*) -> $result:ty = $call:expr;
    )*) => {
        impl<K, W: DerefMut<Target = tokio::Drive<K>>> Drive<K, W> {
            $(
                $(#[$doc])*
                pub fn $name $(<$($generics)*>)? (&mut self $(, $argument: $type)*) -> Result<$result, Error> {
                    self.run(async |context: DriveContext| {
                        let $context = &context;
                        $call.await
                    })
                }
            )*
        }
    };
}

operations!(shared);

impl<K, W: DerefMut<Target = tokio::Drive<K>>> fmt::Debug for Drive<K, W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.drive.fmt(f)
    }
}
