//! Changes of a PDO, checked before anything is sent.

use lexican_eds::model::{AccessType, Device, Entry};
use lexican_eds::types::DataType;
use lexican_runtime::host::Settings;
use lexican_runtime::object::{Address, Direction, Mapped};
use lexican_runtime::wire::pdo::{PdoCobId, TransmissionType};
use lexican_runtime::{CobId, NodeId};

use super::{PdoName, PdoState};
use crate::values::lookup::{ObjectError, describe, resolve};

/// The wanted changes of a PDO; `None` leaves a setting as it is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Change {
    /// Whether to enable it.
    pub on: Option<bool>,
    /// Its COB-ID.
    pub cob_id: Option<CobId>,
    /// When it is sent or takes effect.
    pub transmission: Option<TransmissionType>,
    /// In multiples of 100 µs.
    pub inhibit_100us: Option<u16>,
    /// In ms.
    pub event_timer_ms: Option<u16>,
    /// The objects to map, in order.
    pub mapping: Option<Vec<Mapped>>,
}

/// Why a PDO cannot be changed as wanted. Nothing has been sent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Objection {
    /// A text names no object.
    #[error(transparent)]
    Object(#[from] ObjectError),
    /// Without data sheet, the length of the object is unknown.
    #[error("the length of {0} is unknown, since no data sheet describes it")]
    UnknownLength(Address),
    /// The data sheet has `PDOMapping=0`.
    #[error("{0} cannot be mapped into a PDO: its data sheet has PDOMapping=0")]
    NotMappable(String),
    /// The access type allows mapping in the other direction only.
    #[error("{entry} is {access}: {pdo} cannot map it")]
    WrongDirection { entry: String, access: &'static str, pdo: PdoName },
    /// A string or a DOMAIN has no fixed length.
    #[error("{entry} is a {data_type}, which has no fixed length")]
    NoFixedLength { entry: String, data_type: DataType },
    /// TPDOs cannot have gaps.
    #[error("{0} cannot have a gap: only PDOs that the device receives have placeholders")]
    GapInTransmitPdo(PdoName),
    /// `[DummyUsage]` does not allow this data type for gaps.
    #[error("the device knows no gap of a {0}: its [DummyUsage] forbids it")]
    GapNotAllowed(DataType),
    /// The mapping exceeds 64 bits; the number of its bits.
    #[error("the objects have {0} bits, and a PDO has 64")]
    TooLong(u32),
    /// The mapping parameter has fewer entries than needed.
    #[error("{pdo} maps up to {most} objects, not {count}")]
    TooMany {
        pdo: PdoName,
        /// The number of objects wanted.
        count: usize,
        /// The number of entries.
        most: usize,
    },
    /// The mapping cannot be changed.
    #[error("the mapping of {pdo} is fixed: {address} is {access}")]
    FixedMapping {
        pdo: PdoName,
        /// The read-only entry.
        address: Address,
        access: &'static str,
    },
    /// The device lacks an entry for a setting.
    #[error("{pdo} has no {what}: there is no {address}")]
    NoParameter {
        pdo: PdoName,
        /// The name of the setting.
        what: &'static str,
        /// The address where the entry would be.
        address: Address,
    },
    /// The COB-ID is reserved for other services (CiA 301, 7.3.5).
    #[error("no PDO can have the COB-ID {0}h: it belongs to another service (CiA 301, 7.3.5)")]
    RestrictedCobId(CobId),
    /// The PDO is to be enabled, but has no COB-ID.
    #[error("{0} has no COB-ID, and the predefined connection set has none for it: choose one")]
    NoCobId(PdoName),
    /// The transmission type is not defined for this direction.
    #[error("{pdo} cannot have the transmission type {code}")]
    NoTransmissionType { pdo: PdoName, code: u8 },
}

/// A checked change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// The present configuration.
    pub before: PdoState,
    /// The configuration after the change.
    pub after: PdoState,
    /// Whether every write has to carry four bytes.
    in_four_bytes: bool,
}

impl Objection {
    /// What to do about it, if there is one answer.
    #[must_use]
    pub fn advice(&self) -> Option<String> {
        match self {
            Objection::Object(error) => Some(error.advice()),
            _ => None,
        }
    }
}

