//! `lexican conform`: the conformance test of a device.

pub(crate) mod print;
pub(crate) mod reports;
mod trace;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use lexican_conform::{
    About, Case, Earlier, Ended, Hazard, HostLateness, InputStimulus, Known, Level, Report, Settings, Sheet, Stimuli,
    Write, cases, profile_cases, run as test,
};
use lexican_eds::model::Device;
use lexican_runtime::host::schemes::SOCKETCAN;
use lexican_runtime::host::{BusUrl, Pace};
use lexican_runtime::object::Address;
use lexican_runtime::{Duration, NodeId};
use serde::Deserialize;

use crate::bus::{BUS, Bus, BusArgs, NODE, kinds, node_id, url, which_node};
use crate::device::{find, guard};
use crate::output::{Failure, Outcome, ctrl_c, plural};
use lexican_toolbox::data_sheet::with_overlays;
use lexican_toolbox::decode::Decoder;
use lexican_toolbox::text::duration::time;
use lexican_toolbox::values::lookup::resolve;
use print::Screen;
use reports::{ReportArgs, about};

/// Test whether a device does what CANopen asks for
///
/// Runs the 127 cases of CiA's test plan (CCT 3.0.3.10), and some beyond it, by the device's data sheet. The device is reset before each
/// case. What a case writes is put back after it, also after Ctrl-C. A case that may move a machine, or that outlasts the
/// test, is run only with --allow. A drive (CiA 402) is also tested as such, with --allow motion: it moves.
///
/// Exit code 1 if a case fails that a standard requires, something could not be put back, or a case is worse than in the
/// report of --against; 2 if the bus is lost or a drive
/// does not stop.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The bus: can0, slcan:/dev/ttyACM0?bitrate=500000 or sim:siko/ag03-1?node=5
    #[arg(long, value_name = "URL", env = BUS, value_parser = url, required_unless_present = "list")]
    bus: Option<BusUrl>,

    #[arg(value_name = "NODE", value_parser = node_id, help = NODE)]
    node: Option<NodeId>,

    /// The data sheet: an EDS, DCF or XDD file, or a device that lexican knows; may be left out for a simulation
    #[arg(long, value_name = "FILE|DEVICE")]
    device: Option<String>,

    /// Corrections and meanings in addition to the data sheet (TOML); may be given several times
    #[arg(long, value_name = "FILE")]
    overlay: Vec<PathBuf>,

    /// Instead of the cases, ask the device by the frames of this file (CSV): each chapter after a reset
    ///
    /// A row is a frame: cob_id and data (hexadecimal, x for any digit), and if wanted chapter, direction (send or expect), meaning
    /// and condition: until, until 5s, about (5 %), any value, any time, not before 100ms, after 2s; several with ; between. A
    /// chapter with frames of other nodes, or with what is not allowed, is left out
    #[arg(long, value_name = "FILE", conflicts_with_all = ["only", "skip", "list", "plan", "repeat", "seed", "known"])]
    trace: Option<PathBuf>,

    #[command(flatten)]
    selection: Selection,

    #[command(flatten)]
    conditions: Conditions,

    #[command(flatten)]
    reports: Reports,
}

#[derive(clap::Args, Debug)]
struct Selection {
    /// Only these cases: ids such as 301/7.2.4.3.7/2, numbers of the plan such as 2.17, or chapters of either
    #[arg(long, value_name = "CASE", value_delimiter = ',')]
    only: Vec<String>,

    /// Not these cases
    #[arg(long, value_name = "CASE", value_delimiter = ',')]
    skip: Vec<String>,

    /// List the cases, and test nothing
    #[arg(long)]
    list: bool,

    /// Print what would be run and what has to be allowed for it, and test nothing
    #[arg(long)]
    plan: bool,

    /// Run the cases so many times
    #[arg(long, value_name = "TIMES", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeat: u32,

    /// Run the cases in an order that this number decides
    #[arg(long, value_name = "NUMBER")]
    seed: Option<u64>,
}

#[derive(clap::Args, Debug)]
struct Conditions {
    /// Allow what may be dangerous or outlasts the test: motion, outputs, manufacturer, store, restore, node-id, or all
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    allow: Vec<Allowed>,

    /// Stop at the first case that fails
    #[arg(long)]
    fail_fast: bool,

    /// Count what the standards only recommend as well
    #[arg(long)]
    strict: bool,

    /// A file of known deviations (TOML): the cases, what is seen (with * for any text), and why; they do not count
    #[arg(long, value_name = "FILE")]
    known: Option<PathBuf>,

