//! Running machines in both shells, on simulated devices in virtual time.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use lexican_eds::Source;
use lexican_machine::parameters::{backup_machine, restore_machine};
use lexican_machine::{BoxedLink, Files, Machine, MachineError, What, blocking, tokio as asynchronous};
use lexican_runtime::host::tokio::Network;
use lexican_runtime::host::{Link, Pace, VirtualBus};
use lexican_runtime::object::TimeOfDay;
use lexican_runtime::profile::cia402::State;
use lexican_runtime::{Duration, NodeId};
use lexican_simulation::{Plant, Segment, SimulatedDevice, command};
use lexican_toolbox::drive::Ending;
use lexican_toolbox::parameters::restore::Options;
use lexican_toolbox::parameters::{OnProgress, Progress};

const MACHINE: &str = r#"
[bus]
manager = 127
heartbeat = "100 ms"                     # the lift watches it

[node.feeder]
id = 5
sheet = "siko/ag03-1"
guarding = "100 ms"
settings = { "spindle pitch" = "4.00 mm" }

[node.lift]
id = 6
sheet = "kollmorgen/akd"
heartbeat = "100 ms"
optional = true
tpdo.3 = { inhibit = "20 ms" }
tpdo.4 = { inhibit = "20 ms" }

[wire]
"feeder.statusword" = "manager"
"#;

/// The devices of the machine, and the control of their simulation.
#[derive(Clone)]
struct Devices {
    bus: VirtualBus,
    segment: Arc<Mutex<Segment<SimulatedDevice>>>,
}

impl Devices {
    fn new() -> (Machine, Vec<BoxedLink>, Devices) {
        let machine = Machine::parse(Source::new("machine.toml", MACHINE), Files::Embedded(&[]));
        assert!(!machine.findings.has_errors(), "{}", machine.findings.render(&machine.input));
        let bus = VirtualBus::with_bit_rate(500);
        let segment = Plant::of_machine(&machine).unwrap().segment(bus.now()).unwrap();
        let segment = Arc::new(Mutex::new(segment));
        bus.attach(Arc::clone(&segment));
        (machine, vec![Box::new(bus.link())], Devices { bus, segment })
    }

    /// The booted machine in the blocking shell, and its drives.
    fn at_work() -> (blocking::Machine, blocking::Drive, blocking::Drive, Devices) {
        let (file, links, devices) = Devices::new();
        let machine = blocking::Machine::over(links, file).unwrap();
        machine.boot().unwrap();
        let [feeder, lift] = ["feeder", "lift"].map(|name| {
            let mut drive = machine.drive(name).unwrap();
            drive.enable().unwrap();
            drive
        });
        (machine, feeder, lift, devices)
    }

    /// The answer of a device to a line of its simulation.
    fn tell(&self, node: &str, line: &str) -> String {
        let now = self.bus.now();
        let mut segment = self.segment.lock().unwrap();
        let device = segment.nodes_mut().find(|device| device.is_called(node)).unwrap();
        device.carry_out(now, &command::parse(line).unwrap().unwrap()).unwrap()
    }
}

/// The reported events up to and including `last`.
fn until(events: &mut blocking::Events, last: &str) -> Vec<String> {
    let mut said = Vec::new();
    while !said.iter().any(|line: &String| line.starts_with(last)) {
        let event = events.next(Duration::from_secs(5)).unwrap();
        said.push(event.unwrap_or_else(|| panic!("no {last:?} after {said:#?}")).to_string());
    }
    said
}

/// Finding, booting, mapping, typed reading and writing, two axes at once, EMCY, a lost heartbeat, and its return.
#[test]
fn the_whole_job_in_the_blocking_shell() -> Result<(), MachineError> {
    let (file, links, devices) = Devices::new();
    let machine = blocking::Machine::over(links, file)?;
    let mut events = machine.events();
    machine.boot()?;
    until(&mut events, "feeder: Statusword = ");
    let io = machine.node("feeder")?;
    io.set("position window", "0.05 mm")?;
    io.write(siko_ag03_1::od::POSITION_WINDOW, siko_ag03_1::od::PositionWindow(3))?;
    assert_eq!(io.get("position window")?.text(), "0.03 mm");
    let (mut feeder, mut lift) = (machine.drive("feeder")?, machine.drive("lift")?);
    feeder.enable()?;
    lift.enable()?;
    feeder.start_moving_to("12 mm")?;
    lift.start_moving_to("60000")?;
    assert_eq!(Ending::from(lift.finish()?), Ending::Reached);
    assert_ne!(io.get("position actual value")?.text(), "+12.00 mm", "both were under way");
    assert_eq!(Ending::from(feeder.finish()?), Ending::Reached);
    assert_eq!(io.get("position actual value")?.text(), "+12.00 mm");
    machine.move_together(&mut [(&mut feeder, "0 mm"), (&mut lift, "0")])?;
    devices.tell("lift", "fault = 0x4310");
    until(&mut events, "lift: EMCY 4310h");
    devices.tell("lift", "power off");
    until(&mut events, "lift: is lost");
    devices.tell("lift", "power on");
    let said = until(&mut events, "lift: has booted");
    assert!(said.contains(&"lift: boot-up".to_owned()), "{said:#?}");
    Ok(())
}

