//! Random frames from the bus never make a sequence panic, and every sequence ends.

use std::future::Future;
use std::pin::{Pin, pin};
use std::task::Poll;

use lexican_driver::cyclic::AxisSettings;
use lexican_driver::description::{Calibration, Inching, Number, Outputs, Test, Trigger};
use lexican_driver::sequence::Recovery;
use lexican_driver::{Description, Direction, DriveContext, Error, Mode, Session, SetPoint, Supervision, sequence};
use lexican_runtime::object::DataType;
use lexican_runtime::{CobId, Duration, Frame, Instant, NodeId};
use proptest::prelude::*;

const NODE: NodeId = NodeId::literal(5);

static BY_PDO: Description = Description::CIA_402;
static BY_SDO: Description = Description { outputs: Outputs::BY_SDO, inputs: &[], ..Description::CIA_402 };

static INCHING: Description = Description {
    inching: Some(Inching {
        step: 1 << 13,
        positive: 1 << 14,
        negative: 1 << 15,
        width: Number::new(0x2415, 0x00, DataType::Integer32),
        busy: Some(Test::of_status(1 << 8).clear()),
        begins: Duration::from_millis(50),
    }),
    calibration: Some(Calibration::Write(Number::new(0x607C, 0x00, DataType::Integer32))),
    ..Description::CIA_402
};

/// Every operation of a CiA 402 drive, each by itself: an error ends only its own operation.
async fn everything(context: &DriveContext) {
    let within = Duration::from_secs(5);
    let _ = sequence::identify(context).await;
    let _ = sequence::protect(context, Supervision::within(within)).await;
    let _ = sequence::enable(context).await;
    let _ = sequence::travel(context, 1000, within, &mut |_| {}).await;
    let _ = sequence::start_travel(context, -1000).await;
    let _ = sequence::pass(context, within).await;
    let _ = sequence::interrupt(context).await;
    let _ = sequence::resume(context).await;
    let _ = sequence::finish(context, within, &mut |_| {}).await;
    let _ = sequence::inch(context, Direction::Positive).await;
    let _ = sequence::stop_inching(context).await;
    let _ = sequence::step(context, within).await;
    let _ = sequence::add_set_point(context, SetPoint::to(1000), within).await;
    let _ = sequence::arm_latch(context, Trigger::Rising(1)).await;
    let _ = sequence::warning(context).await;
    let _ = sequence::calibrate(context, 0).await;
    let _ = sequence::home(context, 35, within).await;
    let _ = sequence::set_mode(context, Mode::Velocity).await;
    let _ = sequence::run_at(context, 100, within).await;
    let _ = sequence::set_mode(context, Mode::Torque).await;
    let _ = sequence::apply_torque(context, 100).await;
    let _ = sequence::pass(context, within).await;
    let _ = sequence::stop(context).await;
    let _ = sequence::quick_stop(context).await;
    let _ = sequence::reset_fault(context).await;
    let _ = sequence::disable(context).await;
    let settings = AxisSettings::new(Mode::CyclicPosition, Duration::from_millis(1), 100);
    let _ = sequence::prepare_cyclic(context, settings).await;
    let _ = sequence::recover(context, &Recovery::within(within), context.seen()).await;
}

/// Runs a sequence on these frames, as fast as they come, and then in silence. Returns whether it ends.
fn ends(description: &'static Description, frames: &[(Frame, u64)]) -> bool {
    let mut session = Session::new(NODE, description);
    let context = session.context();
    let mut now = Instant::ZERO;
    let mut sequence = pin!(everything(&context));
    let mut frames = frames.iter();
    for _ in 0..20_000 {
        if step(&mut session, now, sequence.as_mut()).is_ready() {
            return true;
        }
        match frames.next() {
            Some((frame, gap_us)) => {
                now += Duration::from_micros(*gap_us);
                session.handle_frame(now, frame);
            }
            None => {
                now = session.poll_timeout().unwrap_or(now).max(now);
                session.handle_timeout(now);
            }
        }
    }
    false
}

fn step<F: Future>(session: &mut Session, now: Instant, sequence: Pin<&mut F>) -> Poll<F::Output> {
    let polled = session.poll(now, sequence);
    while session.poll_transmit(now).is_some() {}
    polled
}