impl PdoName {
    /// The mapping for objects as users name them, `6041` or `statusword`, with their lengths. A data type such as
    /// `UNSIGNED16` is a gap.
    pub fn map<T: AsRef<str>>(self, device: Option<&Device>, objects: &[T]) -> Result<Vec<Mapped>, Vec<Objection>> {
        collected(objects.iter().map(|text| self.map_one(device, text.as_ref())))
    }

    fn map_one(self, device: Option<&Device>, text: &str) -> Result<Mapped, Objection> {
        if let Some(data_type) = DataType::from_name(&text.to_ascii_uppercase()) {
            return self.gap(device, data_type);
        }
        let address = resolve(device, text)?;
        let entry = device.and_then(|device| Some((device, device.entry(address.index(), address.sub())?)));
        let (device, entry) = entry.ok_or(Objection::UnknownLength(address))?;
        self.object(device, entry)
    }

    fn object(self, device: &Device, entry: &Entry) -> Result<Mapped, Objection> {
        let words = || describe(device, entry);
        let (data_type, pdo) = (entry.data_type, self);
        let bits = device.bits(data_type).filter(|bits| *bits <= 64);
        let bits = bits.ok_or_else(|| Objection::NoFixedLength { entry: words(), data_type })?;
        let against = match self.direction {
            Direction::Receive => [AccessType::Ro, AccessType::Const, AccessType::Rwr].as_slice(),
            Direction::Transmit => &[AccessType::Wo, AccessType::Rww],
        };
        if !entry.pdo_mapping {
            return Err(Objection::NotMappable(words()));
        }
        if against.contains(&entry.access) {
            return Err(Objection::WrongDirection { entry: words(), access: entry.access.name(), pdo });
        }
        Ok(Mapped::new(entry.index, entry.sub, bits))
    }

    fn gap(self, device: Option<&Device>, data_type: DataType) -> Result<Mapped, Objection> {
        if self.direction == Direction::Transmit {
            return Err(Objection::GapInTransmitPdo(self));
        }
        let is_allowed = device.is_none_or(|device| device.dummies.contains(&data_type));
        match data_type.bits().filter(|_| is_allowed) {
            Some(bits) => Ok(Mapped::new(data_type.code(), 0, bits)),
            None => Err(Objection::GapNotAllowed(data_type)),
        }
    }
}

impl Plan {
    /// Checks a change of a node's PDO, by the data sheet if there is one.
    pub fn new(
        device: Option<&Device>,
        node: NodeId,
        before: PdoState,
        change: &Change,
    ) -> Result<Plan, Vec<Objection>> {
        let (pdo, mut after, mut objections) = (before.name, before.clone(), Vec::new());
        objections.extend(change_cob_id(node, &mut after, change).err());
        if let Some(transmission) = change.transmission {
            let only_sent = matches!(transmission, TransmissionType::SynchronousRemote | TransmissionType::Remote);
            let exists = !matches!(transmission, TransmissionType::Reserved(_));
            if !exists || (only_sent && pdo.direction == Direction::Receive) {
                objections.push(Objection::NoTransmissionType { pdo, code: transmission.code() });
            }
        }
        let mut set = |what, sub, has: bool, wanted: bool| {
            let lacks = wanted && !has;
            objections.extend(lacks.then(|| Objection::NoParameter { pdo, what, address: pdo.parameter(sub) }));
        };
        set("transmission type", 2, after.transmission.is_some(), change.transmission.is_some());
        set("inhibit time", 3, after.inhibit_100us.is_some(), change.inhibit_100us.is_some());
        set("event timer", 5, after.event_timer_ms.is_some(), change.event_timer_ms.is_some());
        after.transmission = change.transmission.or(after.transmission);
        after.inhibit_100us = change.inhibit_100us.or(after.inhibit_100us);
        after.event_timer_ms = change.event_timer_ms.or(after.event_timer_ms);
        if let Some(mapping) = change.mapping.clone().filter(|mapping| *mapping != before.mapping) {
            after.mapping = mapping;
            objections.extend(length(device, &after));
        }
        if objections.is_empty() {
            Ok(Plan { before, after, in_four_bytes: device.is_some_and(|device| device.sdo_writes_four_bytes) })
        } else {
            Err(objections)
        }
    }

