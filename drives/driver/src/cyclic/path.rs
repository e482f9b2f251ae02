//! Where set-points come from.

use std::sync::mpsc::{Receiver, TryRecvError};

/// What a path returns for a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Supply {
    /// The set-points of all axes are written.
    Ready,
    /// None yet. The axes continue as in the previous cycle, as often as
    /// [`Tolerance::set_points`](super::Tolerance::set_points) permits.
    Late,
    /// No more. The axes stop at the last set-points, and are released.
    End,
}

/// The set-points of a program: a closure, or a [`Queue`].
pub trait Path {
    /// Writes the set-point of each axis for a cycle, counted from 0. The slice comes with those of the previous cycle,
    /// or for cycle 0 with the positions of the axes. Its content counts only if [`Supply::Ready`] is returned.
    ///
    /// It is called between two SYNCs, and must not block: its time is part of the cycle.
    fn set_points(&mut self, cycle: u64, set_points: &mut [i32]) -> Supply;
}

impl<F: FnMut(u64, &mut [i32]) -> Supply> Path for F {
    fn set_points(&mut self, cycle: u64, set_points: &mut [i32]) -> Supply {
        self(cycle, set_points)
    }
}

/// Set-points that another thread computes ahead: one `Vec` for each cycle, with one set-point for each axis. A `Vec`
/// of another length counts as late. The path ends when the sender is dropped.
///
/// `std::sync::mpsc::sync_channel` limits how far ahead they are computed.
#[derive(Debug)]
pub struct Queue(pub Receiver<Vec<i32>>);

impl Path for Queue {
    fn set_points(&mut self, _cycle: u64, set_points: &mut [i32]) -> Supply {
        match self.0.try_recv() {
            Ok(next) if next.len() == set_points.len() => {
                set_points.copy_from_slice(&next);
                Supply::Ready
            }
            Ok(_) | Err(TryRecvError::Empty) => Supply::Late,
            Err(TryRecvError::Disconnected) => Supply::End,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_queue_is_late_while_it_is_empty_and_ends_with_its_sender() {
        let (sender, receiver) = std::sync::mpsc::sync_channel(2);
        let (mut queue, mut set_points) = (Queue(receiver), [0; 2]);
        sender.send(vec![1, 2]).unwrap();
        sender.send(vec![3]).unwrap();
        assert_eq!((queue.set_points(0, &mut set_points), set_points), (Supply::Ready, [1, 2]));
        assert_eq!((queue.set_points(1, &mut set_points), set_points), (Supply::Late, [1, 2]), "too short");
        assert_eq!(queue.set_points(2, &mut set_points), Supply::Late);
        drop(sender);
        assert_eq!(queue.set_points(3, &mut set_points), Supply::End);
    }
}
