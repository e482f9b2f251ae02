//! Why a slave exchanges no data, as its station sees it.

use super::support::{self, Echo, IDENTITY};
use lexican_profibus::bus::{Bus, Station};
use lexican_profibus::dp::{Lengths, Parameters, sap};
use lexican_profibus::virtual_bus::{SlaveId, VirtualBus};
use lexican_profibus::{Identity, Slave, Trouble};
use lexican_runtime::Duration;
use profirust::dp::PeripheralOptions;

const LENGTHS: Lengths = Lengths { inputs: 4, outputs: 4 };

struct Rig {
    bus: Bus<VirtualBus<Echo>>,
    id: SlaveId,
    station: Station<VirtualBus<Echo>>,
}

impl Rig {
    fn of(identity: Identity, address: u8, lengths: Lengths) -> Self {
        let mut line = VirtualBus::new();
        let slave = Slave::new(address, identity, line.bit_rate(), Echo::default());
        let id = line.attach_unknown(slave);
        let bus = Bus::new(line);
        let options = PeripheralOptions {
            ident_number: IDENTITY.ident,
            max_tsdr: 100,
            user_parameters: Some(&[]),
            config: Some(IDENTITY.configuration),
            // The slave may refuse it.
            sync_mode: true,
            ..PeripheralOptions::default()
        };
        let station = bus.station(7, options, lengths).unwrap();
        Rig { bus, id, station }
    }

    /// What it shows after a second, the same at any time from then on.
    #[track_caller]
    fn shows(&mut self) -> Option<Trouble> {
        let mut pass = |ms| {
            let until = self.station.now() + Duration::from_millis(ms);
            while self.station.now() < until {
                self.station.wait(until).unwrap();
            }
            self.station.trouble()
        };
        let shown = pass(1500);
        for _ in 0..50 {
            assert_eq!(pass(7), shown);
        }
        shown
    }
}

#[test]
fn a_slave_that_exchanges_data_is_in_no_trouble_until_it_is_gone_and_again_when_it_is_back() {
    let mut rig = Rig::of(IDENTITY, 7, LENGTHS);
    assert_eq!(rig.station.trouble(), Some(Trouble::Silent { address: 7 }), "nothing has been heard of it");
    for _ in 0..2 {
        assert_eq!(rig.shows(), None);
        rig.bus.with(|line| line.set_connected(rig.id, false));
        assert_eq!(rig.shows(), Some(Trouble::Silent { address: 7 }));
        rig.bus.with(|line| line.set_connected(rig.id, true));
    }
}

#[test]
fn each_refusal_has_its_words_and_a_remedy() {
    let with = |identity| Rig::of(identity, 7, LENGTHS);
    let foreign = with(IDENTITY);
    foreign.bus.with(|line| {
        let now = line.now();
        // Another master has taken it, without a watchdog.
        let parameters = Parameters {
            lock: true,
            unlock: false,
            sync: false,
            freeze: false,
            watchdog: None,
            min_tsdr_bits: 11,
            ident: IDENTITY.ident,
            groups: 0,
            user: &[],
        };
        let telegram = support::Rig::new().request(Some(sap::SET_PARAMETERS), &parameters.head());
        line.slave_mut(foreign.id).handle_bytes(now, &telegram);
    });
    let other = Identity { configuration: &[0x70, 0x70, 0x70, 0x70], ..IDENTITY };
    for (mut rig, trouble, words, remedy) in [
        (
            with(Identity { ident: 0x4321, ..IDENTITY }),
            Trouble::Ident { address: 7, expected: IDENTITY.ident, found: 0x4321 },
            "the slave at address 7 has the ident number 4321, and ",
            "gsd=FILE with the ident number 4321",
        ),
        (
            with(Identity { sync: false, ..IDENTITY }),
            Trouble::Parameters { address: 7 },
            "refuses its parameters",
            "GSD file of its maker: gsd=FILE",
        ),
        (with(other), Trouble::Configuration { address: 7 }, "refuses the configuration", "gsd=FILE, and module=NAME"),
        (
            Rig::of(IDENTITY, 9, LENGTHS),
            Trouble::Silent { address: 7 },
            "no slave answers at address 7 of the PROFIBUS",
            "do its switches say 7",
        ),
        (
            Rig::of(IDENTITY, 7, Lengths { inputs: 6, outputs: 4 }),
            Trouble::Data { address: 7 },
            "answers, but exchanges no data of the expected length",
            "gsd=FILE&module=NAME",
        ),
        (foreign, Trouble::OtherMaster { address: 7, master: 2 }, "belongs to another master, 2", "stop master 2"),
    ] {
        assert_eq!(rig.shows(), Some(trouble));
        let (said, advice) = (trouble.to_string(), trouble.remedy());
        assert!(said.contains(words) && advice.contains(remedy), "{said}: {advice}");
    }
}
