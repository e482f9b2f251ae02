//! Configuring a PDO in the order of CiA 301, 7.5.2.36: disable, change, enable.

use super::step::Step;
use crate::cia301;
use crate::object::{Address, Direction, Mapped, Mapping, PdoDirection, Values};
use crate::wire::pdo::{PdoCobId, TransmissionType};

/// The settings of a PDO.
#[derive(Clone, Copy, Debug)]
pub struct PdoSettings<'a> {
    /// The direction, as the device sees it.
    pub direction: Direction,
    /// 1 to 512.
    pub number: u16,
    /// The COB-ID, and whether the PDO is enabled at the end.
    pub cob_id: PdoCobId,
    /// When the PDO is sent or takes effect.
    pub transmission: TransmissionType,
    /// In 100 us; `None` keeps it.
    pub inhibit_100us: Option<u16>,
    /// In ms; `None` keeps it.
    pub event_timer_ms: Option<u16>,
    /// The objects; `None` keeps a static mapping.
    pub mapping: Option<&'a [Mapped]>,
}

impl<'a> PdoSettings<'a> {
    /// A PDO with a mapping of typed handles; its times are kept.
    #[must_use]
    pub fn of<D: PdoDirection, V: Values, N>(
        number: u16,
        cob_id: PdoCobId,
        transmission: TransmissionType,
        mapping: &'a Mapping<D, V, N>,
    ) -> Self {
        let (direction, mapping) = (D::DIRECTION, Some(mapping.entries()));
        PdoSettings { direction, number, cob_id, transmission, inhibit_100us: None, event_timer_ms: None, mapping }
    }
}

/// The steps that configure a PDO. Most devices accept them in PRE-OPERATIONAL only.
pub fn configure_pdo<'a>(settings: PdoSettings<'a>) -> impl Iterator<Item = Step<'static>> + use<'a> {
    let (parameter, mapping) = match settings.direction {
        Direction::Receive => (cia301::RPDO_1, cia301::RPDO_MAPPING_1),
        Direction::Transmit => (cia301::TPDO_1, cia301::TPDO_MAPPING_1),
    };
    // A number beyond 512 is not one of a PDO, and the device will abort.
    let [parameter, mapping] = [parameter, mapping].map(|first| first.wrapping_add(settings.number).wrapping_sub(1));
    let off = [Step::value(Address::new(parameter, 1), settings.cob_id.switched_off().0)];
    let parameters = [
        Some(Step::value(Address::new(parameter, 2), settings.transmission.code())),
        settings.inhibit_100us.map(|inhibit| Step::value(Address::new(parameter, 3), inhibit)),
        settings.event_timer_ms.map(|timer| Step::value(Address::new(parameter, 5), timer)),
    ];
    let on = [Step::value(Address::new(parameter, 1), settings.cob_id.0)];
    let mapped = settings.mapping.into_iter().flat_map(move |mapped| map(mapping, mapped));
    off.into_iter().chain(parameters.into_iter().flatten()).chain(mapped).chain(on)
}

fn map<'a>(index: u16, mapped: &'a [Mapped]) -> impl Iterator<Item = Step<'static>> + use<'a> {
    let entries =
        (1_u8..).zip(mapped).map(move |(sub, entry)| Step::value(Address::new(index, sub), entry.to_parameter()));
    let len = u8::try_from(mapped.len()).unwrap_or(u8::MAX);
    let none = [Step::value(Address::new(index, 0), 0_u8)];
    none.into_iter().chain(entries).chain([Step::value(Address::new(index, 0), len)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pdo_is_switched_off_first_and_on_last() {
        let settings = PdoSettings {
            direction: Direction::Transmit,
            number: 3,
            cob_id: PdoCobId(0x385),
            transmission: TransmissionType::SynchronousCyclic(1),
            inhibit_100us: None,
            event_timer_ms: Some(100),
            mapping: Some(&[Mapped::new(0x6041, 0, 16), Mapped::new(0x6064, 0, 32)]),
        };
        let steps: std::vec::Vec<_> = configure_pdo(settings).map(|step| std::format!("{step}")).collect();
        assert_eq!(
            steps,
            [
                "write 1802:01",
                "write 1802:02",
                "write 1802:05",
                "write 1A02:00",
                "write 1A02:01",
                "write 1A02:02",
                "write 1A02:00",
                "write 1802:01",
            ]
        );
    }
}