/// Frames that mostly have a meaning for the session, including status words of every state and answers to its
/// requests.
fn frame() -> impl Strategy<Value = (Frame, u64)> {
    let id = prop_oneof![Just(0x085_u16), Just(0x185), Just(0x385), Just(0x585), Just(0x705), 0_u16..0x800];
    let any_frame = (id, proptest::collection::vec(any::<u8>(), 0..=8));
    let status = (Just(0x185_u16), any::<u16>().prop_map(|word| word.to_le_bytes().to_vec()));
    let objects = prop_oneof![
        Just((0x43_u8, 0x1000_u16)),
        Just((0x43, 0x1018)),
        Just((0x4B, 0x6041)),
        Just((0x42, 0x6041)),
        Just((0x43, 0x6064)),
        Just((0x43, 0x606C)),
        Just((0x4F, 0x6061)),
        Just((0x60, 0x6040)),
        Just((0x60, 0x6060)),
    ];
    let answer = (objects, 0_u8..2, any::<u32>()).prop_map(|((command, index), sub, value)| {
        let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
        (0x585_u16, vec![command, low, high, sub, a, b, c, d])
    });
    let framed = prop_oneof![1 => any_frame, 2 => status, 4 => answer].prop_map(|(id, data): (u16, Vec<u8>)| {
        let id = CobId::standard(id).expect("eleven bits");
        Frame::new(id, &data).expect("eight bytes at most")
    });
    (framed, 0_u64..200_000)
}

proptest! {
    #[test]
    fn no_frames_make_a_sequence_panic_or_wait_without_end(
        frames in proptest::collection::vec(frame(), 0..300),
    ) {
        prop_assert!(ends(&BY_PDO, &frames));
        prop_assert!(ends(&BY_SDO, &frames));
    }
}

/// Runs a sequence on a node that answers everything with these values in turn: reads with them, and every seventh
/// write with an abort. Returns whether it ends.
fn ends_on_answers(description: &'static Description, values: &[u32]) -> bool {
    let mut session = Session::new(NODE, description);
    let context = session.context();
    let mut now = Instant::ZERO;
    let mut sequence = pin!(everything(&context));
    let mut values = values.iter().cycle();
    for _ in 0..500_000 {
        if session.poll(now, sequence.as_mut()).is_ready() {
            return true;
        }
        let mut answered = false;
        while let Some(request) = session.poll_transmit(now) {
            let (0x605, &[command, low, high, sub, ..]) = (request.id().raw(), request.data()) else { continue };
            let value = values.next().copied().unwrap_or(0);
            let (command, value) = match command {
                0x40 => (0x42, value),
                0x80 => continue,
                _ if value % 7 == 0 => (0x80, 0x0800_0022),
                _ => (0x60, 0),
            };
            let [a, b, c, d] = value.to_le_bytes();
            now += Duration::from_micros(500);
            let answer = Frame::from_array(CobId::of_node(0x580, NODE), [command, low, high, sub, a, b, c, d]);
            session.handle_frame(now, &answer);
            answered = true;
        }
        if !answered {
            now = session.poll_timeout().unwrap_or(now).max(now);
            session.handle_timeout(now);
        }
    }
    false
}

/// Small numbers, extreme ones, and status words, mostly of an enabled drive.
fn value() -> impl Strategy<Value = u32> {
    let status = any::<u32>().prop_map(|word| word & !0x6F | 0x27);
    prop_oneof![4 => status, 2 => 0_u32..4, 1 => Just(i32::MIN as u32), 1 => Just(i32::MAX as u32), 1 => any::<u32>()]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn no_answers_make_a_sequence_panic_or_wait_without_end(values in proptest::collection::vec(value(), 1..40)) {
        prop_assert!(ends_on_answers(&BY_PDO, &values));
        prop_assert!(ends_on_answers(&BY_SDO, &values));
        prop_assert!(ends_on_answers(&INCHING, &values));
    }
}

#[test]
fn a_silent_node_is_given_up() {
    assert!(ends(&BY_PDO, &[]));
    let mut session = Session::new(NODE, &BY_PDO);
    let context = session.context();
    let mut identify = pin!(sequence::identify(&context));
    let mut now = Instant::ZERO;
    let answer = loop {
        match step(&mut session, now, identify.as_mut()) {
            Poll::Ready(answer) => break answer,
            Poll::Pending => now = session.poll_timeout().expect("it does not wait without end"),
        }
        session.handle_timeout(now);
    };
    assert!(matches!(answer, Err(Error::Sdo(_))), "{answer:?}");
}
