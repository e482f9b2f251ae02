//! Paths over a network of tokio.

use std::sync::Arc;

use lexican_driver::cyclic::tokio::follow;
use lexican_driver::cyclic::{Reason, Settings, Supply, SyncSource};
use lexican_runtime::host::tokio::Network;
use lexican_runtime::manager::{Manager, Remote};
use lexican_runtime::profile::cia402::State;
use lexican_runtime::wire::nmt::NmtState;
use lexican_runtime::{CobId, NodeId};
use tokio::sync::Notify;

use crate::outcomes::Producer;
use crate::rig::{Rig, figure};

#[tokio::test]
async fn a_path_is_followed_and_stops_all_axes_when_it_is_dropped() {
    let rig = Rig::new(3);
    let network = Network::spawn(rig.bus.link()).unwrap();
    let mut follower = rig.follower(figure(1000), Settings::default());
    let report = follow(&network, &mut follower).await.unwrap();
    assert_eq!((report.reason, report.cycles), (None, 1000), "{report}");

    let ends = Arc::new(Notify::new());
    let ended = Arc::clone(&ends);
    let path = move |cycle: u64, _: &mut [i32]| {
        if cycle == 100 {
            ended.notify_one();
        }
        Supply::Ready
    };
    let mut follower = rig.follower(path, Settings::default());
    tokio::select! {
        _ = follow(&network, &mut follower) => panic!("the path has no end"),
        () = ends.notified() => {}
    }
    while rig.axis(0).state == State::OperationEnabled {
        tokio::task::yield_now().await;
    }
    assert!((0..3).all(|number| rig.axis(number).state == State::QuickStopActive));
}

/// The network reports these by events, not by frames.
#[tokio::test]
async fn emergencies_and_states_of_nmt_stop_a_path() {
    let node = NodeId::literal(2);
    let left = |state| Some(Reason::NotOperational { node, state });
    for (watched, happen, expected) in [
        (false, "fault", None),
        (false, "boot-up", Some(Reason::Restarted { node })),
        (false, "heartbeat", left(NmtState::PreOperational)),
        (true, "heartbeat", left(NmtState::PreOperational)),
        (true, "stopped", left(NmtState::Stopped)),
    ] {
        let rig = Rig::new(3);
        let network = Network::spawn(rig.bus.link()).unwrap();
        if watched {
            let watch = move |manager: &mut Manager<127>, now| manager.add(now, Remote::new(node)).unwrap();
            network.with_manager(watch).await.unwrap();
        }
        let failing = rig.axes[1].clone();
        let path = move |cycle: u64, _: &mut [i32]| {
            let mut axis = failing.lock().unwrap();
            match happen {
                _ if cycle != 100 => {}
                "fault" => axis.fail(0x8700),
                "boot-up" => axis.restart(),
                "heartbeat" => axis.leave_operational(0x7F),
                _ => axis.leave_operational(0x04),
            }
            Supply::Ready
        };
        let report = follow(&network, &mut rig.follower(path, Settings::default())).await.unwrap();
        match expected {
            Some(reason) => assert_eq!(report.reason, Some(reason), "{watched}, {happen}: {report}"),
            None => assert_eq!(report.reason.map(|it| it.to_string()).as_deref(), Some("node 2: in fault: 8700: SYNC")),
        }
        rig.check_at_rest(&report.to_string());
    }
}

#[tokio::test]
async fn the_sync_of_another_node_is_followed_and_replaced_for_the_stop() {
    let settings = Settings { sync: SyncSource::Followed { id: CobId::SYNC }, ..Settings::default() };
    for (left, expected) in [(5000, None), (500, Some("no SYNC has come for 3 ms"))] {
        let rig = Rig::new(2);
        let network = Network::spawn(rig.bus.link()).unwrap();
        Producer::attach(&rig.bus, left);
        let report = follow(&network, &mut rig.follower(figure(1000), settings)).await.unwrap();
        assert_eq!(report.reason.map(|reason| reason.to_string()).as_deref(), expected, "{report}");
        assert!(report.axes.iter().all(|axis| axis.end.to_string() == "at rest, SWITCH ON DISABLED"), "{report}");
    }
}
