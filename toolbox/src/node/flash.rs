//! Program download from the manager's side (CiA 302-3): stop, clear, write, check, start.

use std::fmt;
use std::ops::ControlFlow;

use lexican_runtime::cia301::{
    DEVICE_TYPE, PROGRAM_CONTROL, PROGRAM_DATA, PROGRAM_FLASH_STATUS, PROGRAM_SOFTWARE_IDENTIFICATION,
};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link, LinkError};
use lexican_runtime::manager::{BeginError, Event, Remote};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::crc::Crc32;
use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::{AbortCode, Duration, NodeId};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

use crate::node::followed::Followed;

/// How a boot loader deviates from CiA 302-3, whose behaviour the defaults describe. Read from a file beside its data
/// sheet.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq)]
#[serde(default, deny_unknown_fields)]
pub struct Loader {
    /// The sub-index of the program in 1F50h and 1F51h, from 1.
    pub program: u8,
    /// The value to write to 1F51h to stop the program; `None` if that is not needed.
    #[serde(deserialize_with = "order")]
    pub stop: Option<u8>,
    /// Whether the device boots after the stop, because its boot loader is another program.
    pub boots_after_stop: bool,
    /// The device type (1000h) of the boot loader, if it is not that of the program.
    pub device_type: Option<u32>,
    /// The value to write to 1F51h to clear the flash; `None` if the download clears it.
    #[serde(deserialize_with = "order")]
    pub clear: Option<u8>,
    /// The value to write to 1F51h to start the program; `None` to leave it stopped.
    #[serde(deserialize_with = "order")]
    pub start: Option<u8>,
    /// Whether the device boots after the start.
    pub boots_after_start: bool,
    /// Whether to set the node PRE-OPERATIONAL first.
    pub pre_operational: bool,
    /// Whether to transfer the program by SDO block transfer.
    pub block: bool,
    /// Whether to read 1F57h, which some boot loaders lack.
    pub flash_status: bool,
    /// What 1F56h must hold after the download.
    pub identification: Identification,
    /// How long the device may be busy or silent, in ms.
    pub patience_ms: u32,
    /// The interval of reading 1F57h, in ms.
    pub poll_ms: u32,
}

/// The meaning of the software identification (1F56h).
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Identification {
    /// Not read.
    None,
    /// Any number; it is only shown.
    Any,
    /// The CRC-32 of the image (polynomial 04C11DB7h, as in zlib).
    Crc32,
}

/// A number to write, or `false` to write none.
fn order<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u8>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "a number from 0 to 255, or false")]
    enum Order {
        Value(u8),
        None(bool),
    }
    match Order::deserialize(deserializer)? {
        Order::Value(value) => Ok(Some(value)),
        Order::None(false) => Ok(None),
        Order::None(true) => Err(D::Error::custom("a number from 0 to 255, or false")),
    }
}

impl Default for Loader {
    fn default() -> Self {
        Loader {
            program: 1,
            stop: Some(0),
            boots_after_stop: false,
            device_type: None,
            clear: Some(3),
            start: Some(1),
            boots_after_start: false,
            pre_operational: true,
            block: true,
            flash_status: true,
            identification: Identification::Any,
            patience_ms: 30_000,
            poll_ms: 100,
        }
    }
}

/// A step of the download.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Stops the program.
    Stop,
    /// Clears the flash.
    Clear,
    /// Transfers the program.
    Write,
    /// Checks whether the device holds the program.
    Check,
    /// Starts the program.
    Start,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Stage::Stop => "stopping the program",
            Stage::Clear => "clearing the flash",
            Stage::Write => "writing",
            Stage::Check => "checking",
            Stage::Start => "starting the program",
        })
    }
}

/// The progress of a download.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// The step that has begun or goes on.
    pub stage: Stage,
    /// In bytes.
    pub written: u32,
}

/// The result of a download.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Done {
    /// The software identification before, if the device has one.
    pub before: Option<u32>,
    /// The software identification afterwards.
    pub after: Option<u32>,
    /// The time that the download took.
    pub duration: Duration,
}

/// What a device holds after a failed download.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// Unknown, because it does not answer.
    Unknown,
    /// Its former program: without program control (1F51h) the program cannot be changed.
    NoControl,
    /// No valid program; it stays in its boot loader.
    Nothing,
    /// A valid program.
    Program {
        /// Whether it is running.
        runs: bool,
        /// Its software identification.
        identification: Option<u32>,
    },
}

impl fmt::Display for Held {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Held::Unknown => f.write_str("the device does not say what it holds now"),
            Held::NoControl => f.write_str("the device has no program control (1F51h), and was not changed"),
            Held::Nothing => f.write_str("the device holds no valid program now, and waits in its boot loader"),
            Held::Program { runs, identification } => {
                let runs = if *runs { "runs" } else { "is stopped" };
                write!(f, "the device holds a valid program, which {runs}")?;
                identification.map_or(Ok(()), |number| write!(f, " (1F56h: {number:08X}h)"))
            }
        }
    }
}

