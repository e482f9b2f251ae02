//! Plants that share nothing, at the same time.

use std::num::NonZero;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use lexican_runtime::host::VirtualBus;
use lexican_toolbox::log::{Direction, Record};

use super::plant::{Plant, PlantError};

/// What has come of plants that ran side by side.
#[derive(Debug)]
pub struct SideBySide<R> {
    /// What the program has returned for each plant.
    pub results: Vec<R>,
    /// All frames in the order of their times, those of one time in the order of the plants. The first plant is `can0`.
    pub log: Vec<Record>,
}

/// Switches plants on, each on a bus of its own in virtual time, and calls `program` with the place and the bus of each. Threads
/// take one plant after the other: [`thread::available_parallelism`] of them use all cores.
///
/// Results and log are the same with any number of threads, if the plants share no device, gateway or file, and what the program
/// draws at random comes of its seed and the plant's place. Each plant goes its own way until the program returns: buses
/// between which anything passes are for one program, with a link to each.
///
/// ```
/// use std::num::NonZero;
/// use lexican_runtime::Duration;
/// use lexican_simulation::{Files, Plant, side_by_side};
///
/// let plant = Plant::parse("[node.feeder]\nid = 5\nsheet = 'siko/ag03-1'\n", "machine.toml", Files::Embedded(&[]))?;
/// let threads = NonZero::new(2).unwrap();
/// let run = side_by_side([&plant, &plant], threads, |_, bus| bus.advance(Duration::from_secs(1)))?;
/// let boot_ups: Vec<_> = run.log.iter().map(|record| (&*record.interface, record.frame.id().raw())).collect();
/// assert_eq!(boot_ups, [("can0", 0x705), ("can1", 0x705)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn side_by_side<'a, R: Send>(
    plants: impl IntoIterator<Item = &'a Plant>,
    threads: NonZero<usize>,
    program: impl Fn(usize, &VirtualBus) -> R + Sync,
) -> Result<SideBySide<R>, PlantError> {
    let plants: Vec<&Plant> = plants.into_iter().collect();
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let place = next.fetch_add(1, Ordering::Relaxed);
            let Some(plant) = plants.get(place) else { return done };
            done.push((place, alone(plant, place, &program)));
        }
    };
    let mut done: Vec<_> = thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.get().min(plants.len())).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap_or_else(|panic| resume_unwind(panic))).collect()
    });
    done.sort_by_key(|(place, _)| *place);
    let done = done.into_iter().map(|(_, run)| run).collect::<Result<Vec<_>, _>>()?;
    let (results, logs): (_, Vec<_>) = done.into_iter().unzip();
    let mut log = logs.concat();
    log.sort_by_key(|record| record.at);
    Ok(SideBySide { results, log })
}

/// Runs a plant, and keeps what is on its bus.
fn alone<R>(
    plant: &Plant,
    place: usize,
    program: impl Fn(usize, &VirtualBus) -> R,
) -> Result<(R, Vec<Record>), PlantError> {
    let bus = VirtualBus::with_bit_rate(plant.bit_rate_kbit);
    let interface: Arc<str> = format!("can{place}").into();
    let heard = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&heard);
    bus.observe(move |at, frame| {
        let (interface, direction, frame) = (Arc::clone(&interface), Direction::Received, *frame);
        log.lock().unwrap_or_else(PoisonError::into_inner).push(Record { at, interface, direction, frame });
    });
    plant.attach(&bus)?;
    let result = program(place, &bus);
    let log = std::mem::take(&mut *heard.lock().unwrap_or_else(PoisonError::into_inner));
    Ok((result, log))
}
