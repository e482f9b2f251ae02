//! PDOs as frames.

use lexican_runtime::object::Mapped;
use lexican_runtime::{Frame, NodeId};

use super::{Description, Number, Pdo, Signal};

impl Pdo {
    /// The frame with these values; signals without a value are 0.
    ///
    /// # Panics
    ///
    /// When the signals take more than eight bytes.
    pub(crate) fn frame(&self, node: NodeId, description: &Description, values: &[(Signal, i64)]) -> Frame {
        let mut bytes = Vec::with_capacity(8);
        for signal in self.signals {
            let value = values.iter().find(|(given, _)| given == signal).map_or(0, |(_, value)| *value);
            let raw = description.carried(*signal).map_or(0, |number| number.encode(value));
            bytes.extend(raw.to_le_bytes().iter().take(description.carried_bytes(*signal)));
        }
        Frame::new(self.cob_id(node), &bytes).expect("the signals of a described PDO take eight bytes at most")
    }

    /// The mapping in the drive, as in 1600h:01 or 1A00h:01 and following.
    pub(crate) fn mapping(&self, description: &Description) -> Vec<Mapped> {
        let mapped = |signal: &Signal| {
            let bits = 8 * description.carried_bytes(*signal) as u8;
            let address = description.carried(*signal).map(|number| number.address());
            address.map_or(Pdo::anything(bits), |address| Mapped { address, bits })
        };
        self.signals.iter().map(mapped).collect()
    }

    /// A mapped object that the driver does not know, of this length.
    pub(crate) const fn anything(bits: u8) -> Mapped {
        Mapped::new(0, 0, bits)
    }

    /// The status word in the data of the PDO; `None` if the PDO has none, or the data are too short.
    pub(crate) fn status_word(&self, description: &Description, data: &[u8]) -> Option<u16> {
        let place = self.signals.iter().position(|signal| *signal == Signal::StatusWord)?;
        let before = self.signals.iter().take(place).map(|signal| description.carried_bytes(*signal)).sum();
        let bytes = data.get(before..)?.first_chunk::<2>()?;
        Some(u16::from_le_bytes(*bytes))
    }
}

impl Description {
    /// The object that a PDO carries.
    fn carried(&self, signal: Signal) -> Option<Number> {
        match signal {
            Signal::ControlWord => Some(self.objects.control_word),
            Signal::StatusWord => Some(self.objects.status_word),
            Signal::TargetPosition => Some(self.objects.target_position),
            Signal::TargetVelocity => self.velocity.map(|velocity| velocity.target),
            Signal::Other(_) => None,
        }
    }

    /// The bytes that it takes in the PDO.
    pub(super) fn carried_bytes(&self, signal: Signal) -> usize {
        match signal {
            Signal::Other(bytes) => bytes.into(),
            _ => self.carried(signal).map_or(0, |number| number.size()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: NodeId = NodeId::literal(5);

    #[test]
    fn signals_are_packed_in_their_order() {
        let values = [(Signal::ControlWord, 0x001F), (Signal::TargetPosition, -5000)];
        let check = |signals, frame: &str| {
            let pdo = Pdo { base: 0x400, signals };
            assert_eq!(pdo.frame(NODE, &Description::CIA_402, &values).to_string(), frame);
        };
        check(&[Signal::ControlWord, Signal::TargetPosition], "405#1F0078ECFFFF");
        check(&[Signal::TargetPosition, Signal::Other(2), Signal::ControlWord], "405#78ECFFFF00001F00");
    }

    #[test]
    fn a_status_word_is_found_wherever_it_is() {
        let word = |signals, data: &[u8]| Pdo { base: 0x380, signals }.status_word(&Description::CIA_402, data);
        assert_eq!(word(&[Signal::StatusWord], &[0x37, 0x02]), Some(0x0237));
        assert_eq!(word(&[Signal::Other(4), Signal::StatusWord], &[1, 2, 3, 4, 0x37, 0x02]), Some(0x0237));
        assert_eq!(word(&[Signal::Other(4), Signal::StatusWord], &[1, 2, 3, 4, 0x37]), None, "too short");
        assert_eq!(word(&[Signal::Other(4)], &[1, 2, 3, 4]), None);
    }
}
