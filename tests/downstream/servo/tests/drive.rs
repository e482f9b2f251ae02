//! The generated driver moves a servo, and reading the data sheet at run time gives the same driver.

use lexican_driver::description::{Description, Identity, Release};
use lexican_driver::{Any, Error, HomingOutcome, Kind, Mode, Outcome};
use lexican_eds::{Input, Source};
use lexican_runtime::NodeId;
use lexican_runtime::host::{VirtualBus, VirtualLink};
use lexican_runtime::profile::cia402::State;
use servo::{Drive, od, otherwise};
use simulator::SimulatedServo;
use simulator::servo::ServoModel;

const NODE: NodeId = NodeId::literal(5);
const SHEET: &str = include_str!("../eds/servo.eds");
const SERVO: ServoModel = ServoModel { storage: |node| Box::new(od::storage(node)), ..ServoModel::CIA_402 };

/// A bus with a servo of the data sheet.
fn bus() -> VirtualLink {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(SimulatedServo::new(bus.now(), &SERVO, NODE));
    bus.link()
}

#[test]
fn the_driver_of_a_data_sheet_moves_its_drive() {
    let mut drive = Drive::connect(bus(), NODE).unwrap();
    drive.enable().unwrap();
    assert_eq!(drive.state().unwrap(), State::OperationEnabled);
    assert_eq!(drive.move_to(5000).unwrap(), Outcome::Reached { position: 5000 });
    drive.calibrate(-20).unwrap();
    assert_eq!(drive.read(od::POSITION_ACTUAL_VALUE).unwrap(), -20);
    assert!(matches!(drive.home(35), Ok(HomingOutcome::Attained { .. })));
    assert!(matches!(drive.home(1), Err(Error::Unsupported { .. })), "the data sheet has 33 to 35");
    assert!(matches!(drive.move_to(100_001), Err(Error::OutOfRange(_))), "the limits of the data sheet");
    assert!(matches!(drive.set_mode(Mode::CyclicTorque), Err(Error::Unsupported { .. })));
    drive.disable().unwrap();
}

/// The drive with a name that it does not have.
const NAMED: Description = Description {
    identity: Identity { names: Some(&["Servo 8"]), ..od::driver::DESCRIPTION.identity },
    ..od::driver::DESCRIPTION
};

/// The drive with a quirk that it does not have.
const QUIRKY: Description = Description { release: Release::WhenOver, ..od::driver::DESCRIPTION };

enum Named {}
enum Quirky {}

impl Kind for Named {
    const DESCRIPTION: &'static Description = &NAMED;
}

impl Kind for Quirky {
    const DESCRIPTION: &'static Description = &QUIRKY;
}

#[test]
fn a_drive_with_another_name_is_not_commanded() {
    let error = lexican_driver::Drive::<_, Named>::connect(bus(), NODE).unwrap_err();
    assert_eq!(error.to_string(), "the node is not a Servo: vendor 2Ah, profile 402, name \"Servo 7\"");
}

#[test]
fn a_quirk_is_a_field_of_another_description() {
    let mut drive = lexican_driver::Drive::<_, Quirky>::connect(bus(), NODE).unwrap();
    drive.enable().unwrap();
    assert_eq!(drive.move_to(5000).unwrap(), Outcome::Reached { position: 5000 });
}

#[test]
fn a_data_sheet_that_is_read_gives_the_generated_description() {
    let read = Description::of_data_sheet(&Input::new(Source::new("servo.eds", SHEET))).unwrap();
    let generated = od::driver::DESCRIPTION;
    assert_eq!(format!("{read:#?}"), format!("{generated:#?}"));
    assert_eq!(generated.findings(), [""; 0]);
    let mut drive = lexican_driver::Drive::<_, Any>::connect_described(bus(), NODE, read).unwrap();
    drive.enable().unwrap();
    assert_eq!(drive.move_to(-300).unwrap(), Outcome::Reached { position: -300 });
}

#[test]
fn what_one_data_sheet_has_and_another_has_not_is_generated_as_it_is_read() {
    let sheet = include_str!(concat!(env!("OUT_DIR"), "/otherwise.eds"));
    let read = Description::of_data_sheet(&Input::new(Source::new("otherwise.eds", sheet))).unwrap();
    let (generated, servo) = (otherwise::driver::DESCRIPTION, od::driver::DESCRIPTION);
    assert_eq!(format!("{read:#?}"), format!("{generated:#?}"));
    // The fields in which the other data sheet differs.
    assert_eq!((generated.identity.vendor_ids.len(), servo.identity.vendor_ids), (2, &[0x2A][..]));
    assert!(generated.objects.actual_velocity.is_none() && servo.objects.actual_velocity.is_some());
    assert!(generated.profile.is_some() && servo.profile.is_none());
}
