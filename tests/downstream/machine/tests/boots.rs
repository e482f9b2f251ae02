//! The machine boots in its simulation. Its PDOs are the generated structs; its boot plan is that of the file.

use std::path::Path;

use lexican_machine::Machine;
use lexican_runtime::host::{VirtualBus, VirtualLink, blocking, tokio as asynchronous};
use lexican_runtime::manager::{Event, MachinePdo as _};
use lexican_runtime::{Duration, NodeId};
use lexican_simulation::Plant;
use typed_machine::machine::{Machine as _, PLAN, cross_cutter, feeder, io};

fn read() -> Machine {
    Machine::open(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/machine.toml"))).unwrap()
}

fn bus() -> VirtualLink {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(Plant::of_machine(&read()).unwrap().segment(bus.now()).unwrap());
    bus.link()
}

#[test]
fn a_machine_boots_and_its_nodes_are_methods() {
    let mut m = blocking::Network::new(bus());
    m.boot_machine(&PLAN, |_| {}).unwrap();
    assert_eq!(m.feeder().read(feeder::MODES_OF_OPERATION).unwrap(), feeder::OperatingMode::PROFILE_POSITION);
    m.io().write(io::WRITE_OUTPUT_8_BIT.at(1).unwrap(), 3).unwrap();
    assert_eq!(m.manager().heartbeat_period(), Some(Duration::from_millis(200)));

    // The drive takes what the manager sends, and the I/O node also receives what the drive sends.
    let controlword = feeder::Controlword(6);
    m.send(&feeder::Rpdo1 { controlword }.to_frame()).unwrap();
    let until = m.now() + Duration::from_millis(100);
    let (mut seen, mut times) = (None, 0);
    while let Some(event) = m.next_event(until).unwrap() {
        let Event::Pdo { frame, .. } = event else { continue };
        times += usize::from(feeder::Tpdo1::received(&frame).is_some());
        seen = feeder::Tpdo1::received(&frame).or(seen);
    }
    let statusword = seen.expect("the drive sends its statusword").statusword;
    assert_eq!(statusword.0 & 0x6F, 0x21, "ready to switch on");
    assert!(times >= 5, "{times} times in 100 ms");
    let shown = m.io().read(io::WRITE_ANALOGUE_OUTPUT_16_BIT.at(1).unwrap()).unwrap();
    assert_eq!(shown as u16, statusword.0);
}

#[tokio::test]
async fn the_other_shell_boots_it_too() {
    let mut m = asynchronous::Network::spawn(bus()).unwrap();
    m.boot_machine(&PLAN, |_| {}).await.unwrap();
    let (feeder, cutter) = (m.feeder(), m.cross_cutter());
    let both = tokio::join!(feeder.read(feeder::STATUSWORD), cutter.read(cross_cutter::STATUSWORD));
    assert_eq!(both.0.unwrap(), both.1.unwrap());
}

/// `lexican boot` carries out the file, and the generated code the plan.
#[test]
fn the_plan_is_that_of_the_file() {
    let generated = PLAN.network::<Vec<u8>, 127>().unwrap();
    assert_eq!(format!("{generated:?}"), format!("{:?}", read().boot_plan()));
    assert_eq!(feeder::NODE, NodeId::literal(5));
    assert_eq!(io::Rpdo2::COB_ID, feeder::Tpdo1::COB_ID);
}
