//! Descriptions made at run time from a data sheet.

use std::fmt;
use std::sync::{Mutex, PoisonError};

use lexican_eds::drive::{self, Drive};
use lexican_eds::{Input, Severity, load};
use lexican_runtime::profile::cia402::Modes;

use crate::description::{
    Calibration, Description, EmergencySwitch, Homing, Identity, Latches, ModeObjects, Number, Objects, Outputs, Pdo,
    Profile, Reaction, Restore, StatusBits, Store, Torques, Velocities,
};
use crate::fault::{Code, Codes};

/// Why a data sheet gives no description.
///
/// `Debug` prints all findings with the lines of the data sheet, so that a program may return the error from `main` or
/// unwrap it. `Display` is one line.
#[derive(Clone, PartialEq, Eq)]
pub struct NotADrive {
    summary: String,
    report: String,
}

/// The descriptions that have been made, each with the drive that it was made of.
static KNOWN: Mutex<Vec<(Drive, &'static Description)>> = Mutex::new(Vec::new());

impl Description {
    /// The description of the drive of a data sheet: what the data sheet says, and CiA 402 for the rest.
    /// `lexican_codegen::Config::driver` generates the same.
    ///
    /// ```no_run
    /// use lexican_driver::{Any, Description, Drive};
    /// use lexican_eds::{Input, Source};
    /// use lexican_runtime::NodeId;
    /// use lexican_runtime::host::BusUrl;
    ///
    /// fn main() -> Result<(), lexican_runtime::host::MainError> {
    ///     let eds = std::fs::read("servo.eds")?;
    ///     let description = Description::of_data_sheet(&Input::new(Source::from_bytes("servo.eds", &eds)))?;
    ///     let link = "slcan:/dev/ttyACM0?bitrate=500000".parse::<BusUrl>()?.open()?;
    ///     let mut drive = Drive::<_, Any>::connect_described(link, NodeId::literal(5), description)?;
    ///     drive.enable()?;
    ///     println!("{:?}", drive.move_to(1000)?);
    ///     Ok(())
    /// }
    /// ```
    ///
    /// Drives, errors and faults refer to their description and may outlive each other. So a description that is read
    /// is kept until the program ends. Data sheets that say the same give the same description, so that a program may
    /// read them as often as it likes.
    ///
    /// What the driver ignores because the data sheet contradicts CiA 402 is a warning of [`lexican_eds::drive::read`].
    ///
    /// Errors: [`NotADrive`], when the device is not a drive of CiA 402, or lacks what every driver needs.
    pub fn of_data_sheet(input: &Input) -> Result<&'static Description, NotADrive> {
        let (device, _) = load(input);
        let (drive, findings) = drive::read(&device);
        let Some(drive) = drive else {
            let first = findings.iter().find(|finding| finding.severity == Severity::Error);
            let why = first.map_or_else(String::new, |finding| finding.render_short(input));
            return Err(NotADrive { summary: why, report: findings.render(input) });
        };
        Ok(Description::of_drive(drive))
    }

    /// As [`of_data_sheet`](Self::of_data_sheet), for a data sheet that was already [read](lexican_eds::drive::read).
    #[must_use]
    pub fn of_drive(drive: Drive) -> &'static Description {
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, description)) = known.iter().find(|(other, _)| *other == drive) {
            return description;
        }
        let description: &'static Description = Box::leak(Box::new(describe(&drive)));
        known.push((drive, description));
        description
    }
}

