//! What a drive on the bench is seen to do.

use crate::bench::Bench;

pub(super) fn position(bench: &Bench) -> i32 {
    bench.see(|drive, now| drive.position(now))
}

pub(super) fn velocity(bench: &Bench) -> i32 {
    bench.see(|drive, now| drive.velocity(now))
}

/// In increments/s, without rounding.
pub(super) fn speed(bench: &Bench) -> f64 {
    bench.see(|drive, now| drive.shaft(now).velocity)
}

pub(super) fn is_fault(bench: &Bench) -> bool {
    bench.status() & 0x4F == 0x08
}

/// 1002h, bit 7.
pub(super) fn is_released(bench: &Bench) -> bool {
    bench.system() >> 7 & 1 == 1
}

/// Enabled, with what `set` has written before.
pub(super) fn enabled_with(set: &[(u16, u8, i64, u8)]) -> Bench {
    let mut bench = Bench::new();
    bench.set(set);
    bench.nmt(0x01);
    bench.enable();
    bench.control(0x000F);
    bench
}

/// Velocities after each of these times, in milliseconds from the start.
pub(super) fn velocities(bench: &mut Bench, times: &[u64]) -> Vec<i32> {
    let mut passed = 0;
    let mut at = |time: &u64| {
        bench.hear(time - passed);
        passed = *time;
        velocity(bench)
    };
    times.iter().map(&mut at).collect()
}

/// How far the shaft turns until it stands, in increments.
pub(super) fn way_to_rest(bench: &mut Bench) -> i32 {
    let before = position(bench);
    bench.hear(30_000);
    if speed(bench) == 0.0 { position(bench) - before } else { i32::MAX }
}

/// The positions that the drive passes, every 20 ms.
pub(super) fn way(bench: &mut Bench, ms: u64) -> Vec<i32> {
    let mut look = || {
        bench.hear(20);
        position(bench)
    };
    (0..ms / 20).map(|_| look()).collect()
}
