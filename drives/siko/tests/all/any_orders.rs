//! Random orders of an application, and random events at the drive: when a driver is dropped, and after every order
//! that stops, the drive stands.

use std::sync::{Arc, Mutex};

use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::{CobId, Duration, Frame, NodeId};
use proptest::prelude::*;
use siko_ag03_1::Direction;
use siko_ag03_1::driver::{Drive, Error, Mode};
use siko_ag03_1::od;
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::SimulatedDrive;
use siko_ag03_1::state::State;

const NODE: NodeId = NodeId::literal(5);

#[derive(Clone, Debug)]
enum Happening {
    Enable,
    Disable,
    QuickStop,
    ResetFault,
    SetMode(bool),
    Start(i32),
    Finish,
    Interrupt,
    Resume,
    Step(i32),
    Inch(bool),
    StopInching,
    Run(i32),
    Stop,
    Calibrate,
    Pass(u64),
    Fault(bool),
    Supply(bool),
    /// Another manager sends a control word that starts nothing.
    Word(u16),
    /// Another manager sends an NMT command.
    Nmt(u8),
}

impl Happening {
    /// Whether a drive in this state stands after the driver has done this. Disabling does not change a drive without
    /// torque.
    fn stops(&self, state: State) -> bool {
        match self {
            Happening::Disable => state == State::OperationEnabled,
            Happening::QuickStop | Happening::Interrupt | Happening::StopInching | Happening::Stop => true,
            _ => false,
        }
    }
}

fn happening() -> impl Strategy<Value = Happening> {
    use Happening as H;
    prop_oneof![
        3 => Just(H::Enable),
        1 => Just(H::Disable),
        1 => Just(H::QuickStop),
        1 => Just(H::ResetFault),
        1 => any::<bool>().prop_map(H::SetMode),
        3 => (-20_000..20_000).prop_map(H::Start),
        1 => Just(H::Finish),
        1 => Just(H::Interrupt),
        1 => Just(H::Resume),
        2 => (-5000..5000).prop_map(H::Step),
        2 => any::<bool>().prop_map(H::Inch),
        1 => Just(H::StopInching),
        3 => (-200..=200).prop_map(H::Run),
        1 => Just(H::Stop),
        1 => Just(H::Calibrate),
        3 => (0_u64..3000).prop_map(H::Pass),
        1 => any::<bool>().prop_map(H::Fault),
        1 => any::<bool>().prop_map(H::Supply),
        1 => proptest::sample::select(&[0x0106, 0x0107, 0x010F, 0x0100, 0x0102, 0x011F]).prop_map(H::Word),
        1 => proptest::sample::select(&[0x01, 0x02, 0x80, 0x81, 0x82]).prop_map(H::Nmt),
    ]
}

struct Rig {
    bus: VirtualBus,
    simulated: Arc<Mutex<SimulatedDrive>>,
}

impl Rig {
    fn send(&self, id: u16, data: &[u8]) {
        let frame = Frame::new(CobId::standard(id).expect("eleven bits"), data).expect("a short frame");
        self.bus.link().send(&frame).expect("a bus");
        self.bus.advance(Duration::from_millis(1));
    }

    fn let_happen(&self, drive: &mut Drive<VirtualLink>, happening: &Happening) -> Result<(), Error> {
        let direction = |positive| if positive { Direction::Positive } else { Direction::Negative };
        match *happening {
            Happening::Enable => drive.enable(),
            Happening::Disable => drive.disable(),
            Happening::QuickStop => drive.quick_stop(),
            Happening::ResetFault => drive.reset_fault().map(drop),
            Happening::SetMode(positioning) => {
                drive.set_mode(if positioning { Mode::Positioning } else { Mode::Velocity })
            }
            Happening::Start(target) => drive.start_moving_to(target),
            Happening::Finish => drive.finish().map(drop),
            Happening::Interrupt => drive.interrupt(),
            Happening::Resume => drive.resume(),
            Happening::Step(width) => {
                drive.write(od::DELTA_JOG, od::Position(width))?;
                drive.step().map(drop)
            }
            Happening::Inch(positive) => drive.inch(direction(positive)),
            Happening::StopInching => drive.stop_inching().map(drop),
            Happening::Run(velocity) => drive.run_at(velocity).map(drop),
            Happening::Stop => drive.stop(),
            Happening::Calibrate => drive.calibrate(0),
            Happening::Pass(ms) => drive.pass(Duration::from_millis(ms)),
            Happening::Fault(there) => {
                self.simulated.lock().unwrap().set_inputs(self.bus.now(), |inputs| inputs.internal_error = there);
                Ok(())
            }
            Happening::Supply(there) => {
                let supply = if there { 240 } else { 0 };
                self.simulated
                    .lock()
                    .unwrap()
                    .set_inputs(self.bus.now(), |inputs| inputs.output_stage_supply_100mv = supply);
                Ok(())
            }
            Happening::Word(word) => {
                self.send(0x205, &word.to_le_bytes());
                Ok(())
            }
            Happening::Nmt(command) => {
                self.send(0x000, &[command, 5]);
                Ok(())
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn what_stops_a_drive_leaves_it_standing(
        speeds in (1_u8..200, 1_u8..=100, 1_u8..200, 5_u8..=100),
        happenings in proptest::collection::vec(happening(), 1..12),
    ) {
        let bus = VirtualBus::with_bit_rate(500);
        let simulated = Arc::new(Mutex::new(SimulatedDrive::new(&MODEL, NODE)));
        bus.attach(Arc::clone(&simulated));
        let rig = Rig { bus, simulated };
        let mut drive = Drive::connect_unprotected(rig.bus.link(), NODE).expect("it is there");
        drive.set_patience(Duration::from_secs(2));
        let set = od::MOTOR_PARAMETER_SET;
        drive.write(set.v_inch(), od::Speed(speeds.0)).expect("a speed");
        drive.write(set.a_inch(), od::Acceleration(speeds.1)).expect("an acceleration");
        drive.write(set.v_pos(), od::Speed(speeds.2)).expect("a speed");
        drive.write(set.a_rot(), od::Acceleration(speeds.3)).expect("an acceleration");
        drive.enable().expect("it is well");
        for happening in &happenings {
            // Any outcome is allowed, but what is reported as over must be over.
            let state = rig.simulated.lock().unwrap().state();
            let result = rig.let_happen(&mut drive, happening);
            if result.is_ok() && happening.stops(state) {
                let velocity = rig.simulated.lock().unwrap().velocity(rig.bus.now());
                prop_assert_eq!(velocity, 0, "after {:?}", happening);
            }
        }
        drop(drive);
        // From 200 rev/min with 5 % of 4 rev/s² it takes 17 s.
        for span in [20, 20] {
            rig.bus.advance(Duration::from_secs(span));
            let velocity = rig.simulated.lock().unwrap().shaft(rig.bus.now()).velocity;
            prop_assert_eq!(velocity, 0.0);
        }
    }
}
