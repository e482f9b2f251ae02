//! A scripted drive, as its master sees it.

use std::collections::BTreeMap;

use lexican_profibus::pkw::{Parameter, ParameterTable, Pkw, PkwServer, Refusal, Task, Value};
use lexican_runtime::{Duration, Instant};
use siko::order::Order;
use siko_profibus::gateway::ProfibusDoor;
use siko_profibus::master::{DriveMaster, Event, Facts, Telegram};
use siko_profibus::words::{control, status};
use siko_profibus::{AG03_1, Model, PPO, table};

pub(crate) const MODE: u16 = 930;
pub(crate) const SYSTEM: u16 = 1020;

/// The values of its parameters, and those that were requested.
pub(crate) struct Parameters {
    model: &'static Model,
    pub(crate) values: BTreeMap<u16, u32>,
    pub(crate) asked: Vec<Task>,
    pub(crate) refusal: Option<Refusal>,
    pub(crate) is_authorised: bool,
}

impl Parameters {
    fn asks(&mut self, task: Task) -> Result<(), Refusal> {
        if self.asked.last() != Some(&task) {
            self.asked.push(task);
        }
        self.refusal.filter(|_| task != Task::Read { number: SYSTEM }).map_or(Ok(()), Err)
    }
}

impl ParameterTable for Parameters {
    fn is_authorised(&self) -> bool {
        self.is_authorised
    }

    fn parameter(&self, number: u16) -> Option<Parameter> {
        table::find(self.model.table, number).map(|row| row.wire)
    }

    fn read(&mut self, number: u16, index: u16) -> Result<u32, Refusal> {
        let is_array = table::find(self.model.table, number).is_some_and(|row| row.wire.format.elements().is_some());
        self.asks(if is_array { Task::ReadElement { number, index } } else { Task::Read { number } })?;
        Ok(self.values.get(&number).copied().unwrap_or(0))
    }

    fn write(&mut self, number: u16, _: u16, value: u32) -> Result<u32, Refusal> {
        self.asks(Task::Write { number, value: Value::DoubleWord(value) })?;
        self.values.insert(number, value);
        Ok(value)
    }
}

pub(crate) struct Rig {
    pub(crate) door: ProfibusDoor,
    pub(crate) now: Instant,
    tasks: PkwServer,
    pub(crate) parameters: Parameters,
    /// Whether it answers tasks.
    pub(crate) answers: bool,
    /// Whether its status follows the control word.
    pub(crate) follows: bool,
    pub(crate) status: u16,
    pub(crate) actual: i32,
    /// STW and HSW that arrive instead of the master's, while these are held up.
    pub(crate) stuck: Option<(u16, i32)>,
    /// The last STW and HSW.
    pub(crate) last: (u16, i32),
    /// STW and HSW at each change.
    sent: Vec<(u16, i32)>,
    /// The last reported facts.
    pub(crate) shown: Option<siko::gateway::Facts>,
}

impl Rig {
    /// A drive in a mode of PNU 930, before its first exchange of data.
    pub(crate) fn offline(model: &'static Model, mode: u32) -> Self {
        let values = BTreeMap::from([(MODE, mode), (1010, 1), (1011, 1), (1012, 0), (SYSTEM, 0x80)]);
        let parameters = Parameters { model, values, asked: Vec::new(), refusal: None, is_authorised: true };
        Rig {
            door: ProfibusDoor::new(model),
            now: Instant::ZERO,
            tasks: PkwServer::new(),
            parameters,
            answers: true,
            follows: true,
            status: 0x0203,
            actual: 100,
            stuck: None,
            last: (0, 0),
            sent: Vec::new(),
            shown: None,
        }
    }

    /// A drive about which everything is known.
    pub(crate) fn new(mode: u32) -> Self {
        let mut rig = Rig::offline(&AG03_1, mode);
        rig.turns(20);
        assert!(rig.facts().is_some());
        rig
    }

    pub(crate) fn enabled(mode: u32) -> Self {
        let mut rig = Rig::new(mode);
        assert_eq!(rig.order(Order::Enable, 0), Event::Followed);
        assert_eq!(rig.words(), if mode == 1 { vec![0x0B] } else { vec![0x0B, 0x3B] });
        rig
    }

    pub(crate) fn facts(&mut self) -> Option<Facts> {
        self.master().facts().map(|facts| facts.value)
    }

    pub(crate) fn master(&mut self) -> &mut DriveMaster {
        self.door.master_mut()
    }

    /// One exchange, which takes a millisecond.
    pub(crate) fn turn(&mut self) {
        let mut sent = self.master().outputs();
        if let Some((word, target)) = self.stuck {
            PPO.set_word(&mut sent, 0, word);
            PPO.set_double_word(&mut sent, 1, target);
        }
        let (word, target) = (PPO.word(&sent, 0).unwrap(), PPO.double_word(&sent, 1).unwrap());
        let before = core::mem::replace(&mut self.last, (word, target));
        if before != self.last {
            self.sent.push(self.last);
        }
        if self.follows {
            self.follow(word, before.0);
        }
        let task = PPO.pkw(&sent).unwrap();
        let mut received = Telegram::default();
        let reply = if self.answers { self.tasks.handle(task, &mut self.parameters) } else { Pkw::default() };
        PPO.set_pkw(&mut received, reply);
        PPO.set_word(&mut received, 0, self.status);
        PPO.set_double_word(&mut received, 1, self.actual);
        self.now += Duration::from_millis(1);
        let now = self.now;
        self.master().handle_exchange(now, &sent, &received);
        if self.master().poll_timeout().is_some_and(|due| due <= now) {
            self.master().handle_timeout(now);
        }
    }

    /// The immediate status of a drive that follows the order.
    fn follow(&mut self, word: u16, before: u16) {
        let enabled = control::ON | control::ENABLE_OPERATION;
        let travels = enabled | control::NO_STOP | control::NO_INTERMEDIATE_STOP;
        self.status &= !status::OPERATION_ENABLED;
        if word & enabled == enabled {
            self.status |= status::OPERATION_ENABLED;
        }
        if word & before & travels == travels && (word ^ before) & control::START != 0 {
            self.status ^= status::ORDER_ACKNOWLEDGED;
        }
        if word & !before & control::ACKNOWLEDGE != 0 {
            self.status &= !status::FAULT;
        }
    }

    pub(crate) fn turns(&mut self, turns: usize) {
        (0..turns).for_each(|_| self.turn());
    }

    /// The next event, and the milliseconds until it came.
    #[track_caller]
    pub(crate) fn next(&mut self) -> (Event, u64) {
        let begin = self.now;
        for _ in 0..1000 {
            if let Some(event) = self.master().poll() {
                return (event, self.now.since(begin).as_micros() / 1000);
            }
            self.turn();
        }
        panic!("there is none");
    }

    #[track_caller]
    pub(crate) fn order(&mut self, order: Order, target: i32) -> Event {
        let now = self.now;
        self.master().order(now, order, target);
        self.next().0
    }

    #[track_caller]
    pub(crate) fn ask(&mut self, task: Task) -> Event {
        self.master().ask(task);
        self.next().0
    }

    /// What has been sent since the last call.
    pub(crate) fn sent(&mut self) -> Vec<(u16, i32)> {
        core::mem::take(&mut self.sent)
    }

    /// The control words sent since the last call.
    pub(crate) fn words(&mut self) -> Vec<u16> {
        self.sent().into_iter().map(|(word, _)| word).collect()
    }
}
