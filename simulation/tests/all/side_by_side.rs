//! Plants that share nothing have the same log on any number of threads.

use std::num::NonZero;

use lexican_eds::Source;
use lexican_runtime::host::{Fate, Link, VirtualBus};
use lexican_runtime::wire::nmt::{NmtCommand, NmtMessage};
use lexican_runtime::wire::sync::Sync;
use lexican_runtime::{CobId, Duration};
use lexican_simulation::{Files, Plant, SideBySide, side_by_side};
use lexican_toolbox::log::{Format, Record, Writer};

/// Three plants, of which the second has the most to do.
fn plants() -> [Plant; 3] {
    let sensor = include_str!("../../../cli/tests/sensor.eds");
    [["siko/ag03-1", "kollmorgen/akd"], ["siko/ag03-1"; 2], ["sensor.eds"; 2]].map(|sheets| {
        let nodes = sheets.iter().zip(1..).map(|(sheet, id)| format!("[node.n{id}]\nid = {id}\nsheet = '{sheet}'\n"));
        let text = nodes.collect::<String>();
        Plant::parse(&text, "machine.toml", Files::Embedded(&[("sensor.eds", sensor)])).unwrap()
    })
}

/// Plants with a SYNC every millisecond, in which frames are lost by a seed; and the log as bytes.
fn run(seed: u64, threads: usize) -> (SideBySide<usize>, Vec<u8>) {
    let program = |place: usize, bus: &VirtualBus| {
        let seed = seed + place as u64;
        bus.set_fate(move |number, _| match (number + 1).wrapping_mul(2 * seed + 3) % 16 {
            0 => Fate::Lose,
            1 => Fate::Delay(Duration::from_micros(700)),
            _ => Fate::Deliver,
        });
        let mut manager = bus.link();
        bus.advance(Duration::from_secs(1));
        manager.send(&NmtMessage { command: NmtCommand::Start, node: None }.frame()).unwrap();
        for _ in 0..200 * (1 + place % 2) {
            manager.send(&Sync { counter: None }.frame(CobId::SYNC)).unwrap();
            bus.advance(Duration::from_millis(1));
        }
        place
    };
    let run = side_by_side(&plants(), NonZero::new(threads).unwrap(), program).unwrap();
    let mut writer = Writer::in_memory(Format::Candump);
    run.log.iter().for_each(|record| writer.write(record).unwrap());
    (run, writer.into_bytes())
}

#[test]
fn the_log_is_the_same_on_any_number_of_threads() {
    let (one, bytes) = run(7, 1);
    assert_eq!(one.results, [0, 1, 2]);
    for threads in [2, 3, 8] {
        let (several, again) = run(7, threads);
        assert_eq!(several.results, one.results);
        assert!(again == bytes, "{threads} threads");
    }
    assert!(run(8, 3).1 != bytes, "another seed loses other frames");
    let order = |record: &Record| (record.at, record.interface.clone());
    assert!(one.log.is_sorted_by_key(order));
    for interface in ["can0", "can1", "can2"] {
        let frames = one.log.iter().filter(|record| &*record.interface == interface).count();
        assert!(frames > 100, "{interface}: {frames}");
    }
}

#[test]
fn of_several_plants_that_cannot_be_simulated_the_first_is_reported() {
    let [sound, mut first, mut second] = plants();
    first.devices[0].script = Some(Source::new("first.toml", "[[step]]\nnonsense = 1\n"));
    second.devices[0].script = Some(Source::new("second.toml", "[[step]]\nnonsense = 1\n"));
    let threads = NonZero::new(3).unwrap();
    let error = side_by_side([&sound, &first, &second], threads, |_, _| ()).unwrap_err();
    assert!(error.to_string().starts_with("first.toml cannot be simulated"), "{error}");
}
