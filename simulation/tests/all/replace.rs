//! A drive is replaced, and the replacement cut at every step: by a bus that is lost, a drive that loses power, and Ctrl-C.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, Mutex};

use lexican_eds::{Input, Source};
use lexican_machine::{Files, Machine};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Fate, Incoming, Link, LinkError, VirtualBus, VirtualLink};
use lexican_runtime::object::{Object, Rw};
use lexican_runtime::wire::lss;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use lexican_simulation::{Power, SimulatedDevice};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::lss::Times;
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::Progress;
use lexican_toolbox::parameters::archive::ArchivedNode;
use lexican_toolbox::parameters::restore::{Options, Outcome, restore};
use lexican_toolbox::replace::{ReplaceError, Replacement, Replacing, Step, Watched, replace};

const NODE: NodeId = NodeId::literal(5);
const MANAGER: NodeId = NodeId::literal(127);
const VELOCITY: Object<u32, Rw> = Object::new(0x6081, 0);
const BEAT: Duration = Duration::from_millis(200);
const WATCHED: Watched = Watched { heartbeat: Some((MANAGER, BEAT)), within: Duration::from_millis(600) };

/// The servo of the conformance test, with LSS and with parameters that it can store.
fn axis() -> String {
    let sheet = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/conformance").join(name);
        std::fs::read_to_string(path).unwrap()
    };
    let (servo, encoder) = (sheet("servo.eds"), sheet("encoder.eds"));
    let servo = servo
        .replace("LSS_Supported=0", "LSS_Supported=1")
        .replace("SupportedObjects=56\n", "SupportedObjects=57\n57=0x1010\n");
    let store = encoder.split("\n\n").filter(|section| section.starts_with("[1010"));
    [servo].into_iter().chain(store.map(|section| format!("\n{section}\n"))).collect()
}

/// A place for a drive, and what it had.
struct Place {
    sheet: DataSheet,
    machine: Machine,
    archived: ArchivedNode,
}

impl Place {
    fn new() -> Self {
        let text = axis();
        let sheet = DataSheet::parse(Input::new(Source::new("axis.eds", text.as_str())));
        let machine = "[bus]\nmanager = 127\nheartbeat = \"200 ms\"\n\
                       [node.axis]\nid = 5\nsheet = \"axis.eds\"\nheartbeat = \"100 ms\"\nsettings = { 6081 = 4711 }\n";
        let machine = Machine::parse(Source::new("machine.toml", machine), Files::Embedded(&[("axis.eds", &text)]));
        assert!(!machine.findings.has_errors(), "{}", machine.findings.render(&machine.input));
        let bus = VirtualBus::with_bit_rate(500);
        bus.attach(SimulatedDevice::new(bus.now(), &sheet, Some(NODE), None).unwrap());
        let mut network = Network::new(bus.link());
        network.wait_for(BEAT, |_| None::<()>).unwrap();
        network.write(NODE, VELOCITY, 4711).unwrap();
        let mut node = RemoteNode::new(&mut network, NODE);
        let archived =
            ArchivedNode::take(&mut node, "axis", &sheet.device, &mut |_| ControlFlow::Continue(())).unwrap();
        Place { sheet, machine, archived }
    }

    fn replacement(&self) -> Replacement<'_> {
        Replacement {
            archived: &self.archived,
            sheet: &self.sheet.device,
            overlays: &[],
            identity: [None; 4],
            others: vec![MANAGER],
            assignment: self.machine.assignment(&self.machine.nodes[0], NODE),
            watched: Some(WATCHED),
            times: Times { response: Duration::from_millis(100), step: Duration::from_millis(5) },
            force: false,
        }
    }
}

/// A new drive on a bus, which keeps what it stores in a file.
struct Rig {
    bus: VirtualBus,
    drive: Arc<Mutex<SimulatedDevice>>,
}