fn describe(drive: &Drive) -> Description {
    let base = Description::CIA_402;
    let number = |wanted: Option<drive::Number>, otherwise: Number| wanted.map_or(otherwise, number);
    let names = drive.identity.name.as_deref().map(|name| rows(vec![text(name)]));
    let codes = Modes::CIA_402.0.iter().filter(|(code, _)| drive.modes.contains(code)).copied();
    let faults = drive.codes.iter().map(|code| Code { number: code.number, label: "", text: text(&code.text) });
    let latched = |position: &drive::Number| {
        Latches::CIA_402.rows.iter().find(|row| row.position.address().index() == position.index).copied()
    };
    let latches = rows(drive.latched.iter().filter_map(latched).collect());
    let reactions = drive.option_codes.iter().filter_map(|code| {
        let (reaction, _) = Reaction::CIA_402.iter().find(|(_, number)| number.address().index() == code.index)?;
        Some((*reaction, self::number(*code)))
    });
    let homing = drive.homing.as_ref().map(|homing| Homing {
        method: self::number(homing.method),
        offset: self::number(homing.offset),
        methods: if homing.methods.is_empty() { Homing::CIA_402.methods } else { rows(homing.methods.clone()) },
        ..Homing::CIA_402
    });
    Description {
        name: text(&drive.name),
        identity: Identity {
            vendor_ids: rows(drive.identity.vendor_ids.clone()),
            profile: drive.identity.profile,
            names,
            ..base.identity
        },
        objects: Objects {
            control_word: self::number(drive.control_word),
            status_word: self::number(drive.status_word),
            actual_position: number(drive.actual_position, base.objects.actual_position),
            actual_velocity: drive.actual_velocity.map(self::number),
            target_position: number(drive.target_position, base.objects.target_position),
            position_window: drive.position_window.map(self::number),
            position_limits: drive.position_limits.map(|limits| limits.map(self::number)),
            latest_fault: number(drive.latest_fault, base.objects.latest_fault),
            ..base.objects
        },
        outputs: Outputs {
            control: drive.outputs.control.as_ref().map(pdo),
            position: drive.outputs.position.as_ref().map(pdo),
            velocity: drive.outputs.velocity.as_ref().map(pdo),
        },
        always_four_bytes: drive.always_four_bytes,
        inputs: rows(drive.inputs.iter().map(pdo).collect()),
        status: StatusBits {
            velocity_unit: drive.velocity_unit().map_or(base.status.velocity_unit, text),
            ..base.status
        },
        modes: ModeObjects {
            chosen: self::number(drive.mode),
            shown: drive.mode_display.map(self::number),
            codes: Modes(rows(codes.collect())),
        },
        codes: Codes { faults: rows(faults.collect()), ..base.codes },
        profile: drive.profile.map(|it| Profile {
            velocity: self::number(it.velocity),
            acceleration: it.acceleration.map(self::number),
            deceleration: it.deceleration.map(self::number),
        }),
        velocity: drive.target_velocity.map(|it| Velocities { target: self::number(it), ..Velocities::CIA_402 }),
        torque: drive.torque.map(|it| Torques { target: self::number(it.target), actual: self::number(it.actual) }),
        interpolated_position: drive.interpolated_position.map(self::number),
        latches: (!latches.is_empty()).then_some(Latches { rows: latches, ..Latches::CIA_402 }),
        reactions: rows(reactions.collect()),
        homing,
        calibration: drive.homing.as_ref().and_then(drive::Homing::on_the_spot).map(Calibration::Homing),
        store: drive.store.map(|all| Store { all: self::number(all), ..Store::CIA_301 }),
        restore: drive.restore.map(|all| Restore { all: self::number(all), ..Restore::CIA_301 }),
        emergencies: drive
            .emergencies
            .map(|object| EmergencySwitch { object: self::number(object), ..EmergencySwitch::CIA_301 }),
        ..base
    }
}

fn number(number: drive::Number) -> Number {
    let data_type = number.data_type.known().expect("a number has a data type of CiA 301");
    let at = Number::new(number.index, number.sub, data_type);
    number.limits.map_or(at, |(low, high)| at.within(low, high))
}

fn pdo(pdo: &drive::Pdo) -> Pdo {
    Pdo { base: pdo.base, signals: rows(pdo.signals.clone()) }
}

/// Kept until the program ends: see [`Description::of_data_sheet`].
fn text(text: &str) -> &'static str {
    String::leak(text.to_owned())
}

/// Kept until the program ends.
fn rows<T>(rows: Vec<T>) -> &'static [T] {
    Vec::leak(rows)
}

impl fmt::Display for NotADrive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.summary)
    }
}

impl fmt::Debug for NotADrive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n\n{}", self.summary, self.report)
    }
}

impl std::error::Error for NotADrive {}

#[cfg(test)]
mod tests {
    use lexican_eds::{Source, library};

    use super::*;

    #[test]
    fn a_data_sheet_that_is_read_again_gives_the_same_description() {
        for shipped in library::all() {
            let first = Description::of_data_sheet(&shipped.input()).unwrap();
            assert_eq!(first.findings(), [""; 0], "{}", shipped.id);
            let second = Description::of_data_sheet(&shipped.input()).unwrap();
            assert!(std::ptr::eq(first, second), "{}", shipped.id);
        }
    }

    #[test]
    fn what_is_not_a_drive_is_an_error_with_its_place() {
        let eds = "[MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n[1000]\nParameterName=Type\nDataType=7\nDefaultValue=402\n";
        let error = Description::of_data_sheet(&Input::new(Source::new("x.eds", eds))).unwrap_err();
        assert_eq!(error.to_string(), "x.eds:4:2: error[drive::no-object]: there is no 6040h (control word)");
        assert!(format!("{error:?}").contains("there is no 606Ch"), "{error:?}");
    }
}
