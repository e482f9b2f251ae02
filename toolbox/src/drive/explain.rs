//! Explains whether a drive can be moved by its data sheet, without moving it: what is missing, what the driver uses
//! instead, and what has to be set.

use lexican_driver::description::Number;
use lexican_driver::{Description, DriveContext, Error, sequence};
use lexican_eds::drive::{Drive, Number as Place, read};
use lexican_eds::model::Device;
use lexican_eds::{Input, Severity};
use lexican_runtime::CobId;
use lexican_runtime::object::{Address, DataType};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::service::sdo_client::SdoError;

use super::described::described_by_hand;

/// What a fact means for moving the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Available.
    Ready,
    /// Missing or unusual; the driver does without it or uses something else.
    Instead,
    /// To be set in the drive before it can move.
    Set,
    /// Missing; the drive cannot be moved.
    Missing,
}

/// A fact on which moving a drive depends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fact {
    /// What it means for moving the drive.
    pub verdict: Verdict,
    /// The code of the finding of [`lexican_eds::drive::read`], if the fact is one.
    pub code: Option<&'static str>,
    /// The fact, with index and sub-index.
    pub text: String,
    /// What to do about it, or what the driver does instead.
    pub remedy: Option<String>,
}

impl Verdict {
    /// One word, for programs.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Verdict::Ready => "ready",
            Verdict::Instead => "instead",
            Verdict::Set => "set",
            Verdict::Missing => "missing",
        }
    }
}

impl Fact {
    /// A fact that does not come from the data sheet alone.
    #[must_use]
    pub fn new(verdict: Verdict, text: impl Into<String>, remedy: Option<String>) -> Self {
        Fact { verdict, code: None, text: text.into(), remedy }
    }

    fn instead(text: String, remedy: &str) -> Self {
        Fact::new(Verdict::Instead, text, Some(remedy.to_owned()))
    }
}

/// The description of a drive as [`describe`](super::describe) gives it, and the facts from its data sheet, the worst
/// first.
#[must_use]
pub fn explain_sheet(input: &Input, device: &Device) -> (Option<&'static Description>, Vec<Fact>) {
    if let Some(description) = described_by_hand(input) {
        let text = format!("the driver knows more of the {} than its data sheet says", description.name);
        return (Some(description), vec![Fact::new(Verdict::Ready, text, None)]);
    }
    let (drive, findings) = read(device);
    let fact = |finding: &lexican_eds::Diagnostic| Fact {
        verdict: if finding.severity == Severity::Error { Verdict::Missing } else { Verdict::Instead },
        code: Some(finding.code),
        text: finding.message.clone(),
        remedy: finding.help.clone(),
    };
    let mut facts: Vec<Fact> = findings.iter().map(fact).collect();
    if let Some(drive) = &drive {
        facts.extend(unwatched(device));
        facts.extend(ready(drive));
    }
    facts.sort_by_key(|fact| std::cmp::Reverse(fact.verdict));
    (drive.map(Description::of_drive), facts)
}

/// Entries of 1016h whose limits exclude a node-ID in bits 16 to 23 (CiA 301, 7.5.2.19).
fn unwatched(device: &Device) -> Option<Fact> {
    let consumers = device.object(0x1016)?.entries.iter().filter(|entry| entry.sub > 0);
    let highest =
        |entry: &lexican_eds::model::Entry| entry.high.as_ref().and_then(lexican_eds::model::Value::as_integer);
    let narrow = consumers.filter(|entry| highest(entry).is_some_and(|high| (1..0x1_0000).contains(&high)));
    let narrow: Vec<String> = narrow.map(|entry| format!("1016:{:02X}", entry.sub)).collect();
    let guarded = device.object(0x100C).is_some() && device.object(0x100D).is_some();
    let remedy = match guarded {
        true => "the driver uses life guarding (100Ch, 100Dh); its maker has to raise HighLimit",
        false => {
            "there is no life guarding (100Ch, 100Dh), either: the drive does not notice if the command is killed; its maker \
             has to raise HighLimit"
        }
    };
    let text = format!("{} (consumer heartbeat) has a limit of 16 bits: no node-ID fits", narrow.join(", "));
    (!narrow.is_empty()).then(|| Fact::instead(text, remedy))
}