impl Rig {
    fn new(place: &Place, name: &str, node: Option<NodeId>) -> Self {
        let eeprom = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("replace-{name}.txt"));
        let _ = std::fs::remove_file(&eeprom);
        let bus = VirtualBus::with_bit_rate(500);
        let drive = SimulatedDevice::new(bus.now(), &place.sheet, node, Some(&eeprom)).unwrap();
        let drive = Arc::new(Mutex::new(drive));
        bus.attach(Arc::clone(&drive));
        bus.advance(BEAT);
        Rig { bus, drive }
    }

    /// What is on its way is lost.
    fn switch_off_and_on(&self) {
        for power in [Power::Off, Power::On] {
            let now = self.bus.now();
            self.drive.lock().unwrap().set_power(now, power);
            self.bus.advance(Duration::from_millis(20));
        }
    }

    fn replace(&self, of: &Replacement<'_>) -> Result<Vec<Step>, ReplaceError> {
        let mut steps = Vec::new();
        let see = &mut |what: Replacing<'_>| {
            if let Replacing::Done(step) = what {
                steps.push(step.clone());
            }
            ControlFlow::Continue(())
        };
        replace(&mut self.bus.link(), of, see).map(|()| steps)
    }

    /// It has taken the place, also after its power was off.
    #[track_caller]
    fn is_in_place(&self, when: &str) {
        self.switch_off_and_on();
        self.is_configured(when);
    }

    #[track_caller]
    fn is_configured(&self, when: &str) {
        let mut network = Network::new(self.bus.link());
        network.wait_for(BEAT, |_| None::<()>).unwrap();
        assert_eq!(network.read(NODE, VELOCITY).ok(), Some(4711), "{when}");
    }
}

/// A link on which something happens behind a frame that is sent.
struct Cut<'a> {
    link: VirtualLink,
    sent: Vec<Frame>,
    after: usize,
    happens: &'a dyn Fn(),
}

impl Link for Cut<'_> {
    fn now(&self) -> Instant {
        self.link.now()
    }
    fn send(&mut self, frame: &Frame) -> Result<(), LinkError> {
        self.link.send(frame)?;
        self.sent.push(*frame);
        if self.sent.len() == self.after {
            (self.happens)();
        }
        Ok(())
    }
    fn receive(&mut self, until: Instant) -> Result<Option<Incoming>, LinkError> {
        self.link.receive(until)
    }
}

/// Whether a frame changes something: NMT, LSS but for the search, the first of a write.
fn is_step(frame: &Frame) -> bool {
    match frame.id() {
        CobId::NMT => true,
        id if id == lss::REQUEST => frame.data()[0] != 0x51,
        id if id == CobId::of_node(0x600, NODE) => frame.data()[0] >> 5 == 1,
        _ => false,
    }
}

#[test]
fn a_drive_without_node_id_takes_the_place() {
    let place = Place::new();
    let rig = Rig::new(&place, "whole", None);
    let steps = rig.replace(&place.replacement()).unwrap();
    assert_eq!(steps[0], Step::Named { before: None });
    assert!(matches!(steps[2], Step::Restored { written: 1, stored: true, .. }), "{steps:?}");
    assert!(matches!(steps[5], Step::Equal { compared } if compared > 40), "{steps:?}");
    let Step::Protected { after } = steps[4] else { panic!("{steps:?}") };
    assert!((WATCHED.within - BEAT..WATCHED.within + BEAT).contains(&after), "{after}");
    // Once more: it is seen to be there, and nothing is written.
    let again = rig.replace(&place.replacement()).unwrap();
    assert!(
        matches!(again[0], Step::Present { .. }) && matches!(again[2], Step::Restored { written: 0, .. }),
        "{again:?}"
    );
    rig.is_in_place("whole");
}

#[test]
fn a_drive_with_another_node_id_takes_the_place() {
    let place = Place::new();
    let rig = Rig::new(&place, "other-id", NodeId::new(32));
    let steps = rig.replace(&place.replacement()).unwrap();
    assert_eq!(steps[0], Step::Named { before: NodeId::new(32) });
    rig.is_in_place("other-id");
}

#[test]
fn what_cannot_take_the_place_is_told_why() {
    let place = Place::new();
    let rig = Rig::new(&place, "wrong", None);
    let mut of = place.replacement();
    // It boots, and nobody tells it to watch.
    of.assignment = Machine::parse(Source::new("machine.toml", "[node.axis]\nid = 5\n"), Files::Embedded(&[]))
        .assignment(&place.machine.nodes[0], NODE);
    assert!(matches!(rig.replace(&of), Err(ReplaceError::Unprotected(_))));
    rig.drive.lock().unwrap().set_power(rig.bus.now(), Power::Off);
    assert!(matches!(rig.replace(&place.replacement()), Err(ReplaceError::Nobody)));
    rig.drive.lock().unwrap().set_power(rig.bus.now(), Power::On);
    let mut other = place.archived.clone();
    other.identity[1] = Some(7);
    other.dcf = other.dcf.replace("ProductNumber=0x402", "ProductNumber=0x7");
    let of = Replacement { archived: &other, ..place.replacement() };
    assert!(matches!(rig.replace(&of), Err(ReplaceError::Other(_))));
}

/// What is cut: how it begins, what it does, and whether a drive is as it is to be.
struct Work {
    name: &'static str,
    node: Option<NodeId>,
    run: fn(&Place, &mut dyn Link) -> Result<(), String>,
    is_well: fn(&Rig, &str),
}