    /// How long the device may take to boot
    #[arg(long, value_name = "TIME", default_value = "5s", value_parser = time)]
    boot_time: Duration,

    /// How long to wait for a bus that is lost
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = time)]
    reconnect: Duration,

    /// The bit rate of the bus in kbit/s, so that the device has it again after others were given to it by LSS
    #[arg(long, value_name = "KBIT")]
    bit_rate: Option<u16>,

    /// A write that makes the device send an emergency: 2004=0xCDAB3120
    #[arg(long, value_name = "OBJECT=VALUE")]
    emergency: Option<String>,

    /// How to make an input change faster than every 20 ms: the write that begins it, the one that ends it, and the object
    /// that shows the input
    #[arg(long, value_name = "WRITE,WRITE,OBJECT", value_delimiter = ',', num_args = 3)]
    input: Vec<String>,

    /// How far a drive may travel to either side, in the units of 6064h [default: by the data sheet, see --plan]
    #[arg(long, value_name = "UNITS", value_parser = clap::value_parser!(u32).range(1..))]
    travel: Option<u32>,

    /// How fast a drive may travel, in the units of 6081h and 60FFh [default: by the data sheet, see --plan]
    #[arg(long, value_name = "VELOCITY", value_parser = clap::value_parser!(u32).range(1..))]
    velocity: Option<u32>,
}

#[derive(clap::Args, Debug)]
struct Reports {
    #[command(flatten)]
    files: ReportArgs,

    /// Compare with an earlier report (JSON): what is worse, better, new or gone; exit code 1 if a case is worse
    #[arg(long, value_name = "FILE", conflicts_with_all = ["list", "plan"])]
    against: Option<PathBuf>,

    /// Who tests, for the report; else it has an empty line for the name
    #[arg(long, value_name = "NAME", default_value = "", hide_default_value = true)]
    tester: String,

    /// A remark for the report; may be given several times
    #[arg(long, value_name = "TEXT")]
    remark: Vec<String>,

    /// Print one JSON object per line: each case when it has ended, and the sum
    #[arg(long, conflicts_with_all = ["list", "plan"])]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican conform --bus can0 5 --device FILE.eds --plan
    lexican conform --bus can0 5 --device FILE.eds --report report.html
    lexican conform --bus can0 5 --device FILE.eds --report new.json --against report.json
    lexican conform --bus can0 5 --device FILE.eds --only 2,301/7.5.2 --allow store,restore
    lexican conform --bus can0 5 --device DRIVE.eds --only 402 --allow motion --velocity 200
    lexican conform --bus can0 5 --device DRIVE.eds --trace frames.csv --allow motion";

#[derive(Clone, Debug)]
struct Allowed(Vec<Hazard>);

impl FromStr for Allowed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "all" {
            return Ok(Allowed(Hazard::ALL.to_vec()));
        }
        let hazard = Hazard::ALL.into_iter().find(|hazard| hazard.name() == text);
        let names = Hazard::ALL.map(Hazard::name).join(", ");
        hazard.map(|hazard| Allowed(vec![hazard])).ok_or_else(|| format!("it is none of {names}, all"))
    }
}

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let chosen = args.selection.chosen()?;
    let Some(bus) = args.bus.as_ref().filter(|_| !args.selection.list) else {
        print::list(&args.selection.in_order(chosen))?;
        return Ok(Outcome::Clean);
    };
    let bus = BusArgs::named(bus.clone());
    args.reports.files.guard(|path| guard(path, args.device.as_deref(), &args.overlay))?;
    let named = args.device.as_deref().map(find).transpose()?.map(|(input, _)| input);
    let Bus { mut link, nodes, simulation } = bus.open(Pace::Virtual)?.settled()?;
    let only = if let [(node, _)] = nodes.as_slice() { Some(*node) } else { None };
    let node = args.node.or(only).ok_or_else(which_node)?;
    let known = nodes.into_iter().find(|(known, _)| *known == node).map(|(_, sheet)| sheet.input);
    let input = named.or(known).ok_or_else(|| {
        Failure::new("a device is tested by its data sheet")
            .help("name it with --device FILE, or a device that lexican knows")
    })?;
    let input = with_overlays(input, &args.overlay)?;
    let (sheet, data_sheet) = (Sheet::of(&input), input.eds.name().to_owned());
    let mut settings = args.conditions.settings(node, &sheet.device)?;
    if simulation.is_none() {
        settings.host = HostLateness::watched();
    }
    let about = About {
        device: print::name(&sheet.device).to_owned(),
        node: node.get(),
        data_sheet,
        tester: args.reports.tester.clone(),
        remarks: args.reports.remark.clone(),
        ..args.about(&sheet, &settings)
    };
    let earlier = args.reports.against.as_deref().map(earlier).transpose()?;
    if let Some(path) = &args.trace {
        let report = trace::run(path, &mut link, &sheet, &settings, args.reports.json)?;
        let about = with_plan(about, format!("{}, {}", path.display(), plural(report.chapters.len(), "chapter")));
        let is_worse = args.reports.write(&report.report(), about, earlier.as_ref(), &sheet.device)?;
        return trace::outcome(&report, is_worse);
    }
    let cases = args.selection.for_device(chosen, &sheet.device);
    if !args.reports.json {
        print::plan(&cases, &sheet, &settings)?;
    }
    if args.selection.plan {
        return Ok(Outcome::Clean);
    }
    let about = with_plan(about, format!("CCT 3.0.3.10 and beyond, {} cases", cases.len()));
    let mut screen = Screen::new(node, &sheet.device, args.reports.json);
    let report = test(&mut link, &sheet, &settings, &cases, &*ctrl_c()?, &mut screen);
    screen.finish();
    let is_worse = args.reports.write(&report, about, earlier.as_ref(), &sheet.device)?;
    print::sum(&report, args.reports.json)?;
    let tally = report.tally();
    let counted =
        tally.failed + tally.blocked + tally.unfinished + if args.conditions.strict { tally.advised } else { 0 };
    match &report.ended_early {
        Some(end @ (Ended::BusLost(_) | Ended::Moving(_) | Ended::Unfit(_))) => Err(Failure::new(end)),
        Some(end @ Ended::Silent(_)) if report.cases.is_empty() => Err(Failure::new(end)),
        None if counted == 0 && report.not_put_back.is_empty() && !is_worse => Ok(Outcome::Clean),
        _ => Ok(Outcome::Found),
    }
}