/// Everything that the driver needs and the data sheet has.
fn ready(drive: &Drive) -> Vec<Fact> {
    let needs: [(Option<Place>, &str); 7] = [
        (Some(drive.control_word), "control word"),
        (Some(drive.status_word), "status word"),
        (Some(drive.mode), "mode of operation"),
        (drive.actual_position, "actual position"),
        (drive.actual_velocity, "actual velocity"),
        (drive.target_position, "target position"),
        (drive.target_velocity, "target velocity"),
    ];
    let fact = |(number, what): (Option<Place>, &str)| {
        let number = number?;
        let text = format!("{} ({what}) is {}", Address::new(number.index, number.sub), number.data_type);
        Some(Fact::new(Verdict::Ready, text, None))
    };
    needs.into_iter().filter_map(fact).collect()
}

/// Facts from the drive itself, which only reads from it; the driver must be connected. Objects that do not exist are
/// no error.
pub async fn explain_drive(drive: &DriveContext) -> Result<Vec<Fact>, Error> {
    let mut facts = explain_settings(drive).await?;
    match State::from_status_word(drive.status().await?) {
        Some(State::Fault | State::FaultReactionActive) => {
            let text = format!("it is in fault: {}", sequence::cause(drive).await?);
            let remedy = "remove its cause, then reset the fault: the order reset-fault";
            facts.push(Fact::new(Verdict::Set, text, Some(remedy.to_owned())));
        }
        Some(state) => facts.push(Fact::new(Verdict::Ready, format!("it is in {state}"), None)),
        None => facts.push(Fact::new(Verdict::Missing, "the status word (6041h) has no state of CiA 402", None)),
    }
    facts.sort_by_key(|fact| std::cmp::Reverse(fact.verdict));
    Ok(facts)
}

/// Facts from settings of the drive, without its state.
pub async fn explain_settings(drive: &DriveContext) -> Result<Vec<Fact>, Error> {
    let mut facts = explain_profile(drive).await?;
    let emergencies = Number::new(0x1014, 0x00, DataType::Unsigned32);
    if let Some(cob_id) = known(drive.get(emergencies).await)? {
        let cob_id = cob_id as u32;
        let usual = CobId::of_node(0x080, drive.node());
        if cob_id >> 31 != 0 {
            let text = "1014:00 switches emergency messages off".to_owned();
            facts.push(Fact::instead(text, "the driver reads from 1003h why the drive is in fault"));
        } else if CobId::from_parameter(cob_id) != usual {
            let text = format!("1014:00 has emergencies on {}h, not on {usual}h", CobId::from_parameter(cob_id));
            facts.push(Fact::instead(text, "the driver listens there; no other node may send on it"));
        }
    }
    if drive.description().identity.vendor_ids.len() != 1 {
        let vendor = known(drive.get(Number::new(0x1018, 0x01, DataType::Unsigned32)).await)?;
        let vendor = vendor.filter(|id| *id != 0).map_or("none".to_owned(), |id| format!("{id:X}h"));
        let text = format!("the data sheet leaves open whose drive it is; the vendor-ID of the node is {vendor}");
        facts.push(Fact::instead(text, "the driver takes it for the drive that was named: make sure that it is"));
    }
    Ok(facts)
}

/// Facts about velocities and ramps with which a motion would take forever or not begin.
pub async fn explain_profile(drive: &DriveContext) -> Result<Vec<Fact>, Error> {
    let Some(profile) = drive.description().profile else { return Ok(Vec::new()) };
    let mut facts = Vec::new();
    for (number, what, option) in [
        (Some(profile.velocity), "profile velocity", "--velocity"),
        (profile.acceleration, "profile acceleration", "--acceleration"),
        (profile.deceleration, "profile deceleration", "--acceleration"),
    ] {
        let Some(number) = number else { continue };
        let Some(value @ 0..=1) = known(drive.get(number).await)? else { continue };
        let object = number.address();
        let effect = match (value, option) {
            (0, "--velocity") => "the drive would take an order, and stand",
            (0, _) => "some drives then stand, others know no ramp",
            _ => "that is the least there is: the drive may creep",
        };
        let remedy = match [1000, 100, 10].into_iter().find(|value| number.check(*value).is_ok()) {
            Some(value) => format!("set it: `{option} {value}` with the order, or {object} to what fits the machine"),
            None => format!("set it: `{option}` with the order"),
        };
        facts.push(Fact::new(Verdict::Set, format!("{object} ({what}) is {value}: {effect}"), Some(remedy)));
    }
    Ok(facts)
}

fn known(read: Result<i64, Error>) -> Result<Option<i64>, Error> {
    match read {
        Ok(value) => Ok(Some(value)),
        Err(Error::Sdo(SdoError::Aborted { .. })) => Ok(None),
        Err(error) => Err(error),
    }
}