const REPLACE: Work = Work {
    name: "replace",
    node: None,
    run: |place, mut link| {
        let done = replace(&mut link, &place.replacement(), &mut |_| ControlFlow::Continue(()));
        done.map_err(|error| error.to_string())
    },
    is_well: Rig::is_in_place,
};

const RESTORE: Work = Work {
    name: "restore",
    node: Some(NODE),
    run: |place, link| {
        let (options, mut outcome) = (Options { store: true, dry_run: false }, Outcome::default());
        let (mut network, go_on) = (Network::new(link), &mut |_: Progress<'_>| ControlFlow::Continue(()));
        let (mut node, settings) = (RemoteNode::new(&mut network, NODE), place.archived.settings());
        let done = restore(&mut node, &place.sheet.device, &settings, options, go_on, &mut outcome);
        done.map_err(|error| error.to_string())?;
        if outcome.refused.is_empty() { Ok(()) } else { Err(format!("{:?}", outcome.refused)) }
    },
    is_well: Rig::is_in_place,
};

const BOOT: Work = Work {
    name: "boot",
    node: Some(NODE),
    run: |place, link| {
        let booted = Network::new(link).boot(place.machine.boot_plan(), Duration::from_secs(10), |_| {});
        booted.map_err(|error| error.to_string())
    },
    is_well: Rig::is_configured,
};

/// Runs it with something that happens behind each step, and then again.
fn cut_at_each_step(work: &Work, how: &str, happens: &dyn Fn(&Rig), again: &dyn Fn(&Rig)) {
    let place = Place::new();
    let name = format!("{}-{how}", work.name);
    let run = |rig: &Rig, after: usize| {
        let mut link = Cut { link: rig.bus.link(), sent: Vec::new(), after, happens: &|| happens(rig) };
        ((work.run)(&place, &mut link), link.sent)
    };
    let (result, sent) = run(&Rig::new(&place, &name, work.node), usize::MAX);
    result.unwrap();
    let steps = (1..=sent.len()).filter(|after| is_step(&sent[after - 1]) || after % 50 == 0);
    let (mut cuts, mut failed) = (0, 0);
    for after in steps {
        let when = format!("{name} after {after} of {}: {}", sent.len(), sent[after - 1]);
        let rig = Rig::new(&place, &name, work.node);
        let (result, _) = run(&rig, after);
        (cuts, failed) = (cuts + 1, failed + usize::from(result.is_err()));
        again(&rig);
        rig.bus.advance(BEAT);
        // What was not said to have failed is well.
        if result.is_ok() && (work.name != "boot" || after < sent.len()) {
            (work.is_well)(&rig, &when);
        }
        if let Err(error) = (work.run)(&place, &mut rig.bus.link()) {
            panic!("{when}: {error}; before: {result:?}");
        }
        (work.is_well)(&rig, &when);
    }
    println!("{name}: {cuts} cuts, {failed} of them ended it");
    // A boot begins again by itself.
    let boots_again = name == "boot-power";
    assert!(cuts > 3 && (failed > 0 || boots_again), "{name}: {cuts} cuts, {failed} failed");
}

#[test]
fn a_lost_bus_at_each_step_is_survived() {
    let lose = |rig: &Rig| rig.bus.set_fate(|_, _| Fate::Lose);
    for work in [REPLACE, RESTORE, BOOT] {
        cut_at_each_step(&work, "bus", &lose, &|rig| rig.bus.set_fate(|_, _| Fate::Deliver));
    }
}

#[test]
fn a_power_cut_at_each_step_is_survived() {
    for work in [REPLACE, RESTORE, BOOT] {
        cut_at_each_step(&work, "power", &Rig::switch_off_and_on, &|_| ());
    }
}

#[test]
fn an_interrupt_at_each_step_is_survived() {
    let place = Place::new();
    let run = |rig: &Rig, after: usize| {
        let count = Cell::new(0);
        let see = &mut |_: Replacing<'_>| {
            count.set(count.get() + 1);
            if count.get() == after { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        (replace(&mut rig.bus.link(), &place.replacement(), see), count.get())
    };
    let (result, all) = run(&Rig::new(&place, "interrupt-whole", None), usize::MAX);
    result.unwrap();
    for after in (1..=all).step_by(3) {
        let rig = Rig::new(&place, "interrupt", None);
        assert!(matches!(run(&rig, after).0, Err(ReplaceError::Ended(_))), "{after} of {all}");
        rig.replace(&place.replacement()).unwrap();
        rig.is_in_place(&format!("interrupted at {after} of {all}"));
    }
}