impl Args {
    /// The head of a report, besides the device.
    fn about(&self, sheet: &Sheet, settings: &Settings) -> About {
        let bus = self.bus.as_ref();
        let rate = match (bus.and_then(kinds::bit_rate), settings.bit_rate_kbit) {
            (Some(rate), _) => format!("{} kbit/s", rate / 1000),
            (None, Some(rate)) => format!("{rate} kbit/s"),
            (None, None) if bus.is_some_and(|bus| bus.scheme().name == SOCKETCAN.name) => {
                "that of the interface".to_owned()
            }
            _ => "not known".to_owned(),
        };
        let allowed: Vec<_> = settings.allow.iter().map(|hazard| hazard.name()).collect();
        let allowed = if allowed.is_empty() { "nothing".to_owned() } else { allowed.join(", ") };
        let bus = bus.map(ToString::to_string).unwrap_or_default();
        let mut about = about([("bus", bus), ("bit rate", rate), ("allowed", allowed)]);
        about.facts.extend(sheet.checksums.iter().map(|(file, sum)| (format!("SHA-256 of {file}"), sum.clone())));
        about
    }
}

impl Reports {
    /// Writes the reports; returns whether the device is worse than in an earlier one.
    fn write(
        &self,
        report: &Report,
        about: About,
        earlier: Option<&(String, Earlier)>,
        device: &Device,
    ) -> Result<bool, Failure> {
        if self.files.is_empty() && earlier.is_none() {
            return Ok(false);
        }
        let mut decoder = Decoder::new();
        decoder.introduce(NodeId::try_from(about.node).map_err(Failure::new)?, device);
        let mut document = report.document(about, |frame| decoder.decode(frame).words());
        let mut is_worse = false;
        if let Some((name, earlier)) = earlier {
            let differences = document.compare(name, earlier);
            is_worse = !differences.worse.is_empty();
            print::differences(differences, self.json)?;
        }
        self.files.write(&document)?;
        Ok(is_worse)
    }
}

/// Adds the tested plan after the version in the head of a report.
fn with_plan(mut about: About, plan: String) -> About {
    about.facts.insert(2, ("plan".to_owned(), plan));
    about
}

/// An earlier report, with its file name.
fn earlier(path: &Path) -> Result<(String, Earlier), Failure> {
    let text = std::fs::read_to_string(path).map_err(|error| Failure::file("read", path, &error))?;
    let earlier = Earlier::parse(&text).map_err(|error| {
        Failure::new(format_args!("{} is no report of a test: {error}", path.display()))
            .help("`lexican conform --report FILE.json` writes one")
    })?;
    Ok((path.display().to_string(), earlier))
}

