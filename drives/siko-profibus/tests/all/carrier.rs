//! The carrier of a gateway on a bus, and the functions by which tests set outputs and read inputs.

use lexican_profibus::bus::{Bus, Station};
use lexican_profibus::virtual_bus::{SlaveId, VirtualBus};
use lexican_runtime::Duration;
use siko::gateway::Carrier;
use siko::order::Order;
use siko::state::State;
use siko_profibus::gateway::ProfibusDoor;
use siko_profibus::words::order;
use siko_profibus::{AG02, PPO, ProfibusDrive, bus};

struct Rig {
    bus: Bus<VirtualBus<ProfibusDrive>>,
    drives: [SlaveId; 2],
    stations: [Station<VirtualBus<ProfibusDrive>>; 2],
    door: ProfibusDoor,
}

impl Rig {
    fn new() -> Self {
        let mut line = VirtualBus::new();
        let drives = [7, 8].map(|address| bus::attach_unknown(&mut line, &AG02, address));
        let bus = Bus::new(line);
        let stations = [7, 8].map(|address| bus.station(address, bus::options(&AG02), PPO.lengths()).unwrap());
        Rig { bus, drives, stations, door: ProfibusDoor::new(&AG02) }
    }

    /// Carries until data has been exchanged once more.
    fn carry(&mut self) {
        let [station, _] = &mut self.stations;
        let before = station.exchanges();
        while station.exchanges() == before {
            let until = station.now() + Duration::from_millis(1);
            station.carry(&mut self.door, until).unwrap();
        }
    }

    /// Lets the other station wait for its next exchange.
    fn wait_for_the_other(&mut self) {
        let until = self.stations[1].now() + Duration::from_secs(1);
        assert!(self.stations[1].wait(until).unwrap().is_some());
    }

    /// The number of exchanges until everything is known about the drive.
    fn exchanges_until_it_is_known(&mut self, with_the_other: bool) -> u64 {
        while self.door.master_mut().facts().is_none() {
            if with_the_other {
                self.wait_for_the_other();
            }
            self.carry();
        }
        self.stations[0].exchanges()
    }
}

#[test]
fn each_exchange_carries_what_the_last_one_and_orders_have_led_to() {
    let mut rig = Rig::new();
    let exchanges = rig.exchanges_until_it_is_known(false);
    // Beside another drive, the first round takes two exchanges.
    assert!(Rig::new().exchanges_until_it_is_known(true) <= exchanges + 1);
    let now = rig.stations[0].now();
    rig.door.master_mut().order(now, Order::Enable, 0);
    rig.carry();
    let state = rig.bus.with(|line| line.slave(rig.drives[0]).application().drive().state());
    assert_eq!(state, State::OperationEnabled);
}

#[test]
fn a_bus_is_looked_at_every_millisecond_or_at_once_if_something_waits() {
    let mut rig = Rig::new();
    rig.carry();
    let now = rig.stations[0].now();
    assert_eq!(rig.stations[0].next_event(), Some(now + Duration::from_millis(1)));
    while !rig.stations[0].has_notice() {
        rig.wait_for_the_other();
    }
    assert_eq!(rig.stations[0].next_event(), Some(rig.stations[0].now()));
}

#[test]
fn a_test_sets_control_word_and_target_and_gets_status_and_position() {
    let (mut bus, drive) = bus::with(&AG02, 7);
    assert!(bus.exchange(drive));
    bus::set(&mut bus, drive, order::ENABLE, 5000);
    assert!(bus.exchange(drive));
    let (status, position) = bus::get(&mut bus, drive).unwrap();
    assert_eq!((status & 0x0007, position), (0x0007, 0));
    assert_eq!(bus.slave(drive).application().drive().parameters().target_position, 5000);
}
