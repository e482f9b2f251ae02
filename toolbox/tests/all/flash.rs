//! Program download to a boot loader whose power may fail at any time.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use lexican_runtime::device::{Behaviour, Device, Event};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Node, VirtualBus, VirtualLink};
use lexican_runtime::object::{Access, DataType, Dictionary, PdoMapping, Row, Table};
use lexican_runtime::service::program::{Order, Program, Programming};
use lexican_runtime::service::snapshot::{Flash, FlashError as BrokenFlash};
use lexican_runtime::{Frame, Instant, NodeId};
use lexican_toolbox::node::flash::{Cause, FlashError, Held, Identification, Loader, Progress, Stage, flash, held};

const NODE: NodeId = NodeId::literal(5);
const SIZE: usize = 4096;

const fn row(index: u16, sub: u8, data_type: DataType, access: Access) -> Row {
    Row::new(index, sub, data_type, access, PdoMapping::None)
}

static TABLE: Table = Table {
    rows: &[
        row(0x1000, 0, DataType::Unsigned32, Access::Ro).at(0, 4),
        row(0x1001, 0, DataType::Unsigned8, Access::Ro).at(4, 1),
        row(0x1F50, 1, DataType::Domain, Access::Wo),
        row(0x1F51, 1, DataType::Unsigned8, Access::Rw).at(5, 1),
        row(0x1F56, 1, DataType::Unsigned32, Access::Ro).at(6, 4),
        row(0x1F57, 1, DataType::Unsigned32, Access::Ro).at(10, 4),
    ],
    limits: &[],
    image: &[0; 14],
};

/// A flash whose power fails after a number of writes.
#[derive(Clone)]
struct Nor {
    bytes: Vec<u8>,
    left: Option<usize>,
    has_failed: bool,
}

impl Nor {
    fn new(bytes: Vec<u8>) -> Self {
        Nor { bytes, left: None, has_failed: false }
    }

    fn change(&mut self) -> Result<(), BrokenFlash> {
        match &mut self.left {
            Some(0) => {
                self.has_failed = true;
                Err(BrokenFlash)
            }
            left => {
                left.iter_mut().for_each(|left| *left -= 1);
                Ok(())
            }
        }
    }
}

impl Flash for Nor {
    const WRITE_SIZE: usize = 8;

    fn slot_size(&self) -> u32 {
        SIZE as u32
    }
    fn read(&mut self, offset: u32, buffer: &mut [u8]) -> Result<(), BrokenFlash> {
        buffer.copy_from_slice(&self.bytes[offset as usize..][..buffer.len()]);
        Ok(())
    }
    fn erase(&mut self, _: u32) -> Result<(), BrokenFlash> {
        // Half of it is erased when the power fails.
        self.bytes[..SIZE / 2].fill(0xFF);
        self.change()?;
        self.bytes.fill(0xFF);
        Ok(())
    }
    fn program(&mut self, offset: u32, data: &[u8]) -> Result<(), BrokenFlash> {
        let place = &mut self.bytes[offset as usize..][..data.len()];
        assert!(place.iter().all(|byte| *byte == 0xFF) && data.len().is_multiple_of(Self::WRITE_SIZE), "at {offset}");
        place[0] = data[0];
        self.change()?;
        self.bytes[offset as usize..][..data.len()].copy_from_slice(data);
        Ok(())
    }
}

/// A device that consists only of its boot loader.
struct BootLoader {
    device: Device<0, 0, 1, 0>,
    od: Dictionary<14>,
    program: Program<Nor>,
    has_power: bool,
    boots_at_start: bool,
}

impl BootLoader {
    fn new(now: Instant, flash: Nor) -> Self {
        let mut od = Dictionary::new(&TABLE, NODE);
        let mut device = Device::new(NODE, Behaviour::CIA_301);
        device.restart(now, &mut od);
        BootLoader { device, od, program: Program::new(flash), has_power: true, boots_at_start: false }
    }

    /// Restarts after a loss of power.
    fn power_on(&mut self, now: Instant) {
        let bytes = std::mem::take(&mut self.program.flash().bytes);
        *self = BootLoader::new(now, Nor::new(bytes));
    }

    fn follow(&mut self, now: Instant, event: Option<Event>) {
        self.has_power &= !self.program.flash().has_failed;
        if let Some(Event::Reset(_)) = event {
            self.device.restart(now, &mut self.od);
        }
        match self.program.take_order() {
            Some(Order::Stop) => self.program.set_started(false),
            Some(Order::Start | Order::Reset) => {
                self.program.set_started(true);
                if self.boots_at_start {
                    self.device.restart(now, &mut self.od);
                }
            }
            None => {}
        }
    }
}

impl Node for BootLoader {
    fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        if self.has_power {
            let mut od = Programming::new(&mut self.od, &mut self.program);
            let event = self.device.handle_frame(now, frame, &mut od);
            self.follow(now, event);
        }
    }
    fn handle_timeout(&mut self, now: Instant) {
        let mut od = Programming::new(&mut self.od, &mut self.program);
        let event = self.device.handle_timeout(now, &mut od);
        self.follow(now, event);
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Frame> {
        let mut od = Programming::new(&mut self.od, &mut self.program);
        self.device.poll_transmit(now, &mut od).filter(|_| self.has_power)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.device.poll_timeout()
    }
}