    /// Whether the PDO is already configured as wanted.
    #[must_use]
    pub fn changes_nothing(&self) -> bool {
        self.before == self.after
    }

    /// The writes that make the change.
    pub fn apply(&self) -> Settings {
        self.towards(&self.after)
    }

    /// The writes that restore the former configuration, wherever the change was interrupted.
    pub fn undo(&self) -> Settings {
        self.towards(&self.before)
    }

    /// The writes that set everything that the change affects to the values in `target`.
    fn towards(&self, target: &PdoState) -> Settings {
        let (before, after, name) = (&self.before, &self.after, target.name);
        let put = |settings: Settings, address, bytes: &[u8]| {
            let mut bytes = bytes.to_vec();
            bytes.resize(if self.in_four_bytes { 4 } else { bytes.len() }, 0);
            settings.set_bytes(address, &bytes)
        };
        let mut settings = Settings::new();
        if before.transmission != after.transmission {
            let code = target.transmission.map_or(0, TransmissionType::code);
            settings = put(settings, name.parameter(2), &[code]);
        }
        for (sub, differs, time) in [
            (3, before.inhibit_100us != after.inhibit_100us, target.inhibit_100us),
            (5, before.event_timer_ms != after.event_timer_ms, target.event_timer_ms),
        ] {
            if differs {
                settings = put(settings, name.parameter(sub), &time.unwrap_or(0).to_le_bytes());
            }
        }
        if before.mapping != after.mapping {
            settings = put(settings, name.mapping(0), &[target.mapping.len() as u8]);
            for (sub, mapped) in (1..).zip(&target.mapping) {
                settings = put(settings, name.mapping(sub), &mapped.to_parameter().to_le_bytes());
            }
        }
        put(settings, name.parameter(1), &target.cob_id.0.to_le_bytes())
    }
}

fn change_cob_id(node: NodeId, after: &mut PdoState, change: &Change) -> Result<(), Objection> {
    let present = Some(after.cob_id.id()).filter(|id| id.raw() != 0);
    let id = change.cob_id.or(present).or_else(|| after.name.predefined(node));
    let on = change.on.unwrap_or(after.cob_id.is_valid());
    if change.cob_id.is_none() && change.on.is_none() {
        return Ok(());
    }
    let id = match id {
        Some(id) if id.is_restricted() => return Err(Objection::RestrictedCobId(id)),
        Some(id) => PdoCobId::valid(id),
        None if on => return Err(Objection::NoCobId(after.name)),
        None => return Ok(()),
    };
    let id = if after.cob_id.allows_remote() { id } else { id.without_remote() };
    after.cob_id = if on { id } else { id.switched_off() };
    Ok(())
}

/// Checks number and total length of the mapped objects.
fn length(device: Option<&Device>, after: &PdoState) -> Vec<Objection> {
    let (pdo, count, bits) = (after.name, after.mapping.len(), after.bits());
    let entry = |sub| {
        let address = pdo.mapping(sub);
        device.and_then(|device| Some((address, device.entry(address.index(), address.sub())?)))
    };
    let is_fixed = |entry: &Entry| matches!(entry.access, AccessType::Ro | AccessType::Const);
    let fixed = (0..=count as u8).filter_map(entry).find(|(_, entry)| is_fixed(entry));
    let fixed = fixed.map(|(address, entry)| Objection::FixedMapping { pdo, address, access: entry.access.name() });
    let most = device.map_or(64, |_| (1..=64).take_while(|sub| entry(*sub).is_some()).count());
    let too_many = (count > most && fixed.is_none()).then_some(Objection::TooMany { pdo, count, most });
    let too_long = (bits > 64).then_some(Objection::TooLong(bits));
    [fixed, too_many, too_long].into_iter().flatten().collect()
}

fn collected<T>(results: impl Iterator<Item = Result<T, Objection>>) -> Result<Vec<T>, Vec<Objection>> {
    let (mut all, mut objections) = (Vec::new(), Vec::new());
    for result in results {
        match result {
            Ok(one) => all.push(one),
            Err(objection) => objections.push(objection),
        }
    }
    if objections.is_empty() { Ok(all) } else { Err(objections) }
}
