//! The master's side: one task at a time.

use lexican_runtime::{Duration, Instant};

use super::{Pkw, Reply, Task};

/// Reads and writes parameters through the PKW of a slave. [`PkwMaster::output`] goes into every telegram, and the PKW
/// of every answer goes to [`PkwMaster::handle_input`].
///
/// The slave repeats its reply until the task changes, so a reply might belong to the previous task. Therefore the
/// master sends "no task" between two tasks until the slave answers "no reply": the next reply belongs to the new task.
#[derive(Clone, Debug)]
pub struct PkwMaster {
    state: State,
    patience: Duration,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// "No task" is being sent, and is not answered yet. The task that waits for the answer, if any, and its deadline.
    Clearing(Option<(Task, Instant)>),
    /// "No task" has been answered.
    Idle,
    /// A task is sent, with its deadline.
    Asking(Task, Instant),
}

/// How a task ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum Event {
    Answered {
        task: Task,
        /// A refusal is a reply, too.
        reply: Reply,
    },
    /// The slave has not answered in time. It may have carried the task out, or may still do so.
    TimedOut { task: Task },
}

impl PkwMaster {
    /// `patience` is how long to wait for each answer.
    #[must_use]
    pub const fn new(patience: Duration) -> Self {
        PkwMaster { state: State::Clearing(None), patience }
    }

    /// Whether a task is under way.
    #[must_use]
    pub const fn is_busy(&self) -> bool {
        matches!(self.state, State::Clearing(Some(_)) | State::Asking(..))
    }

    /// Begins a task; returns `false` if another one is under way.
    #[must_use = "a task is not begun while another one is under way"]
    pub fn start(&mut self, now: Instant, task: Task) -> bool {
        let due = now + self.patience;
        self.state = match self.state {
            State::Idle => State::Asking(task, due),
            State::Clearing(None) => State::Clearing(Some((task, due))),
            State::Clearing(Some(_)) | State::Asking(..) => return false,
        };
        true
    }

    /// The PKW for the next telegram.
    #[must_use]
    pub fn output(&self) -> Pkw {
        match self.state {
            State::Asking(task, _) => task.pkw(),
            State::Clearing(_) | State::Idle => Pkw::default(),
        }
    }

    /// Handles the PKW of an answer. A reply that does not fit the task is ignored.
    pub fn handle_input(&mut self, pkw: Pkw) -> Option<Event> {
        match self.state {
            State::Clearing(waiting) if pkw.identifier == 0 => {
                self.state = waiting.map_or(State::Idle, |(task, due)| State::Asking(task, due));
                None
            }
            State::Asking(task, _) => {
                let reply = Reply::parse(pkw).ok()?.filter(|reply| fits(task, *reply, pkw))?;
                self.state = State::Clearing(None);
                Some(Event::Answered { task, reply })
            }
            State::Clearing(_) | State::Idle => None,
        }
    }

    /// When [`PkwMaster::handle_timeout`] has something to do.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        match self.state {
            State::Asking(_, due) | State::Clearing(Some((_, due))) => Some(due),
            State::Clearing(None) | State::Idle => None,
        }
    }

    /// Gives up a task whose time is over.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Event> {
        match self.state {
            State::Asking(task, due) | State::Clearing(Some((task, due))) if due <= now => {
                self.state = State::Clearing(None);
                Some(Event::TimedOut { task })
            }
            _ => None,
        }
    }

    /// Drops the task, as when the slave has left data exchange.
    pub fn reset(&mut self) {
        self.state = State::Clearing(None);
    }
}

/// Whether the reply can belong to the task. A word may be answered as a double word, as some drives do for certain
/// parameters.
fn fits(task: Task, reply: Reply, pkw: Pkw) -> bool {
    let kind = match (task, reply) {
        (_, Reply::Refused(_) | Reply::NoAuthority)
        | (Task::Read { .. } | Task::Write { .. }, Reply::Value(_))
        | (Task::ReadDescription { .. } | Task::WriteDescription { .. }, Reply::Description(_))
        | (Task::CountElements { .. }, Reply::Count(_)) => true,
        (Task::ReadElement { index, .. } | Task::WriteElement { index, .. }, Reply::Element(_)) => pkw.index == index,
        _ => false,
    };
    kind && pkw.number == task.number()
}