/// A bus with a boot loader and a manager.
struct Bench {
    loader: Arc<Mutex<BootLoader>>,
    network: Network<VirtualLink>,
    rules: Loader,
}

impl Bench {
    fn new() -> Self {
        let bus = VirtualBus::with_bit_rate(500);
        let empty = Nor::new(vec![0xFF; SIZE]);
        let loader = Arc::new(Mutex::new(BootLoader::new(bus.now(), empty)));
        bus.attach(Arc::clone(&loader));
        let rules = Loader { identification: Identification::Crc32, patience_ms: 300, ..Loader::default() };
        Bench { loader, network: Network::new(bus.link()), rules }
    }

    fn flash(&mut self, image: &[u8]) -> Result<u32, FlashError> {
        let go_on = |_| ControlFlow::Continue(());
        flash(&mut self.network, NODE, &self.rules, image, go_on).map(|done| done.after.unwrap())
    }

    fn held(&mut self) -> Held {
        held(&mut self.network, NODE, &self.rules)
    }

    /// The bytes of the program.
    fn program(&self) -> Option<Vec<u8>> {
        let mut loader = self.loader.lock().unwrap();
        let (len, _) = loader.program.held()?;
        Some(loader.program.flash().bytes[..len as usize].to_vec())
    }

    fn power_on(&mut self) {
        let now = self.network.now();
        self.loader.lock().unwrap().power_on(now);
    }
}

fn image(len: usize) -> Vec<u8> {
    (0..len).map(|at| (at * 7 % 251) as u8).collect()
}

#[test]
fn a_program_is_written_checked_and_started() {
    for len in [1, 7, 8, 889, 890, 2000, SIZE - 32] {
        for block in [true, false] {
            let mut bench = Bench::new();
            bench.rules.block = block;
            assert_eq!(bench.held(), Held::Nothing);
            let identification = bench.flash(&image(len)).unwrap();
            assert_eq!(bench.program(), Some(image(len)), "{len} bytes, block: {block}");
            assert_eq!(bench.held(), Held::Program { runs: true, identification: Some(identification) });
            // Replaces it by another program.
            bench.flash(&image(3)).unwrap();
            assert_eq!(bench.program(), Some(image(3)));
        }
    }
}

#[test]
fn a_loss_of_power_at_any_write_leaves_no_program_that_could_start() {
    let whole = image(2000);
    let mut cut = 0;
    loop {
        let mut bench = Bench::new();
        bench.flash(&image(100)).unwrap();
        bench.loader.lock().unwrap().program.flash().left = Some(cut);
        let result = bench.flash(&whole);
        if bench.loader.lock().unwrap().has_power {
            result.unwrap();
            break;
        }
        let error = result.expect_err("the power was gone");
        assert_eq!(error.held, Held::Unknown, "{error}");
        bench.power_on();
        // A power cut while erasing, at any part of the program, or at the seal leaves no program.
        assert_eq!((bench.program(), bench.held()), (None, Held::Nothing), "after {cut} writes");
        bench.flash(&whole).unwrap();
        assert_eq!(bench.program(), Some(whole.clone()), "after {cut} writes");
        cut += 1;
    }
    assert!(cut > 2000 / 8, "{cut} losses: at the erasing, at each part of the program, and at the seal");
}

#[test]
fn the_error_names_the_step_and_what_the_device_holds() {
    let check = |bench: &mut Bench, image: &[u8], stage: Stage, text: &str| {
        let error = bench.flash(image).unwrap_err();
        assert!(error.stage == stage && error.to_string().contains(text), "{error}");
    };
    let mut bench = Bench::new();
    check(&mut bench, &image(SIZE), Stage::Write, "parameter too high; the device holds no valid program");
    bench.rules.clear = None;
    check(&mut bench, &image(9), Stage::Write, "because of the present device state");
    let mut bench = Bench::new();
    bench.flash(&image(9)).unwrap();
    bench.rules.stop = None;
    check(&mut bench, &image(9), Stage::Clear, "the device holds a valid program, which runs (1F56h: ");
    bench.rules.device_type = Some(0xB007);
    check(&mut bench, &image(9), Stage::Stop, "the device type (1000h) is 00000000h");
    (bench.rules.device_type, bench.rules.stop, bench.rules.boots_after_start) = (None, Some(0), true);
    check(&mut bench, &image(9), Stage::Start, "no boot-up message");
    bench.loader.lock().unwrap().boots_at_start = true;
    bench.flash(&image(9)).unwrap();
    bench.rules.program = 2;
    check(&mut bench, &image(9), Stage::Stop, "sub-index does not exist");
}

#[test]
fn somebody_may_interrupt_it_at_any_time() {
    let mut sent = 0;
    for end in 0.. {
        let mut bench = Bench::new();
        let mut left = end;
        let result = flash(&mut bench.network, NODE, &bench.rules, &image(500), |progress: Progress| {
            sent = sent.max(progress.written);
            left -= 1;
            if left < 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let Err(error) = result else { break };
        assert!(matches!(error.cause, Cause::Interrupted), "{error}");
        if error.stage == Stage::Write {
            assert_eq!(error.held, Held::Nothing, "{error}");
            bench.flash(&image(500)).unwrap();
        }
    }
    assert!(sent > 400, "{sent} bytes were reported");
}
