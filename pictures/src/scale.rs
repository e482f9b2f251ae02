//! Axes, and the choice of points of a curve.

use std::ops::Range;

/// The range of the numbers with a margin, extended to zero if that is near.
pub fn range(numbers: impl Iterator<Item = f64> + Clone) -> Range<f64> {
    let first = numbers.clone().next().unwrap_or_default();
    let (low, high) = (numbers.clone().fold(first, f64::min), numbers.fold(first, f64::max));
    let extent = high - low;
    let low = if low > 0.0 && low <= extent { 0.0 } else { low };
    let high = if high < 0.0 && -high <= extent { 0.0 } else { high };
    let air = if high > low { (high - low) * 0.08 } else { (high.abs() * 0.01).max(0.5) };
    (if low == 0.0 { low - air / 2.0 } else { low - air })..high + air
}

/// About `count` round numbers within a range, and their texts; with signs if some are negative.
pub(crate) fn ticks(range: &Range<f64>, count: usize, is_signed: bool) -> Vec<(f64, String)> {
    let least = (range.end - range.start) / count as f64;
    let power = 10_f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0].map(|factor| factor * power).into_iter().find(|step| *step >= least);
    let step = step.unwrap_or(10.0 * power);
    let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    let (first, last) = ((range.start / step).ceil() as i64, (range.end / step).floor() as i64);
    let text = |value: f64| match value {
        0.0 => "0".to_owned(),
        _ if is_signed && first < 0 => format!("{value:+.decimals$}"),
        _ => format!("{value:.decimals$}"),
    };
    (first..=last).map(|number| number as f64 * step).map(|value| (value, text(value))).collect()
}

/// Moves positions sideways until they are far enough apart: first to the right, then back from the edge.
pub(crate) fn spread(places: impl Iterator<Item = f64>, edges: Range<f64>) -> Vec<f64> {
    let mut places: Vec<f64> = places.collect();
    let apart = ((edges.end - edges.start) / places.len() as f64).min(21.0);
    let mut free = edges.start;
    for place in &mut places {
        *place = place.max(free);
        free = *place + apart;
    }
    let mut free = edges.end;
    for place in places.iter_mut().rev() {
        *place = place.min(free);
        free = *place - apart;
    }
    places
}

/// Drops points that change the line by less than a tenth of a pixel, as long as it goes to the right.
pub(crate) fn thin(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    const ALL: Range<f64> = f64::NEG_INFINITY..f64::INFINITY;
    let mut kept: Vec<(f64, f64)> = Vec::new();
    let mut last: Option<(f64, f64)> = None;
    // The slopes for which the line from the last kept point passes all later ones within a tenth of a pixel.
    let mut slopes = ALL;
    for point in points {
        if let (Some(from), Some(before)) = (kept.last(), last) {
            let across = before.0 - from.0;
            let bounds = [-0.1, 0.1].map(|off| (before.1 + off - from.1) / across);
            slopes = slopes.start.max(bounds[0])..slopes.end.min(bounds[1]);
            let slope = (point.1 - from.1) / (point.0 - from.0);
            if across <= 0.0 || point.0 <= before.0 || !slopes.contains(&slope) {
                kept.push(before);
                slopes = ALL;
            }
            last = Some(point);
        } else if kept.is_empty() {
            kept.push(point);
        } else {
            last = Some(point);
        }
    }
    kept.extend(last);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rest_is_two_points_and_a_step_is_not_dropped() {
        let points = [(0.0, 5.0), (1.0, 5.0), (2.0, 5.0), (3.0, 6.0), (4.0, 6.0), (5.0, 6.0), (5.0, 7.0)];
        assert_eq!(thin(points.into_iter()), [(0.0, 5.0), (2.0, 5.0), (3.0, 6.0), (5.0, 6.0), (5.0, 7.0)]);
        let back = [(0.0, 0.0), (5.0, 0.0), (3.0, 0.0), (9.0, 0.0)];
        assert_eq!(thin(back.into_iter()), back);
    }

    /// No dropped point is visibly off the line, and a long standstill takes time linear in its points.
    #[test]
    fn no_dropped_point_is_off_the_line() {
        let curve: Vec<_> = (0..200_000).map(|n| f64::from(n) / 200.0).map(|x| (x, (x / 50.0).sin() * 80.0)).collect();
        let kept = thin(curve.iter().copied());
        assert!((20..2000).contains(&kept.len()), "{}", kept.len());
        for (x, y) in curve {
            let next = kept.partition_point(|point| point.0 < x).max(1);
            let ((x1, y1), (x2, y2)) = (kept[next - 1], kept[next]);
            assert!((y1 + (y2 - y1) * (x - x1) / (x2 - x1) - y).abs() < 0.11, "{x}");
        }
        assert_eq!(thin((0..1_000_000).map(|n| (f64::from(n), 1.0))).len(), 2);
    }

    #[test]
    fn zero_is_shown_if_it_is_near() {
        assert_eq!(range([100.0, 300.0].into_iter()), -12.0..324.0);
        assert_eq!(range([-300.0, -100.0].into_iter()), -324.0..24.0);
        let supply = range([24.01, 24.03].into_iter());
        assert!(supply.start > 24.0 && supply.end < 24.04, "{supply:?}");
        for constant in [0.0, 24.0, 1e18, -7.0] {
            let around = range([constant].into_iter());
            assert!(around.start < constant && constant < around.end, "{around:?}");
        }
        assert!(!range(std::iter::empty()).is_empty());
    }

    #[test]
    fn numbers_at_an_axis_are_round_and_as_short_as_they_differ() {
        let texts = |range: Range<f64>| ticks(&range, 6, true).into_iter().map(|tick| tick.1).collect::<Vec<_>>();
        assert_eq!(texts(-0.02..0.31), ["0", "0.1", "0.2", "0.3"]);
        assert_eq!(texts(-80.0..81.0), ["-50", "0", "+50"]);
        assert_eq!(texts(24.0..24.04), ["24.00", "24.01", "24.02", "24.03", "24.04"]);
        assert!(texts(1e18..1.1e18).len() > 2);
    }

    #[test]
    fn marks_do_not_cover_each_other_nor_leave_the_picture() {
        let marks = spread([100.0, 101.0, 102.0, 500.0, 930.0, 935.0].into_iter(), 112.0..936.0);
        assert!(marks.windows(2).all(|pair| pair[1] - pair[0] >= 21.0), "{marks:?}");
        for count in [1, 40, 200] {
            let marks = spread((0..count).map(|_| 500.0), 112.0..936.0);
            assert!(marks.iter().all(|mark| (112.0..=936.0).contains(mark)), "{marks:?}");
            assert!(marks.is_sorted());
        }
    }
}
