//! The sequences in the test's own shell: two drives at once, in one thread.

use std::future::Future;
use std::pin::{Pin, pin};
use std::task::Poll;

use lexican_runtime::host::{Link, VirtualBus};
use lexican_runtime::{Duration, NodeId};
use siko_ag03_1::driver::{AG03_1, DriveContext, Error, Outcome, Session, sequence};
use siko_ag03_1::sim::MODEL;
use siko_ag03_1::sim::SimulatedDrive;

async fn visit(context: DriveContext, target: i32) -> Result<Outcome, Error> {
    sequence::enable(&context).await?;
    sequence::start_travel(&context, target).await?;
    sequence::finish(&context, Duration::from_secs(60), &mut |_| {}).await
}

/// Runs all sequences on one link until each has ended.
fn join<F: Future>(link: &mut impl Link, mut pairs: Vec<(Session, Pin<&mut F>)>) -> Vec<F::Output> {
    let mut outcomes: Vec<Option<F::Output>> = pairs.iter().map(|_| None).collect();
    loop {
        for ((session, sequence), outcome) in pairs.iter_mut().zip(&mut outcomes) {
            if outcome.is_none()
                && let Poll::Ready(ended) = session.poll(link.now(), sequence.as_mut())
            {
                *outcome = Some(ended);
            }
            while let Some(frame) = session.poll_transmit(link.now()) {
                link.send(&frame).unwrap();
            }
        }
        if outcomes.iter().all(Option::is_some) {
            return outcomes.into_iter().flatten().collect();
        }
        let until = pairs.iter().filter_map(|(session, _)| session.poll_timeout()).min().unwrap_or(link.now());
        match link.receive_frame(until).unwrap() {
            Some(frame) => pairs.iter_mut().for_each(|(session, _)| session.handle_frame(link.now(), &frame)),
            None => pairs.iter_mut().for_each(|(session, _)| session.handle_timeout(link.now())),
        }
    }
}

#[test]
fn two_drives_travel_at_once_from_one_thread() {
    let bus = VirtualBus::with_bit_rate(125);
    let nodes = [NodeId::literal(5), NodeId::literal(6)];
    let sessions = nodes.map(|node| {
        bus.attach(SimulatedDrive::new(&MODEL, node));
        Session::new(node, &AG03_1)
    });
    let mut link = bus.link();
    // Lets both boot.
    while link.receive_frame(bus.now() + Duration::from_millis(10)).unwrap().is_some() {}
    let [first, second] = sessions;
    let (mut one, mut other) = (pin!(visit(first.context(), 5000)), pin!(visit(second.context(), -5000)));
    let before = bus.now();
    let outcomes = join(&mut link, vec![(first, one.as_mut()), (second, other.as_mut())]);
    let reached: Vec<Outcome> = outcomes.into_iter().map(Result::unwrap).collect();
    assert_eq!(reached, [Outcome::Reached { position: 5000 }, Outcome::Reached { position: -5000 }]);
    // One travel takes 6.5 s.
    assert!(bus.now().since(before) < Duration::from_secs(7));
}

/// An executor with several threads requires this of a future.
#[test]
fn sequences_can_move_between_threads() {
    fn check(_: impl Send) {}
    let context = Session::new(NodeId::literal(5), &AG03_1).context();
    check(visit(context.clone(), 0));
    check(async move {
        sequence::interrupt(&context).await?;
        sequence::resume(&context).await?;
        sequence::step(&context, Duration::ZERO).await?;
        sequence::run_at(&context, 0, Duration::ZERO).await?;
        sequence::disable(&context).await
    });
}