/// Why a download failed, and what the device holds now.
#[derive(Debug, thiserror::Error)]
#[error("{stage}: {cause}; {held}")]
pub struct FlashError {
    /// The step that failed.
    pub stage: Stage,
    /// Why.
    pub cause: Cause,
    /// What the device holds.
    pub held: Held,
}

/// Why a step failed.
#[derive(Debug, thiserror::Error)]
pub enum Cause {
    /// The device refused, or did not answer.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// 1F57h reports this error.
    #[error("the flash status (1F57h) is {0:02X}h: {text}", text = status_text(*.0))]
    Status(u8),
    /// The device was busy for longer than this, in ms.
    #[error("the device is still busy after {0} s (1F57h)")]
    Busy(u32),
    /// No boot-up message came within this time, in ms.
    #[error("no boot-up message came within {0} s")]
    NoBootUp(u32),
    /// The node that answers is not the boot loader; its device type.
    #[error("the device type (1000h) is {0:08X}h: this is not the boot loader")]
    OtherDevice(u32),
    /// 1F56h is not the checksum of the image.
    #[error("the device identifies its program as {found:08X}h (1F56h), but the image is {expected:08X}h")]
    OtherProgram {
        /// The value of 1F56h.
        found: u32,
        /// The CRC-32 of the image.
        expected: u32,
    },
    /// The user has interrupted it.
    #[error("interrupted")]
    Interrupted,
}

impl From<LinkError> for Cause {
    fn from(error: LinkError) -> Self {
        Cause::Access(error.into())
    }
}

impl From<BeginError> for Cause {
    fn from(error: BeginError) -> Self {
        unreachable!("the network has room for all nodes: {error}")
    }
}

/// The meaning of an error code of 1F57h (CiA 302-3).
fn status_text(code: u8) -> &'static str {
    match code {
        1 => "no valid program",
        2 => "the format of the data is unknown",
        3 => "the data is damaged",
        4 => "the flash was not cleared before",
        5 => "the flash could not be written",
        6 => "an address is outside the flash",
        7 => "the flash is secured",
        63 => "an error that is not specified",
        _ => "an error of the manufacturer's",
    }
}

/// Downloads a program to a node and starts it. `follow` gets the progress and may stop the download. Errors: a
/// download cannot be resumed; the next one starts from the beginning.
pub fn flash<L: Link>(
    network: &mut Network<L>,
    node: NodeId,
    loader: &Loader,
    image: &[u8],
    mut follow: impl FnMut(Progress) -> ControlFlow<()>,
) -> Result<Done, FlashError> {
    let begun = network.now();
    let mut download = Download { network, node, loader, stage: Stage::Stop };
    let before = download.identification();
    match download.run(image, &mut follow) {
        Ok(after) => Ok(Done { before, after, duration: download.network.now().since(begun) }),
        Err(cause) => {
            let stage = download.stage;
            Err(FlashError { stage, cause, held: download.held() })
        }
    }
}

/// What a node holds at present.
pub fn held<L: Link>(network: &mut Network<L>, node: NodeId, loader: &Loader) -> Held {
    Download { network, node, loader, stage: Stage::Check }.held()
}

struct Download<'a, L> {
    network: &'a mut Network<L>,
    node: NodeId,
    loader: &'a Loader,
    stage: Stage,
}

