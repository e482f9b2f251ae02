//! The orders of a sequence: by PDO or by SDO, as the description says.

use lexican_runtime::wire::nmt::NmtCommand;
use lexican_runtime::wire::sdo::{ClientRequest, Content, Expedited};
use lexican_runtime::{CobId, Frame};

use super::DriveContext;
use crate::description::{Description, Number, Pdo, Signal};
use crate::error::{Capability, Error};
use crate::mode::Mode;
use crate::protection::Protection;

impl DriveContext {
    /// Sends an NMT command.
    pub fn command(&self, command: NmtCommand) {
        self.send(Frame::from_array(CobId::NMT, [command.code(), self.node.get()]));
    }

    /// Sends a control word by PDO or by SDO, and replaces one that waits for SYNC.
    ///
    /// Errors: by SDO, as [`DriveContext::write`]; none by PDO.
    pub async fn control(&self, word: u16) -> Result<(), Error> {
        // Replaces first: otherwise a SYNC in between would make the drive obey the waiting control word.
        if let Some(frame) = self.replacing_frame(word) {
            self.send(frame);
        }
        match self.description.outputs.control {
            Some(_) => self.send(self.control_frame(word)),
            None => self.set(self.description.objects.control_word, word.into()).await?,
        }
        Ok(())
    }

    /// Sends a target position, and then the control word if they do not share a PDO.
    pub async fn control_position(&self, word: u16, target: i32) -> Result<(), Error> {
        let Description { outputs, objects, .. } = self.description;
        self.order(word, outputs.position, Signal::TargetPosition, objects.target_position, target).await
    }

    /// Sends a target velocity, and then the control word if they do not share a PDO.
    pub async fn control_velocity(&self, word: u16, target: i32) -> Result<(), Error> {
        let velocity = self.need(self.description.velocity, Capability::Mode(Mode::Velocity))?;
        let pdo = self.description.outputs.velocity;
        self.order(word, pdo, Signal::TargetVelocity, velocity.target, target).await
    }

    async fn order(
        &self,
        word: u16,
        pdo: Option<Pdo>,
        signal: Signal,
        target: Number,
        value: i32,
    ) -> Result<(), Error> {
        match pdo {
            Some(pdo) => {
                let values = [(Signal::ControlWord, word.into()), (signal, value.into())];
                self.send(pdo.frame(self.node, self.description, &values));
                if pdo.carries(Signal::ControlWord) {
                    self.lock().held = (signal == Signal::TargetPosition).then_some(value);
                    return Ok(());
                }
            }
            None => self.set(target, value.into()).await?,
        }
        self.control(word).await
    }

    /// The frame that replaces the control word that the drive may hold until SYNC.
    pub(super) fn replacing_frame(&self, word: u16) -> Option<Frame> {
        let target = self.lock().held?;
        let values = [(Signal::ControlWord, word.into()), (Signal::TargetPosition, target.into())];
        Some(self.description.outputs.start_by_sync()?.frame(self.node, self.description, &values))
    }

    /// The frame that gives the drive a control word; an answer to it is not awaited.
    pub(super) fn control_frame(&self, word: u16) -> Frame {
        match self.description.outputs.control {
            Some(pdo) => pdo.frame(self.node, self.description, &[(Signal::ControlWord, word.into())]),
            None => self.setting_frame(self.description.objects.control_word, word.into()),
        }
    }

    /// The frame that writes an object of one to four bytes; the answer is not awaited.
    pub(crate) fn setting_frame(&self, object: Number, value: i64) -> Frame {
        let payload = self.payload(object, value);
        let content = Content::Expedited(Expedited::new(payload.bytes()).expect("an object of one to four bytes"));
        let request = ClientRequest::InitiateDownload { address: object.address(), content };
        Frame::from_array(CobId::of_node(0x600, self.node), request.to_bytes())
    }

    /// The writes that disarm the protection: 0 to its object, then the former values of all objects that were written.
    pub(crate) fn disarming(&self, protection: Protection) -> Vec<(Number, i64)> {
        let Some(switch) = protection.switch() else { return Vec::new() };
        let before = self.lock().before.clone();
        let back = before.into_iter().filter(|(object, value)| *value != 0 || *object != switch);
        [(switch, 0)].into_iter().chain(back).collect()
    }

    pub(crate) fn send(&self, frame: Frame) {
        self.lock().outbox.push_back(frame);
    }
}
