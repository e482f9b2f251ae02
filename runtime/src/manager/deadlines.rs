//! Deadlines of places, found by the earliest.

use super::places::Place;
use crate::time::Instant;

/// A deadline for each of `N` places, in a tournament tree: in each game the place with the earlier deadline wins, and
/// the winner of game 1 has the earliest of all. When a deadline changes, only the games on its way to game 1 are
/// played again.
#[derive(Clone, Debug)]
pub(super) struct Deadlines<const N: usize> {
    /// By place.
    at: [Instant; N],
    /// The winners of games 1 to N - 1. Game `g` is between the winners of games `2 g` and `2 g + 1`; game numbers from
    /// N on stand for places.
    winners: [Place; N],
}

/// No deadline.
const NEVER: Instant = Instant::MAX;

impl<const N: usize> Deadlines<N> {
    pub(super) const fn new() -> Self {
        Deadlines { at: [NEVER; N], winners: [Place::NONE; N] }
    }

    /// The earliest deadline.
    pub(super) fn first(&self) -> Option<Instant> {
        Some(self.at(self.winner(1))).filter(|&at| at < NEVER)
    }

    /// The place with the earliest deadline, if that has come.
    pub(super) fn due(&self, now: Instant) -> Option<Place> {
        self.first().filter(|&first| first <= now).map(|_| self.winner(1))
    }

    pub(super) fn set(&mut self, place: Place, deadline: Option<Instant>) {
        let deadline = deadline.unwrap_or(NEVER);
        match self.at.get_mut(place.index()) {
            Some(at) if *at != deadline => *at = deadline,
            _ => return,
        }
        let mut game = (N + place.index()) / 2;
        while game > 0 {
            let [one, other] = [2 * game, 2 * game + 1].map(|game| self.winner(game));
            let is_one = (self.at(one), one) < (self.at(other), other);
            if let Some(winner) = self.winners.get_mut(game) {
                *winner = if is_one { one } else { other };
            }
            game /= 2;
        }
    }

    fn winner(&self, game: usize) -> Place {
        self.winners.get(game).copied().unwrap_or_else(|| Place::nearest(game - N))
    }

    fn at(&self, place: Place) -> Instant {
        self.at.get(place.index()).copied().unwrap_or(NEVER)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_earliest_deadline_is_that_of_a_search(
            changes in prop::collection::vec((0..127_u8, prop::option::of(0..6_u64)), 0..60)
        ) {
            check::<1>(&changes)?;
            check::<2>(&changes)?;
            check::<7>(&changes)?;
            check::<127>(&changes)?;
        }
    }

    fn check<const N: usize>(changes: &[(u8, Option<u64>)]) -> Result<(), TestCaseError> {
        let (mut deadlines, mut expected) = (Deadlines::<N>::new(), [None; N]);
        for &(place, deadline) in changes {
            let (place, deadline) = (usize::from(place) % N, deadline.map(Instant::from_micros));
            deadlines.set(Place::at(place).unwrap(), deadline);
            expected[place] = deadline;
            let first = expected.iter().flatten().min().copied();
            prop_assert_eq!(deadlines.first(), first);
            for now in (0..7).map(Instant::from_micros) {
                let due = deadlines.due(now).map(Place::index);
                let earliest = expected.iter().position(|&at| at.is_some() && at == first);
                prop_assert_eq!(due, earliest.filter(|_| first <= Some(now)));
            }
        }
        Ok(())
    }
}