/// Saved values are restored. A restore that is stopped reports its progress, and can be continued.
#[test]
fn parameters_are_saved_and_restored() -> Result<(), Box<dyn std::error::Error>> {
    let (file, links, _devices) = Devices::new();
    let machine = blocking::Machine::over(links, file)?;
    let (inner, runner) = machine.inner();
    let feeder = machine.node("feeder")?;
    assert_eq!(runner.block_on(asynchronous::scan(inner.network(), Duration::from_millis(500))).len(), 2);
    feeder.set("spindle pitch", "4.00 mm")?;
    feeder.set("position window", "0.05 mm")?;
    let go_on = &mut |_: Progress<'_>| ControlFlow::Continue(());
    let archive = backup_machine(inner, runner, TimeOfDay::default(), go_on)?;
    assert_eq!((archive.nodes.len(), archive.missing().count()), (2, 0));
    feeder.set("spindle pitch", "0 mm")?;
    feeder.set("position window", "raw:9")?;
    let at_the_second = &mut |progress: Progress<'_>| match progress {
        Progress::Writing { at: 2, .. } => ControlFlow::Break(()),
        _ => ControlFlow::Continue(()),
    };
    let restore = |see: OnProgress<'_>| restore_machine(inner, runner, &archive, Options::default(), false, see);
    let stopped = restore(at_the_second).unwrap_err().to_string();
    assert!(stopped.starts_with("it was interrupted; feeder: 1 parameter written"), "{stopped}");
    let restored = restore(go_on)?;
    assert_eq!(restored.iter().map(|it| it.outcome.written.len()).sum::<usize>(), 1);
    assert_eq!(feeder.get("position window")?.text(), "0.05 mm");
    Ok(())
}

#[tokio::test(flavor = "current_thread")]
async fn the_whole_job_on_tokio() -> Result<(), MachineError> {
    let (file, links, devices) = Devices::new();
    let machine = asynchronous::Machine::over(links, file)?;
    let mut events = machine.events();
    machine.boot().await?;
    let io = machine.node("feeder")?;
    io.set("position window", "0.05 mm").await?;
    assert_eq!(io.read(siko_ag03_1::od::POSITION_WINDOW).await?, siko_ag03_1::od::PositionWindow(5));
    let (mut feeder, mut lift) = (machine.drive("feeder").await?, machine.drive("lift").await?);
    feeder.enable().await?;
    lift.enable().await?;
    let (fed, lifted) = tokio::join!(feeder.move_to("12 mm"), lift.move_to("60000"));
    assert_eq!((fed?, lifted?), (Ending::Reached, Ending::Reached));
    devices.tell("lift", "fault = 0x4310");
    while !matches!(events.next().await.unwrap().what, What::Emergency(_)) {}
    devices.tell("lift", "power off");
    while events.next().await.unwrap().what != What::Lost {}
    devices.tell("lift", "power on");
    while events.next().await.unwrap().what != What::Booted {}
    Ok(())
}

/// For a program that finds nodes while it runs.
#[tokio::test(flavor = "current_thread")]
async fn a_node_is_named_on_a_network_that_is_there() -> Result<(), MachineError> {
    let (_, mut links, _devices) = Devices::new();
    let network = Network::spawn(links.remove(0))?;
    let named = |words: &str| {
        let file = Machine::parse(Source::new("words", words), Files::Embedded(&[]));
        asynchronous::Machine::beside(network.clone(), file)
    };
    let machine = named("[node.other]\nid = 5\nsheet = 'siko/ag03-1'\n")?;
    assert_eq!(machine.node("other")?.get("spindle pitch").await?.text(), "0.00 mm");
    let node = |bus: &str| format!("[bus.{bus}]\n[node.of-{bus}]\nbus = '{bus}'\nid = 5\nsheet = 'siko/ag03-1'\n");
    let error = named(&(node("left") + &node("right"))).unwrap_err();
    assert_eq!(error.to_string(), "words has 2 buses, and 1 links are given");
    Ok(())
}

#[test]
fn when_one_of_several_drives_jams_the_others_are_stopped() -> Result<(), MachineError> {
    let (machine, mut feeder, mut lift, devices) = Devices::at_work();
    devices.tell("feeder", "shaft = blocked");
    let ended = machine.move_together(&mut [(&mut feeder, "12 mm"), (&mut lift, "1000000")]);
    let said = ended.unwrap_err().to_string();
    assert!(said.starts_with("feeder: ") && said.ends_with("; all drives that moved with it are stopped"), "{said}");
    assert_eq!(lift.velocity()?, 0);
    Ok(())
}

/// On one of the buses, a drive has no node-ID until it gets one by LSS, as `lexican boot` does it.
const BUSES: &str = r#"
[bus.left]
[bus.right]

[kind.axis]
id = 5
sheet = "servo.eds"
heartbeat = "100 ms"
protection = "none"

[node.feeder]
bus = "left"
kind = "axis"

