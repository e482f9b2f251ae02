//! The values that are written into nodes.

use lexican_runtime::manager::Manager;
use lexican_runtime::procedure::ConciseDcf;
use lexican_runtime::service::sdo_client::Scalar;
use lexican_runtime::{Duration, Instant};

use crate::{sound, writes};

#[test]
fn a_manager_sends_what_the_machine_says_of_it() {
    let machine = sound("[bus]\nmanager = 127\nheartbeat = \"200 ms\"\nsync = \"100 ms\"\n[node.io]\nid = 7");
    let mut manager = Manager::<127>::new();
    machine.produce(&mut manager, Instant::ZERO);
    let mut sent = Vec::new();
    for ms in 0..=200 {
        let now = Instant::ZERO + Duration::from_millis(ms);
        manager.handle_timeout(now);
        sent.extend(std::iter::from_fn(|| manager.poll_transmit(now, &mut Scalar::default())).map(|it| it.to_string()));
    }
    sent.retain(|frame| frame.starts_with("77F"));
    assert_eq!(sent, ["77F#05"; 2]);
}

#[test]
fn settings_heartbeats_and_pdos_are_written_in_order() {
    let machine = sound(
        "[bus]\nmanager = 127\nheartbeat = \"200 ms\"\n[node.cutter]\nid = 6\nsheet = \"kollmorgen/akd\"\nheartbeat = \"100 ms\"\n\
         [node.cutter.settings]\n6060 = 1\n[node.cutter.tpdo]\n2 = [\"statusword\", \"6064\"]\n3 = \"off\"",
    );
    assert_eq!(
        writes(&machine, "cutter"),
        [
            "1016:01 58027F00 error control",
            "1017:00 6400 error control",
            "1801:01 86020080 PDO",
            "1801:02 FF PDO (default)",
            "1801:03 0000 PDO (default)",
            "1801:05 0000 PDO (default)",
            "1A01:00 00 PDO",
            "1A01:01 10004160 PDO",
            "1A01:02 20006460 PDO",
            "1A01:00 02 PDO",
            "1801:01 86020000 PDO",
            "1802:01 86030080 PDO",
            "6060:00 01 setting",
        ]
    );
    let node = machine.node("cutter").unwrap();
    assert_eq!(ConciseDcf::new(&machine.concise_dcf(node)).count(), 10);
}

#[test]
fn a_wire_is_a_pdo_of_one_node_that_others_receive() {
    let machine = sound(
        "[kind.drive]\nsheet = \"kollmorgen/akd\"\nguarding = \"100 ms\"\n[node.a]\nid = 5\nkind = \"drive\"\n[node.b]\nid = 6\nkind = \"drive\"\n\
         [wire]\n\"a.6064\" = { to = [\"b.607A\", \"manager\"], every = \"10 ms\" }\n\"manager\" = [\"b.6040\"]",
    );
    let sent = &machine.node("a").unwrap().pdos[0];
    assert_eq!((sent.after.event_timer_ms, sent.after.mapping.len()), (Some(10), 1));
    let taken = &machine.node("b").unwrap().pdos;
    let take = taken.iter().find(|pdo| pdo.after.cob_id == sent.after.cob_id).unwrap();
    assert_eq!(take.after.mapping[0].to_parameter(), 0x607A_0020);
    let ordered = taken.iter().find(|pdo| pdo.after.cob_id != sent.after.cob_id).unwrap();
    assert!(ordered.after.mapping.iter().any(|mapped| mapped.to_parameter() == 0x6040_0010));
}