#[cfg(test)]
mod tests {
    use super::super::{Refusal, Value};
    use super::*;

    const READ: Task = Task::Read { number: 1018 };

    fn ms(ms: u64) -> Instant {
        Instant::ZERO + Duration::from_millis(ms)
    }

    fn idle() -> PkwMaster {
        let mut master = PkwMaster::new(Duration::from_millis(100));
        assert_eq!(master.handle_input(Pkw::default()), None);
        master
    }

    #[test]
    fn a_task_is_repeated_until_it_is_answered() {
        let mut master = idle();
        assert!(master.start(ms(0), READ) && master.is_busy());
        assert!(!master.start(ms(0), READ));
        let reply = Reply::Value(Value::DoubleWord(10_000));
        let foreign = [Reply::Count(1), Reply::Element(Value::Word(1))].map(|reply| reply.pkw(READ.pkw()));
        let other = reply.pkw(Task::Read { number: 1017 }.pkw());
        for stale in [Pkw::default(), other, Pkw { identifier: 9, ..READ.pkw() }].into_iter().chain(foreign) {
            assert_eq!((master.handle_input(stale), master.output()), (None, READ.pkw()));
        }
        let answered = Event::Answered { task: READ, reply };
        assert_eq!(master.handle_input(reply.pkw(READ.pkw())), Some(answered));
        assert_eq!((master.output(), master.is_busy()), (Pkw::default(), false));
    }

    #[test]
    fn the_reply_to_the_task_before_is_none_to_the_next() {
        let mut master = idle();
        let write = |value| Task::Write { number: 1016, value: Value::DoubleWord(value) };
        let reply = |value| Reply::Value(Value::DoubleWord(value));
        assert!(master.start(ms(0), write(1)));
        assert!(master.handle_input(reply(1).pkw(write(1).pkw())).is_some());
        assert!(master.start(ms(1), write(2)));
        assert_eq!((master.handle_input(reply(1).pkw(write(1).pkw())), master.output()), (None, Pkw::default()));
        assert_eq!((master.handle_input(Pkw::default()), master.output()), (None, write(2).pkw()));
        let event = master.handle_input(reply(2).pkw(write(2).pkw()));
        assert_eq!(event, Some(Event::Answered { task: write(2), reply: reply(2) }));
    }

    #[test]
    fn a_refusal_is_an_answer_and_silence_is_not() {
        let mut master = idle();
        assert!(master.start(ms(0), READ));
        let refused = Reply::Refused(Refusal::WRONG_STATE);
        let event = master.handle_input(refused.pkw(READ.pkw()));
        assert_eq!(event, Some(Event::Answered { task: READ, reply: refused }));
        assert!(master.start(ms(5), READ));
        assert_eq!((master.poll_timeout(), master.handle_timeout(ms(104))), (Some(ms(105)), None));
        assert_eq!(master.handle_timeout(ms(105)), Some(Event::TimedOut { task: READ }));
        assert_eq!((master.poll_timeout(), master.is_busy()), (None, false));
    }

    #[test]
    fn elements_are_told_apart_by_their_index() {
        let mut master = idle();
        let task = |index| Task::ReadElement { number: 945, index };
        assert!(master.start(ms(0), task(3)));
        let reply = Reply::Element(Value::Word(0x41));
        assert_eq!(master.handle_input(reply.pkw(task(2).pkw())), None);
        assert_eq!(master.handle_input(reply.pkw(task(3).pkw())), Some(Event::Answered { task: task(3), reply }));
        assert!(master.start(ms(0), task(4)));
        master.reset();
        assert!(!master.is_busy());
    }
}
