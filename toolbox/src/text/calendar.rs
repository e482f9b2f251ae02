//! The calendar of UTC.

use lexican_runtime::Instant;

/// The length of a day, in µs.
pub(crate) const DAY: u64 = 86_400_000_000;

/// A date and time in UTC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Civil {
    pub(crate) year: u64,
    /// 1 to 12.
    pub(crate) month: u64,
    /// 1 to 31.
    pub(crate) day: u64,
    /// In µs since midnight.
    pub(crate) time: u64,
}

impl Civil {
    /// The date of a point in time since 1970.
    pub(crate) fn of(at: Instant) -> Self {
        let (days, time) = (at.as_micros() / DAY, at.as_micros() % DAY);
        // Years that begin in March end with their leap day; 400 of them have 146,097 days.
        let since_march_0000 = days + 719_468;
        let (era, day) = (since_march_0000 / 146_097, since_march_0000 % 146_097);
        let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
        let day = day - (365 * year + year / 4 - year / 100);
        let month = (5 * day + 2) / 153;
        let day = day - (153 * month + 2) / 5 + 1;
        let month = if month < 10 { month + 3 } else { month - 9 };
        Civil { year: era * 400 + year + u64::from(month <= 2), month, day, time }
    }

    /// The point in time; `None` if the date does not exist, is before 1970, or after the year 9999.
    pub(crate) fn at(self) -> Option<Instant> {
        let Civil { year, month, day, time } = self;
        if !(1970..=9999).contains(&year) || !(1..=12).contains(&month) || !(1..=31).contains(&day) || time >= DAY {
            return None;
        }
        let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
        let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 1 - 719_468;
        let at = Instant::from_micros(days * DAY + time);
        // 31 April would become 1 May, which shows that the date does not exist.
        (Civil::of(at) == self).then_some(at)
    }

    /// 0 for Sunday.
    pub(crate) fn weekday(self) -> u64 {
        // 1 January 1970 was a Thursday.
        self.at().map_or(0, |at| (at.as_micros() / DAY + 4) % 7)
    }

    /// Hours, minutes, seconds and milliseconds.
    pub(crate) fn clock(self) -> [u64; 4] {
        let ms = self.time / 1000;
        [ms / 3_600_000, ms / 60_000 % 60, ms / 1000 % 60, ms % 1000]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_day_reads_back() {
        for days in 0..146_097 * 2 {
            let at = Instant::from_micros(days * DAY + 1);
            assert_eq!(Civil::of(at).at(), Some(at));
        }
    }
}
