//! Channel numbers, which stand for interfaces in the formats of Vector and PEAK.

use std::sync::Arc;

use super::INTERFACE;
use super::codec::WriteError;

/// Names interfaces by channel: `can0` is channel 1. Keeps the last name, so that frames share it.
#[derive(Debug)]
pub(super) struct Interfaces {
    last: (u16, Arc<str>),
}

impl Default for Interfaces {
    fn default() -> Self {
        Interfaces { last: (1, INTERFACE.into()) }
    }
}

impl Interfaces {
    pub(super) fn of(&mut self, channel: u16) -> Arc<str> {
        if self.last.0 != channel {
            self.last = (channel, format!("can{}", channel.saturating_sub(1)).into());
        }
        Arc::clone(&self.last.1)
    }
}

/// Numbers interfaces: one more than the number at the end of the name, or else the lowest free channel.
#[derive(Debug, Default)]
pub(super) struct Channels {
    names: Vec<(Arc<str>, u8)>,
}

impl Channels {
    pub(super) fn of(&mut self, interface: &Arc<str>) -> Result<u8, WriteError> {
        if let Some((_, channel)) = self.names.iter().find(|(name, _)| name == interface) {
            return Ok(*channel);
        }
        let digits = interface.trim_start_matches(|c: char| !c.is_ascii_digit());
        let wished = digits.parse::<u8>().ok().and_then(|number| number.checked_add(1));
        let is_free = |channel: &u8| !self.names.iter().any(|(_, taken)| taken == channel);
        let channel = wished.into_iter().chain(1..=u8::MAX).find(is_free).ok_or(WriteError::Interfaces)?;
        self.names.push((Arc::clone(interface), channel));
        Ok(channel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_follow_the_names_and_are_never_shared() {
        let mut channels = Channels::default();
        let mut of = |name: &str| channels.of(&name.into()).map_err(|_| ());
        assert_eq!(["can1", "vcan1", "slcan", "can2", "can1"].map(&mut of), [Ok(2), Ok(1), Ok(3), Ok(4), Ok(2)]);
        let more: Vec<_> = (0..300).map(|number| of(&format!("bus{number}"))).collect();
        assert_eq!(more.iter().filter(|channel| channel.is_ok()).count(), 255 - 4);
        let mut interfaces = Interfaces::default();
        assert_eq!([1, 2, 0, 1].map(|channel| interfaces.of(channel).to_string()), ["can0", "can1", "can0", "can0"]);
    }
}