impl<L: Link> Download<'_, L> {
    fn run(
        &mut self,
        image: &[u8],
        follow: &mut impl FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Option<u32>, Cause> {
        let loader = self.loader;
        self.begin(Stage::Stop, follow)?;
        if loader.stop.is_some() {
            // Check this first: a node that cannot be flashed is not stopped.
            self.number(self.address(PROGRAM_CONTROL))?;
        }
        if loader.pre_operational {
            self.network.command(NmtCommand::EnterPreOperational, Some(self.node))?;
        }
        if let Some(stop) = loader.stop {
            self.control(stop, loader.boots_after_stop)?;
        }
        if let Some(expected) = loader.device_type {
            let found = self.number(Address::new(DEVICE_TYPE, 0))?;
            if found != expected {
                return Err(Cause::OtherDevice(found));
            }
        }
        self.begin(Stage::Clear, follow)?;
        if let Some(clear) = loader.clear {
            self.control(clear, false)?;
            self.settle(true)?;
        }
        self.begin(Stage::Write, follow)?;
        self.write(image, follow)?;
        self.begin(Stage::Check, follow)?;
        self.settle(false)?;
        let after = self.identification();
        let mut checksum = Crc32::new();
        checksum.update(image);
        let expected = checksum.get();
        if loader.identification == Identification::Crc32 && after != Some(expected) {
            return Err(Cause::OtherProgram { found: after.unwrap_or(0), expected });
        }
        self.begin(Stage::Start, follow)?;
        if let Some(start) = loader.start {
            self.control(start, loader.boots_after_start)?;
        }
        Ok(after)
    }

    fn begin(&mut self, stage: Stage, follow: &mut impl FnMut(Progress) -> ControlFlow<()>) -> Result<(), Cause> {
        self.stage = stage;
        if follow(Progress { stage, written: 0 }).is_break() { Err(Cause::Interrupted) } else { Ok(()) }
    }

    fn address(&self, index: u16) -> Address {
        Address::new(index, self.loader.program)
    }

    fn number(&mut self, address: Address) -> Result<u32, Cause> {
        let bytes = self.network.read_bytes(self.node, address)?;
        Ok(bytes.iter().take(4).rev().fold(0, |number, byte| number << 8 | u32::from(*byte)))
    }

    /// Writes 1F51h. A device that restarts may do so before it responds.
    fn control(&mut self, value: u8, boots: bool) -> Result<(), Cause> {
        let (node, address) = (self.node, self.address(PROGRAM_CONTROL));
        // Ignore boot-up messages from before.
        let now = self.network.now();
        while boots && self.network.next_event(now)?.is_some() {}
        match self.network.write_bytes(node, address, &[value]) {
            Err(AccessError::Sdo { error: SdoError::TimedOut { .. }, .. }) if boots => {}
            result => result?,
        }
        if boots {
            let is_node = |event: &Event| (*event == Event::BootedUp { node }).then_some(());
            let patience = Duration::from_millis(self.loader.patience_ms.into());
            self.network.wait_for(patience, is_node)?.ok_or(Cause::NoBootUp(self.loader.patience_ms / 1000))?;
        }
        Ok(())
    }

    /// Waits until the flash is not busy. "No valid program" is no error after clearing.
    fn settle(&mut self, is_cleared: bool) -> Result<(), Cause> {
        if !self.loader.flash_status {
            return Ok(());
        }
        let until = self.network.now() + Duration::from_millis(self.loader.patience_ms.into());
        loop {
            let status = self.number(self.address(PROGRAM_FLASH_STATUS))?;
            match (status & 1, (status >> 1 & 0x7F) as u8) {
                (0, 0) => return Ok(()),
                (0, 1) if is_cleared => return Ok(()),
                (0, code) => return Err(Cause::Status(code)),
                _ if self.network.now() >= until => return Err(Cause::Busy(self.loader.patience_ms / 1000)),
                _ => {}
            }
            self.network.wait_for(Duration::from_millis(self.loader.poll_ms.into()), |_| None::<()>)?;
        }
    }

    fn write(&mut self, image: &[u8], follow: &mut impl FnMut(Progress) -> ControlFlow<()>) -> Result<(), Cause> {
        let (now, node, address) = (self.network.now(), self.node, self.address(PROGRAM_DATA));
        let manager = self.network.manager();
        if manager.remote(node).is_none() {
            manager.add(now, Remote::new(node)).expect("there is room for all nodes");
        }
        let client = manager.sdo(node)?;
        let usual = client.clone();
        let patience = Duration::from_millis(self.loader.patience_ms.into());
        let from = if self.loader.block { 0 } else { u32::MAX };
        *client = usual.clone().with_timeout(patience).with_block_writes_from(from);
        let mut followed = Followed::new(image, |written| follow(Progress { stage: Stage::Write, written }));
        let len = u32::try_from(image.len()).expect("a program has less than 4 GiB");
        let written = self.network.write_from(node, address, len, &mut followed);
        let is_interrupted = followed.is_interrupted();
        *self.network.manager().sdo(node)? = usual;
        if is_interrupted {
            return Err(Cause::Interrupted);
        }
        Ok(written?)
    }

    fn identification(&mut self) -> Option<u32> {
        if self.loader.identification == Identification::None {
            return None;
        }
        self.number(self.address(PROGRAM_SOFTWARE_IDENTIFICATION)).ok()
    }

    fn held(&mut self) -> Held {
        match self.number(self.address(PROGRAM_CONTROL)) {
            Ok(2) => Held::Nothing,
            Ok(state) => Held::Program { runs: state == 1, identification: self.identification() },
            Err(Cause::Access(AccessError::Sdo { error: SdoError::Aborted { code, .. }, .. }))
                if [AbortCode::NO_SUCH_OBJECT, AbortCode::NO_SUCH_SUB_INDEX].contains(&code) =>
            {
                Held::NoControl
            }
            Err(_) => Held::Unknown,
        }
    }
}
