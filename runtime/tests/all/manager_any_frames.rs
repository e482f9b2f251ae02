//! No frames on the bus make a manager panic or hang, and its next transfer works.

use lexican_runtime::manager::{Assignment, Event, Manager, Network, OnLoss, Remote};
use lexican_runtime::object::Address;
use lexican_runtime::procedure::{BootPlan, Runner, Step};
use lexican_runtime::service::sdo_client::{self, Scalar, SdoClient};
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use proptest::prelude::*;

const NODE: NodeId = NodeId::literal(5);

fn any_frame() -> impl Strategy<Value = Frame> {
    let known = prop::sample::select(vec![0x000_u16, 0x080, 0x085, 0x100, 0x185, 0x385, 0x585, 0x585, 0x705, 0x706]);
    let id = prop_oneof![
        8 => known.prop_filter_map("11 bits", CobId::standard),
        1 => (0..0x800_u16).prop_filter_map("11 bits", CobId::standard),
        1 => (0..0x2000_0000_u32).prop_filter_map("29 bits", CobId::extended),
    ];
    prop_oneof![
        9 => (id.clone(), prop::collection::vec(any::<u8>(), 0..=8))
            .prop_filter_map("8 bytes", |(id, data)| Frame::new(id, &data)),
        1 => (id, 0..=8_u8).prop_filter_map("8 bytes", |(id, len)| Frame::remote(id, len)),
    ]
}

fn advance(manager: &mut Manager<2>, now: &mut Instant, span: Duration, value: &mut Scalar) -> usize {
    let end = *now + span;
    let mut sent = 0;
    loop {
        while manager.poll_transmit(*now, value).is_some() {
            sent += 1;
        }
        let Some(due) = manager.poll_timeout().filter(|&due| due <= end) else { break };
        *now = due.max(*now);
        manager.handle_timeout(*now);
    }
    *now = end;
    sent
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    #[test]
    fn any_frames_at_any_time_leave_a_manager_that_reads(
        script in prop::collection::vec((any_frame(), any::<bool>(), 0..500_u64), 0..60)
    ) {
        let mut manager = Manager::<2>::new();
        let mut now = Instant::ZERO;
        let guarded = Remote::new(NodeId::literal(6)).with_guarding(Duration::from_millis(100), 2);
        manager.add(now, Remote::new(NODE).with_heartbeat(Duration::from_millis(100))).unwrap();
        manager.add(now, guarded).unwrap();
        manager.produce_sync(now, CobId::SYNC, Duration::from_millis(50), 10);
        let mut value = Scalar::room_for::<u64>();
        for (frame, read, pause_ms) in script {
            if read {
                // The transfer is refused if the manager is busy.
                let _ = manager.read(now, NODE, Address::new(0x1000, 0));
            }
            manager.handle_frame(now, &frame, &mut value);
            let sent = advance(&mut manager, &mut now, Duration::from_millis(pause_ms), &mut value);
            prop_assert!(sent < 10 + pause_ms as usize, "a burst without end");
        }
        advance(&mut manager, &mut now, Duration::from_secs(10), &mut value);

        manager.read(now, NODE, Address::new(0x1000, 0)).unwrap();
        advance(&mut manager, &mut now, Duration::ZERO, &mut value);
        let answer = Frame::from_array(CobId::standard(0x585).unwrap(), [0x43, 0x00, 0x10, 0, 0x92, 1, 0, 0]);
        let event = manager.handle_frame(now, &answer, &mut value);
        let done = sdo_client::Event::Done { address: Address::new(0x1000, 0), len: 4 };
        prop_assert_eq!(event, Some(Event::Sdo { node: NODE, event: done }));
        prop_assert_eq!(value.bytes(), &[0x92, 1, 0, 0]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

    #[test]
    fn any_frames_at_any_time_leave_a_network_and_a_procedure_that_end(
        script in prop::collection::vec((any_frame(), 0..500_u64), 0..60)
    ) {
        let mut now = Instant::ZERO;
        let dcf = [1, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0, 0, 100, 0];
        let plan = BootPlan { configuration: &dcf[..], configured: Some((1, 1)), start: true, ..BootPlan::default() };
        let heartbeat = Duration::from_millis(250);
        let mut network = Network::<_, 2>::new(OnLoss::ResetAll);
        let client = SdoClient::of_node(NODE);
        network.assign(NODE, Assignment { client, mandatory: true, boots_again: true, heartbeat, guarding: None, plan }).unwrap();
        network.start(now, Duration::from_secs(1));
        let address = Address::new(0x6041, 0);
        let (poll, timeout) = (Duration::from_millis(10), Duration::from_millis(500));
        let steps = [
            Step::Await { address, mask: 1, value: 1, poll, timeout },
            Step::AwaitBootUp { timeout },
            Step::value(address, 1_u16),
        ];
        let mut runner = Runner::new(NODE, SdoClient::of_node(NODE), steps.into_iter());
        for (frame, pause_ms) in script {
            network.handle_frame(now, &frame);
            runner.handle_frame(now, &frame);
            let end = now + Duration::from_millis(pause_ms);
            let mut sent = 0;
            loop {
                while network.poll_transmit(now).or_else(|| runner.poll_transmit(now)).is_some() {
                    sent += 1;
                }
                let due = [network.poll_timeout(), runner.poll_timeout()].into_iter().flatten().min();
                let Some(due) = due.filter(|&due| due <= end) else { break };
                now = due.max(now);
                network.handle_timeout(now);
                runner.handle_timeout(now);
            }
            prop_assert!(sent < 20 + pause_ms as usize, "a burst without end");
            now = end;
        }
        // No node answers any more, and the procedure ends within some seconds.
        for _ in 0..1000 {
            while runner.poll_transmit(now).is_some() {}
            let Some(due) = runner.poll_timeout() else { break };
            now = due.max(now);
            runner.handle_timeout(now);
        }
        prop_assert!(runner.is_over(), "{:?}", runner.step());
    }
}
