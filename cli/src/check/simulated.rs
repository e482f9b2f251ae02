//! Simulates every data sheet in a folder: the device must boot and obey NMT, and `check` must find no difference.
//!
//! `LEXICAN_SHEETS` names the folder; by default, the data sheets are those of the tests and the device library. `cargo
//! xtask corpus` uses real ones.

use crate::bus::network;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{env, fs, thread};

use lexican_eds::convert::Format;
use lexican_eds::{Input, Source};
use lexican_runtime::host::AccessError;
use lexican_runtime::host::{VirtualBus, VirtualLink};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::wire::heartbeat::ErrorControl;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{Duration, Instant};

use simulator::servo;

use super::*;
use lexican_simulation::VirtualDevice;

const NODE: NodeId = NodeId::literal(5);
/// The longest heartbeat period plus a second, because a heartbeat producer does not respond to guarding.
const PATIENCE: Duration = Duration::from_millis(0xFFFF + 1000);

#[test]
fn every_simulated_device_agrees_with_its_data_sheet() {
    let files = data_sheets();
    assert!(!files.is_empty(), "there is no data sheet");
    let (next, simulated) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let deviating = Mutex::new(Vec::new());
    let work = || {
        while let Some(path) = files.get(next.fetch_add(1, Ordering::Relaxed)) {
            let Some(device) = load(path) else { continue };
            simulated.fetch_add(1, Ordering::Relaxed);
            let found = deviations(&device);
            let lines = found.iter().map(|line| format!("{}: {line}", path.display()));
            deviating.lock().unwrap().extend(lines);
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    let mut deviating = deviating.into_inner().unwrap();
    deviating.sort();
    assert!(deviating.is_empty(), "{} deviations:\n{}", deviating.len(), deviating.join("\n"));
    println!("{} data sheets, {} of them simulated", files.len(), simulated.into_inner());
}

/// The device of a data sheet; `None` if that has errors or no objects.
fn load(path: &Path) -> Option<Device> {
    let bytes = fs::read(path).expect("the data sheet can be read");
    let (device, findings) = lexican_eds::load(&Input::new(Source::from_bytes(path.to_string_lossy(), &bytes)));
    (!findings.has_errors() && !device.objects.is_empty()).then_some(device)
}

/// The differences between a simulated device and its data sheet.
fn deviations(device: &Device) -> Vec<String> {
    let bus = VirtualBus::new();
    let mut watch = bus.link();
    watch.listen_to(&[ErrorControl::cob_id(NODE)]).expect("a virtual bus filters");
    bus.attach(VirtualDevice::power_on(bus.now(), NODE, device));
    let mut found = Vec::new();
    let boots = next_state(&mut watch, PATIENCE);
    if boots != Some(NmtState::Initialising) {
        found.push(format!("no boot-up message, but {boots:?}"));
    }
    let mut network = network(bus.link()).expect("a virtual bus filters");
    found.extend(disobeyed(device, &mut watch, &mut network));
    let extent = Extent { write: true, domains: true };
    let checked = inspect(&mut network, NODE, device, extent, |report, findings| {
        // Measured values of a drive differ from the defaults.
        let is_measured = servo::measures(report.address);
        let deviations = findings
            .iter()
            .filter(|finding| finding.kind.is_difference() || (finding.kind == Kind::Default && !is_measured));
        found.extend(deviations.map(|finding| format!("{}: {}: {}", finding.kind, report.title(), finding.text)));
        Ok(())
    });
    found.extend(checked.err().map(|failure| failure.to_string()));
    found
}

/// The NMT commands that the node does not obey, by its state and by whether SDO works.
fn disobeyed(device: &Device, watch: &mut VirtualLink, network: &mut Network<VirtualLink>) -> Vec<String> {
    let mut found = Vec::new();
    let first = state(watch, network);
    for (command, expected) in [
        (NmtCommand::EnterPreOperational, Some(NmtState::PreOperational)),
        (NmtCommand::Start, Some(NmtState::Operational)),
        (NmtCommand::Stop, Some(NmtState::Stopped)),
        (NmtCommand::ResetCommunication, first),
        (NmtCommand::Start, Some(NmtState::Operational)),
        (NmtCommand::ResetNode, first),
    ] {
        network.command(command, Some(NODE)).expect("a virtual bus carries frames");
        if matches!(command, NmtCommand::ResetNode | NmtCommand::ResetCommunication)
            && !(0..20).any(|_| next_state(watch, PATIENCE) == Some(NmtState::Initialising))
        {
            found.push(format!("no boot-up message after {command:?}"));
        }
        let reached = state(watch, network);
        if reached.is_none() || reached != expected {
            found.push(format!("{command:?} leads to {reached:?}, not to {expected:?}"));
        }
        let entry = device.entries().find(|entry| entry.access != lexican_eds::model::AccessType::Wo);
        let Some(entry) = entry else { continue };
        let answers = !matches!(
            network.read_bytes(NODE, address(entry)),
            Err(AccessError::Sdo { error: SdoError::TimedOut { .. }, .. })
        );
        if answers == (reached == Some(NmtState::Stopped)) {
            found.push(format!("after {command:?}, SDO {} answered", if answers { "is" } else { "is not" }));
        }
    }
    found
}

/// The state from the response to guarding, or else from the next heartbeat.
fn state(watch: &mut VirtualLink, network: &mut Network<VirtualLink>) -> Option<NmtState> {
    while next_state(watch, Duration::ZERO).is_some() {}
    network.send(&ErrorControl::request(NODE)).expect("a virtual bus carries frames");
    next_state(watch, PATIENCE)
}

fn next_state(watch: &mut VirtualLink, patience: Duration) -> Option<NmtState> {
    let until: Instant = watch.now() + patience;
    loop {
        let frame = watch.receive_frame(until).expect("a virtual bus carries frames")?;
        if let Some(error_control) = ErrorControl::parse(frame.data()).filter(|_| !frame.is_remote()) {
            return Some(error_control.state);
        }
    }
}

fn data_sheets() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folders = match env::var_os("LEXICAN_SHEETS") {
        Some(folder) => vec![PathBuf::from(folder)],
        None => ["eds/devices", "eds/tests/golden", "tests/golden"].map(|folder| root.join(folder)).to_vec(),
    };
    let mut files = Vec::new();
    folders.iter().for_each(|folder| collect(folder, &mut files));
    files.sort();
    files
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    for entry in entries {
        let path = entry.expect("the folder can be read").path();
        let is_sheet = Format::of(&path).is_some();
        if path.is_dir() {
            collect(&path, files);
        } else if is_sheet {
            files.push(path);
        }
    }
}