[node.lift]
bus = "right"
kind = "axis"
lss = true
identity = { vendor = 1, product = 2, revision = 3, serial = 4 }
"#;

#[test]
fn drives_on_two_buses_are_one_machine() -> Result<(), MachineError> {
    let sheet = include_str!("../../../tests/conformance/servo.eds").replace("LSS_Supported=0", "LSS_Supported=1");
    let read = || Machine::parse(Source::new("machine.toml", BUSES), Files::Embedded(&[("servo.eds", &sheet)]));
    let file = read();
    let link = |bus| -> BoxedLink { Box::new(Plant::of_machine(bus).unwrap().link(Pace::Virtual).unwrap()) };
    let machine = blocking::Machine::over(file.buses().map(link).collect(), file)?;
    let mut events = machine.events();
    machine.boot()?;
    let said = until(&mut events, "right: the machine is ready");
    assert!(said.contains(&"lift: has booted".to_owned()), "{said:#?}");
    let (mut feeder, mut lift) = (machine.drive("feeder")?, machine.drive("lift")?);
    feeder.enable()?;
    lift.enable()?;
    machine.move_together(&mut [(&mut feeder, "1000"), (&mut lift, "2000")])?;
    let position = |name| Ok::<_, MachineError>(machine.node(name)?.get("6064")?.text().to_owned());
    assert_eq!([position("feeder")?, position("lift")?], ["1000", "2000"]);
    let none = blocking::Machine::over(Vec::new(), read()).unwrap_err().to_string();
    assert_eq!(none, "machine.toml has 2 buses, and 0 links are given");
    Ok(())
}

/// Another thread has the handle, such as that of a signal.
#[test]
fn the_stop_handle_stops_every_drive() -> Result<(), MachineError> {
    let (machine, mut feeder, mut lift, _devices) = Devices::at_work();
    feeder.start_moving_to("100 mm")?;
    lift.start_moving_to("10000000")?;
    let stop = machine.stop_handle();
    std::thread::spawn(move || stop.stop()).join().unwrap();
    for drive in [&mut feeder, &mut lift] {
        let error = drive.finish().unwrap_err();
        assert!(error.to_string().ends_with("has been stopped"), "{error}");
        assert_eq!((drive.velocity()?, drive.state()?), (0, State::OperationEnabled));
    }
    Ok(())
}

/// The frames of a stop are on the bus when the machine is dropped, though nothing runs it any more.
#[test]
fn a_drive_that_is_dropped_on_its_way_is_stopped() -> Result<(), MachineError> {
    let (machine, mut feeder, lift, devices) = Devices::at_work();
    let mut other = devices.bus.link();
    feeder.start_moving_to("100 mm")?;
    machine.pass(Duration::from_secs(1))?;
    assert_ne!(feeder.velocity()?, 0);
    drop((feeder, lift, machine));
    // The machine's life guarding ends, too: without the stop, the drive would notice that only much later.
    let until = devices.bus.now() + Duration::from_millis(250);
    while other.receive_frame(until).unwrap().is_some() {}
    assert!(devices.tell("feeder", "get 606C").ends_with("= 0 rev/min"));
    Ok(())
}

/// The machine monitors and is monitored while its program does something else.
#[test]
fn between_calls_a_thread_runs_the_machine_in_real_time() -> Result<(), MachineError> {
    let (file, _, devices) = Devices::new();
    devices.bus.set_pace(Pace::RealTime);
    let machine = blocking::Machine::over(vec![Box::new(devices.bus.link())], file)?;
    machine.boot()?;
    let (mut other, mut heard) = (devices.bus.link(), 0);
    let until = devices.bus.now() + Duration::from_secs(1);
    while let Some(frame) = other.receive_frame(until).unwrap() {
        heard += usize::from(frame.id().raw() == 0x77F);
    }
    assert!(heard > 2, "{heard} heartbeats of the manager within a second");
    Ok(())
}

#[test]
fn what_a_machine_has_not_is_said_with_what_is_meant() {
    let (file, links, _) = Devices::new();
    let machine = blocking::Machine::over(links, file).unwrap();
    let error = machine.node("feder").unwrap_err().to_string();
    assert_eq!(error, "machine.toml: there is no node \"feder\"; did you mean `feeder`?");
    let feeder = machine.node("feeder").unwrap();
    assert_eq!(feeder.id(), NodeId::literal(5));
    for (object, value, said) in [
        ("positon window", "1 mm", "feeder: the data sheet names no object \"positon window\"; did you mean "),
        ("statusword", "1", "feeder: 6041:00: the data sheet says ro"),
        ("position window", "1 kg", "feeder: "),
    ] {
        let error = feeder.set(object, value).unwrap_err().to_string();
        assert!(error.starts_with(said), "{error}");
    }
    let file = Machine::parse(Source::new("m.toml", "[node.a]\nid = 300"), Files::Embedded(&[]));
    let error = file.sound().unwrap_err().to_string();
    assert!(error.contains("m.toml:2:6") && error.starts_with("m.toml cannot be used"), "{error}");
}
