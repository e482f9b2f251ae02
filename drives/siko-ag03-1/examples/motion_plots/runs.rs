//! The runs of the simulated drive for the pictures, frame by frame, and their samples.

use std::error::Error;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lexican_pictures::{AMBER, BLUE, Curve, Event, GREEN, Lane, ORANGE, PURPLE, Panel, Picture};
use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::object::{Object, Value, Writable};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use siko_ag03_1::od;
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::SimulatedDrive;
use siko_ag03_1::sim::inputs::Shaft;
use siko_ag03_1::words::{control, status, system};

type Outcome<T> = Result<T, Box<dyn Error>>;
/// The name of a file, and what draws it.
type Named = (&'static str, fn() -> Outcome<Picture>);
/// A name, a colour, and what stops a drive.
type Way = (&'static str, &'static str, fn(&mut Stage) -> Outcome<()>);

/// All pictures.
pub(crate) const PICTURES: &[Named] = &[
    ("positioning.svg", positioning),
    ("loop.svg", by_loop),
    ("inching.svg", inching),
    ("velocity.svg", velocity),
    ("stops.svg", stops),
    ("fault.svg", fault),
];

const NODE: NodeId = NodeId::literal(5);
/// How often the camera looks.
const FRAME: Duration = Duration::from_millis(5);

fn positioning() -> Outcome<Picture> {
    let mut stage = Stage::new(od::OperatingMode::PROFILE_POSITION)?;
    stage.note("travel to 3000: a-Pos 50 %, v-Pos 30 rev/min");
    stage.travel_to(3000)?;
    stage.rest();
    stage.pass(500);
    stage.write(od::MOTOR_PARAMETER_SET.d_pos(), od::Deceleration(10))?;
    stage.note("travel to 0, with d-Pos 10 %");
    stage.travel_to(0)?;
    stage.pass(1000);
    stage.note("Stop (control word, bit 8): interrupted");
    stage.control(ENABLE | control::NEW_SETPOINT | control::STOP)?;
    stage.rest();
    stage.pass(500);
    stage.note("Stop taken back: resumed");
    stage.control(ENABLE | control::NEW_SETPOINT)?;
    stage.rest();
    stage.pass(500);
    let lanes = vec![
        stage.lane("active (bit 14)", PURPLE, |seen| seen.status & status::POSITIONING != 0),
        stage.lane("moving (bit 15)", BLUE, |seen| seen.status & status::MOVING != 0),
        stage.lane("reached (bit 10)", GREEN, |seen| seen.status & status::TARGET_REACHED != 0),
    ];
    Ok(stage.picture(
        "Positioning",
        "Ramps up with a-Pos and down with d-Pos; a travel that is interrupted stays active (2.2.1, 7.5)",
        vec![stage.positions(), stage.velocities(), Panel::lanes("status word 6041h", lanes)],
    ))
}

fn by_loop() -> Outcome<Picture> {
    let mut stage = Stage::new(od::OperatingMode::PROFILE_POSITION)?;
    stage.write(od::POS_TYPE, od::PositioningType::LOOP_PLUS)?;
    for (target, text) in
        [(2000, "travel to 2000: in positive direction anyway"), (800, "travel to 800: beyond it by 800, and back")]
    {
        stage.note(text);
        stage.travel_to(target)?;
        stage.rest();
        stage.pass(500);
    }
    let lanes = vec![
        stage.lane("active (bit 14)", PURPLE, |seen| seen.system & system::POSITIONING != 0),
        stage.lane("against (bit 9)", ORANGE, |seen| seen.system & system::AGAINST_APPROACH != 0),
        stage.lane("in window (bit 3)", GREEN, |seen| seen.system & system::IN_POSITION != 0),
    ];
    Ok(stage.picture(
        "Loop positioning, loop +",
        "Every target is approached in positive direction, so that the play of a spindle does not matter (2.2.1.1)",
        vec![stage.positions(), stage.velocities(), Panel::lanes("system status word 1002h", lanes)],
    ))
}

fn inching() -> Outcome<Picture> {
    let mut stage = Stage::new(od::OperatingMode::PROFILE_POSITION)?;
    stage.write(od::DELTA_JOG, od::Position(800))?;
    stage.note("inching 1: a step of Delta Inch, 800");
    stage.control(ENABLE | control::INCHING_1)?;
    stage.rest();
    stage.pass(500);
    stage.inch(control::INCHING_2_POSITIVE, "positive", "let go, stop mode 0: full deceleration")?;
    stage.write(od::STOP_MODE_INCHING_MODE_2, od::InchingStop::PROGRAMMED_DECELERATION)?;
    stage.write(od::MOTOR_PARAMETER_SET.a_inch(), od::Acceleration(20))?;
    stage.inch(control::INCHING_2_NEGATIVE, "negative, a-Inch 20 %", "let go, stop mode 1: a-Inch")?;
    stage.write(od::INCHING_2_OFFSET, od::SpeedShare(50))?;
    stage.inch(control::INCHING_2_NEGATIVE, "negative, offset 50 %", "let go")?;
    Ok(stage.picture(
        "Inching",
        "One step of a given width, or as long as a bit of the control word is 1 (2.2.1.2; parameters 8, 9, 17, 25, 30)",
        vec![stage.positions(), stage.velocities()],
    ))
}

fn velocity() -> Outcome<Picture> {
    let mut stage = Stage::new(od::OperatingMode::PROFILE_VELOCITY)?;
    for (target, text) in [(68, "run at +68 rev/min"), (30, "+30 rev/min"), (-72, "-72 rev/min: through zero")] {
        stage.note(text);
        stage.target(target.into());
        stage.send(0x505, control_and_target(ENABLE, target))?;
        stage.pass(1400);
    }
    stage.note("Stop (control word, bit 8)");
    stage.target(0.0);
    stage.control(ENABLE | control::STOP)?;
    stage.pass(1400);
    let lanes = vec![
        stage.lane("reached (bit 10)", GREEN, |seen| seen.status & status::TARGET_REACHED != 0),
        stage.lane("stands (bit 12)", PURPLE, |seen| seen.status & status::STANDSTILL != 0),
    ];
    Ok(stage.picture(
        "Velocity mode",
        "Ramps of a-Rot, 50 %, from whatever the velocity is to the new target (2.2.2); the velocities are those of table 26",
        vec![
            stage.velocities(),
            stage.positions(),
            Panel::lanes("status word 6041h", lanes),
        ],
    ))
}

fn stops() -> Outcome<Picture> {
    let ways: [Way; 4] = [
        ("Stop, d-Pos 25 %", BLUE, |stage| stage.control(ENABLE | control::NEW_SETPOINT | control::STOP)),
        ("released", PURPLE, |stage| stage.control(0)),
        // With bit 2 cleared.
        ("Quick Stop, fault", ORANGE, |stage| stage.control(0x0002)),
        ("blocked", GREEN, |stage| {
            stage.world(|drive, now| drive.set_inputs(now, |inputs| inputs.shaft = Shaft::Blocked));
            Ok(())
        }),
    ];
    let (mut velocities, mut positions, mut last) = (Vec::new(), Vec::new(), None);
    for (name, color, stop) in ways {
        let mut stage = Stage::new(od::OperatingMode::PROFILE_POSITION)?;
        stage.write(od::MOTOR_PARAMETER_SET.v_pos(), od::Speed(60))?;
        stage.write(od::MOTOR_PARAMETER_SET.d_pos(), od::Deceleration(25))?;
        stage.note("travel to 10000: a-Pos 50 %, v-Pos 60 rev/min");
        stage.travel_to(10_000)?;
        stage.pass(1000);
        stage.note("stopped, in one of four ways");
        stop(&mut stage)?;
        stage.pass(1250);
        velocities.push(stage.curve(name, color, |seen| seen.velocity_rpm));
        positions.push(stage.curve("", color, |seen| seen.position));
        last = Some(stage);
    }
    let panels =
        vec![Panel::curves("velocity [rev/min]", velocities), Panel::curves("position [increments]", positions)];
    Ok(last.ok_or("there are ways to stop")?.picture(
        "Ways to stop",
        "As programmed; without torque (Disable Voltage, reset, no supply: 50 % is assumed); with 100 %; and at once",
        panels,
    ))
}

fn fault() -> Outcome<Picture> {
    let mut stage = Stage::new(od::OperatingMode::PROFILE_POSITION)?;
    stage.note("travel to 2500");
    stage.travel_to(2500)?;
    stage.pass(1000);
    stage.note("something holds the shaft");
    stage.world(|drive, now| drive.set_inputs(now, |inputs| inputs.shaft = Shaft::Blocked));
    stage.pass(500);
    stage.note("fault B, EMCY 7121h: two blinks");
    stage.pass(4000);
    stage.note("the shaft is free");
    stage.world(|drive, now| drive.set_inputs(now, |inputs| inputs.shaft = Shaft::Free));
    stage.pass(1000);
    stage.note("fault reset, EMCY 0000h; enabled again");
    stage.control(0)?;
    stage.control(control::FAULT_RESET)?;
    stage.enable()?;
    stage.pass(500);
    stage.note("travel to 2500");
    stage.travel_to(2500)?;
    stage.rest();
    stage.pass(500);
    let lanes = vec![
        stage.lane("lag error", ORANGE, |seen| seen.system & system::LAG_ERROR != 0),
        stage.lane("fault", PURPLE, |seen| seen.system & system::FAULT != 0),
        stage.lane("in window", BLUE, |seen| seen.system & system::IN_POSITION != 0),
    ];
    let leds = vec![
        stage.lane("status LED", GREEN, |seen| seen.status_led),
        stage.lane("bus LED", AMBER, |seen| seen.bus_led),
    ];
    Ok(stage.picture(
        "A blocked shaft",
        "First a lag error, which is a warning; after half a second fault B, until somebody resets it (5.1, 5.2, 7.14)",
        vec![
            stage.positions(),
            stage.velocities(),
            Panel::lanes("system status word 1002h", lanes),
            Panel::lanes("LEDs", leds),
        ],
    ))
}

/// Enable Operation.
const ENABLE: u16 = 0x000F;

/// RPDO3 and RPDO4: the control word and a target.
fn control_and_target(word: u16, target: i32) -> [u8; 6] {
    let ([a, b], [c, d, e, f]) = (word.to_le_bytes(), target.to_le_bytes());
    [a, b, c, d, e, f]
}

/// A drive that is enabled, and a camera.
struct Stage {
    bus: VirtualBus,
    link: VirtualLink,
    simulated: Arc<Mutex<SimulatedDrive>>,
    film: Vec<Seen>,
    began: Instant,
    events: Vec<Event>,
    /// What it is to reach, from when on.
    targets: Vec<(f64, f64)>,
}

impl Stage {
    fn new(mode: od::OperatingMode) -> Outcome<Self> {
        // A bus on which frames take no time, so that everything happens when it is ordered.
        let bus = VirtualBus::new();
        let simulated = Arc::new(Mutex::new(SimulatedDrive::new(&MODEL, NODE)));
        bus.attach(Arc::clone(&simulated));
        let (link, began) = (bus.link(), bus.now());
        let mut stage =
            Stage { bus, link, simulated, film: Vec::new(), began, events: Vec::new(), targets: Vec::new() };
        stage.write(od::MODES_OF_OPERATION, mode)?;
        stage.send(0x000, [0x01, NODE.get()])?;
        stage.enable()?;
        stage.film.clear();
        stage.pass(500);
        Ok(stage)
    }

    fn send<const N: usize>(&mut self, id: u16, data: [u8; N]) -> Outcome<()> {
        let id = CobId::standard(id).ok_or("an identifier has 11 bits")?;
        self.link.send(&Frame::from_array(id, data))?;
        self.pass(0);
        Ok(())
    }

    /// RPDO1.
    fn control(&mut self, word: u16) -> Outcome<()> {
        self.send(0x205, word.to_le_bytes())
    }

    fn enable(&mut self) -> Outcome<()> {
        [0x0106, 0x0107, 0x010F].into_iter().try_for_each(|word| self.control(word))
    }

    fn travel_to(&mut self, target: i32) -> Outcome<()> {
        self.target(target.into());
        self.control(ENABLE)?;
        self.send(0x405, control_and_target(ENABLE | control::NEW_SETPOINT, target))
    }

    /// Inching 2 for a second and a half.
    fn inch(&mut self, bit: u16, how: &str, end: &str) -> Outcome<()> {
        self.note(&format!("inching 2, {how}"));
        self.control(ENABLE)?;
        self.control(ENABLE | bit)?;
        self.pass(1500);
        self.note(end);
        self.control(ENABLE)?;
        self.pass(1000);
        Ok(())
    }

    fn write<T: Value, A: Writable, M, D>(&mut self, object: Object<T, A, M, D>, value: T) -> Outcome<()> {
        let address = object.address();
        let ([low, high], [a, b, c, d, ..]) = (address.index().to_le_bytes(), value.to_raw().to_le_bytes());
        let unused = 4 - T::DATA_TYPE.bits().unwrap_or(32) / 8;
        self.send(0x605, [0x23 | unused << 2, low, high, address.sub(), a, b, c, d])
    }

    /// Lets time pass.
    fn pass(&mut self, ms: u64) {
        self.advance_to(self.bus.now() + Duration::from_millis(ms));
    }

    fn advance_to(&mut self, until: Instant) {
        loop {
            let next = self.began + FRAME.times(self.film.len() as u32);
            self.bus.advance_to(next.min(until));
            if next > until {
                return;
            }
            let now = self.bus.now();
            let drive = lock(&self.simulated);
            let (shaft, lights) = (drive.shaft(now), drive.lights(now));
            self.film.push(Seen {
                at_s: now.since(self.began).as_secs_f64(),
                position: shaft.position,
                // 1600 increments are one revolution.
                velocity_rpm: shaft.velocity * 60.0 / 1600.0,
                status: drive.status_word(now),
                system: drive.controller().system_status(now),
                status_led: lights.status,
                bus_led: lights.bus,
            });
        }
    }

    /// Lets time pass until the shaft rests.
    fn rest(&mut self) {
        let rest = lock(&self.simulated).controller().motion().rest_at();
        self.advance_to(rest.unwrap_or(self.bus.now()));
    }

    fn now_s(&self) -> f64 {
        self.bus.now().since(self.began).as_secs_f64()
    }

    fn note(&mut self, text: &str) {
        self.events.push(Event { at_s: self.now_s(), text: text.to_owned() });
    }

    fn target(&mut self, target: f64) {
        self.targets.push((self.now_s(), target));
    }

    fn world(&mut self, change: impl FnOnce(&mut SimulatedDrive, Instant)) {
        change(&mut lock(&self.simulated), self.bus.now());
    }

    fn curve(&self, name: &str, color: &'static str, value: impl Fn(&Seen) -> f64) -> Curve {
        let points = self.film.iter().map(|seen| (seen.at_s, value(seen))).collect();
        Curve { color: Some(color), ..Curve::new(name, points) }
    }

    /// A panel with what it is to reach, if that is in the same unit.
    fn panel(&self, name: &str, unit: &str, color: &'static str, has_target: bool, value: fn(&Seen) -> f64) -> Panel {
        let mut curves = vec![self.curve(name, color, value)];
        curves.extend((has_target && !self.targets.is_empty()).then(|| Curve::target(&self.targets, self.end_s())));
        Panel::curves(format!("{name} [{unit}]"), curves)
    }

    fn end_s(&self) -> f64 {
        self.film.last().map_or(0.0, |seen| seen.at_s)
    }

    fn positions(&self) -> Panel {
        self.panel("position", "increments", BLUE, !self.runs(), |seen| seen.position)
    }

    fn velocities(&self) -> Panel {
        self.panel("velocity", "rev/min", GREEN, self.runs(), |seen| seen.velocity_rpm)
    }

    /// Whether targets are velocities.
    fn runs(&self) -> bool {
        let drive = lock(&self.simulated);
        drive.stored(od::MODES_OF_OPERATION) == od::OperatingMode::PROFILE_VELOCITY
    }

    fn lane(&self, name: &'static str, color: &'static str, is_so: impl Fn(&Seen) -> bool) -> Lane {
        Lane::new(name, color, self.film.iter().map(|seen| (seen.at_s, is_so(seen))))
    }

    fn picture(&self, title: &str, subtitle: &str, panels: Vec<Panel>) -> Picture {
        Picture {
            title: title.into(),
            subtitle: subtitle.into(),
            axis: "time [s]".into(),
            span: 0.0..self.end_s(),
            panels,
            events: self.events.clone(),
        }
    }
}

/// What the camera sees.
struct Seen {
    at_s: f64,
    position: f64,
    velocity_rpm: f64,
    status: u16,
    system: u16,
    status_led: bool,
    bus_led: bool,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