impl Selection {
    /// The selected cases of all suites, without duplicates.
    fn chosen(&self) -> Result<Vec<&'static Case>, Failure> {
        for name in self.only.iter().chain(&self.skip) {
            if !all_cases().any(|case| case.is_meant_by(name)) {
                return Err(Failure::new(format_args!("no case is called {name:?}"))
                    .help("`lexican conform --list` shows the cases; a chapter such as 301/7.2.4 is a name as well"));
            }
        }
        let meant = |names: &[String], case: &Case| names.iter().any(|name| case.is_meant_by(name));
        let wanted = |case: &&Case| (self.only.is_empty() || meant(&self.only, case)) && !meant(&self.skip, case);
        let chosen: Vec<_> = all_cases().filter(wanted).collect();
        if chosen.is_empty() {
            return Err(Failure::new("no case is left").help("--skip takes away what --only chooses"));
        }
        Ok(chosen)
    }

    /// Leaves out cases of other profiles, unless they are selected by name.
    fn for_device(&self, mut chosen: Vec<&'static Case>, device: &Device) -> Vec<&'static Case> {
        if self.only.is_empty() {
            chosen.retain(|case| case.profile().is_none_or(|profile| device.profile == Some(profile)));
        }
        self.in_order(chosen)
    }

    fn in_order(&self, chosen: Vec<&'static Case>) -> Vec<&'static Case> {
        let mut order: Vec<_> = (0..self.repeat).flat_map(|_| chosen.iter().copied()).collect();
        if let Some(seed) = self.seed {
            shuffle(&mut order, seed);
        }
        order
    }
}

/// Shuffles a list by a seed (Fisher-Yates with SplitMix64).
fn shuffle<T>(list: &mut [T], seed: u64) {
    let mut state = seed;
    for last in (1..list.len()).rev() {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = (state ^ state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        list.swap(last, ((mixed ^ mixed >> 31) % (last as u64 + 1)) as usize);
    }
}

impl Conditions {
    fn settings(&self, node: NodeId, device: &Device) -> Result<Settings, Failure> {
        let stimuli = Stimuli {
            emergency: self.emergency.as_deref().map(|text| write(device, text)).transpose()?,
            input: match &self.input[..] {
                [starts, stops, shown_by] => {
                    let shown_by = resolve(Some(device), shown_by)?;
                    let shown_by = (shown_by.index(), shown_by.sub());
                    Some(InputStimulus { starts: write(device, starts)?, stops: write(device, stops)?, shown_by })
                }
                _ => None,
            },
        };
        let allow = self.allow.iter().flat_map(|allowed| allowed.0.iter().copied()).collect();
        let fail_fast = self.fail_fast.then_some(if self.strict { Level::Should } else { Level::Must });
        let known = self.known.as_deref().map(known).transpose()?.unwrap_or_default();
        Ok(Settings {
            allow,
            boot: self.boot_time,
            bus: self.reconnect,
            bit_rate_kbit: self.bit_rate,
            stimuli,
            fail_fast,
            known,
            travel: self.travel,
            velocity: self.velocity,
            ..Settings::new(node)
        })
    }
}

/// A row in the file of known deviations.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    seen: String,
    why: String,
}

/// Reads a file of known deviations.
fn known(path: &Path) -> Result<BTreeMap<String, Known>, Failure> {
    let text = std::fs::read_to_string(path).map_err(|error| Failure::file("read", path, &error))?;
    let rows: BTreeMap<String, Row> = toml::from_str(&text).map_err(|error| {
        Failure::new(format_args!("{}: {error}", path.display()))
            .help("a row is: \"301/7.2.4.3.17/5\" = { seen = \"* is refused with 0601 0000*\", why = \"the manual, table 19\" }")
    })?;
    let known: BTreeMap<String, Known> =
        rows.into_iter().map(|(id, Row { seen, why })| (id, Known { seen, why })).collect();
    match known.keys().find(|id| !all_cases().any(|case| case.id == **id)) {
        Some(id) => Err(Failure::new(format_args!("{}: no case has the id {id:?}", path.display()))),
        None => Ok(known),
    }
}

/// The cases of all suites.
fn all_cases() -> impl Iterator<Item = &'static Case> {
    cases().chain(profile_cases())
}

/// Parses a write: `2003=10`, `Output=0x1F`.
fn write(device: &Device, text: &str) -> Result<Write, Failure> {
    let wrong = || Failure::new(format_args!("{text:?} is not a write such as 2003=10 or 2004:01=0x1F"));
    let (object, value) = text.split_once('=').ok_or_else(wrong)?;
    let address: Address = resolve(Some(device), object)?;
    let value = match value.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => value.parse().ok(),
    };
    Ok(Write { index: address.index(), sub: address.sub(), value: value.ok_or_else(wrong)? })
}
