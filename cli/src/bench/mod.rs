//! `lexican bench`: the whole bus at a glance, in a browser or in the terminal.

mod language;
mod opening;
mod sequences;
mod simulation;

use std::io::Write;
use std::net::{AddrParseError, IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use lexican_bench::Bench;
use lexican_bench::engine::{Client, Setup, Simulation};
use lexican_bench::model::BusInfo;
use lexican_bench::request::Request;
use lexican_bench::sheet::Sheet;
use lexican_bench::tui;
use lexican_bench::view::{Kept, TraceFilter};
use lexican_bench::web::Server;
use lexican_machine::{Filter, Machine};
use lexican_runtime::NodeId;
use lexican_runtime::host::Pace;
use lexican_simulation::{Files, Plant};
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::text::duration::in_milliseconds;

use crate::bus::{Bus, BusArgs, KnownArgs, kinds, simulate, url};
use crate::output::{Failure, Outcome, note, on_ctrl_c, reason, stdout, warn};
use crate::run::{Context, Shell};
use language::Language;
use opening::Opening;
use sequences::Sequences;
use simulation::Devices;

/// Show a whole bus in the browser: nodes, objects, PDOs, trace, plots, drives
///
/// Serves a page on this machine, prints its address, and opens it. Several browsers may look at the same bus; one of them has
/// control, and nothing is changed without it. What a page has started is stopped when it is closed or lost. A log is shown as a live
/// bus is, at any of its times. Ctrl-C stops what the bench has started, and ends it.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES, override_usage = USAGE)]
pub(crate) struct Args {
    #[command(flatten)]
    bus: Option<BusArgs>,

    /// Show a simulated plant, to try everything without hardware: drives, an encoder, I/O; one of them is faulty
    #[arg(long, conflicts_with = "bus", required_unless_present = "bus")]
    demo: bool,

    #[command(flatten)]
    known: KnownArgs,

    /// Show it on this terminal, and serve no page
    #[arg(long, conflicts_with_all = ["listen", "host", "no_open"])]
    tui: bool,

    /// The address to serve the page at: 127.0.0.1:8080, 8080, 192.168.0.7; any free port if it names none
    ///
    /// Other machines can reach an address other than 127.0.0.1. The page is not encrypted, so anybody on the way reads along, the
    /// token too, and can move drives with it: better keep it on this machine, and forward a port by SSH or by a reverse proxy with TLS.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1", value_parser = listen)]
    listen: SocketAddr,

    /// A name by which browsers ask for the page, besides IP addresses and localhost; may be given several times
    ///
    /// As behind a reverse proxy. A page by another name is refused, since names of others may come to mean this machine.
    #[arg(long, value_name = "HOST")]
    host: Vec<String>,

    /// Print the address only, and open no browser
    #[arg(long)]
    no_open: bool,

    /// The language of the page or the terminal; without it that of the browser, or of LANG
    #[arg(long, value_name = "LANGUAGE")]
    lang: Option<Language>,
}

const USAGE: &str = "lexican bench --demo              (a simulated plant)
       lexican bench --bus <URL> [OPTIONS]";

const EXAMPLES: &str = "\
Examples:
    lexican bench --demo
    lexican bench --bus can0 --device 5=siko/ag03-1 --device 7=FILE.eds
    lexican bench --bus log:bus.log --no-open
    lexican bench --bus can0 --tui
    lexican bench --bus can0 --listen 8080 --no-open     (here: ssh -L 8080:127.0.0.1:8080 MACHINE)";

/// `ADDRESS`, `PORT` or `ADDRESS:PORT`.
fn listen(text: &str) -> Result<SocketAddr, String> {
    let port = || text.parse().map(|port: u16| SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    let address = || text.parse().map(|address: IpAddr| SocketAddr::from((address, 0)));
    let wrong = |_: AddrParseError| "write an IP address, a port or both, as 127.0.0.1:8080".to_owned();
    port().or_else(|_| address()).or_else(|_| text.parse()).map_err(wrong)
}

pub(crate) fn run(args: &Args, shell: Shell) -> Result<Outcome, Failure> {
    if args.tui {
        let bench = args.open(shell)?;
        let _shown = args.show_at_first(&bench);
        return on_terminal(&bench, args.lang.unwrap_or_else(Language::of_this_user));
    }
    let (bench, server) = (args.open(shell)?, args.bind()?);
    let _shown = args.show_at_first(&bench);
    let ending = Ending::new(&bench);
    let end = server.end();
    ending.on_ctrl_c(move |bench| {
        // End the drives first, so that the page can still show how they stop.
        bench.end();
        end.end();
    })?;
    let _opening = print_address(&server, args)?;
    server
        .run(bench.clone())
        .map_err(|error| Failure::new(format_args!("the page cannot be served: {}", reason(&error))))?;
    outcome(&bench.end())
}

/// The end of the bench. A second Ctrl-C does not wait for it.
#[derive(Clone)]
struct Ending {
    bench: Bench,
    has_begun: Arc<AtomicBool>,
}

impl Ending {
    fn new(bench: &Bench) -> Self {
        Ending { bench: bench.clone(), has_begun: Arc::default() }
    }

    /// Whether this call begins the end.
    fn begins(&self) -> bool {
        !self.has_begun.swap(true, Ordering::Relaxed)
    }

    /// At Ctrl-C, ends the bench by `end` in a separate thread. A second Ctrl-C meanwhile ends the program.
    fn on_ctrl_c(&self, end: impl FnOnce(&Bench) + Send + 'static) -> Result<(), Failure> {
        let (ending, mut end) = (self.clone(), Some(end));
        on_ctrl_c(move || {
            let (bench, end) = (ending.bench.clone(), end.take());
            let begun = match end.filter(|_| ending.begins()) {
                Some(end) => std::thread::Builder::new().name("end".to_owned()).spawn(move || end(&bench)).is_ok(),
                None => false,
            };
            if !begun {
                tui::give_terminal_back();
                let unconfirmed = ending.bench.unconfirmed();
                if !unconfirmed.is_empty() {
                    warn(may_be_moving(&unconfirmed));
                }
                std::process::exit(INTERRUPTED);
            }
        })
    }
}

/// The exit code after Ctrl-C, as in shells: 128 + SIGINT.
const INTERRUPTED: i32 = 130;

/// The outcome, given the drives that have not confirmed a standstill.
fn outcome(unconfirmed: &[String]) -> Result<Outcome, Failure> {
    if unconfirmed.is_empty() {
        return Ok(Outcome::Clean);
    }
    Err(Failure::new(may_be_moving(unconfirmed)).help("stop it by its emergency stop or its supply"))
}

fn may_be_moving(unconfirmed: &[String]) -> String {
    format!("NOT CONFIRMED THAT IT STANDS: {}", unconfirmed.join("; "))
}

/// Shows a bench on the terminal until the user leaves; then stops what it has started.
fn on_terminal(bench: &Bench, language: Language) -> Result<Outcome, Failure> {
    let unusable =
        |error: std::io::Error| Failure::new(format_args!("the terminal cannot be used: {}", reason(&error)));
    let ending = Ending::new(bench);
    ending.on_ctrl_c(|bench| {
        // A thread that reads keys of a closed terminal never returns, so stop the drives here.
        let unconfirmed = bench.end();
        tui::give_terminal_back();
        if unconfirmed.is_empty() {
            std::process::exit(0);
        }
        warn(may_be_moving(&unconfirmed));
        std::process::exit(2);
    })?;
    let mut terminal = tui::take_terminal().map_err(unusable)?;
    let shown = tui::run(bench, &mut terminal, language.into());
    tui::give_terminal_back();
    // From now on, Ctrl-C is the second one: the user has already left.
    ending.begins();
    let unconfirmed = bench.end();
    if shown.is_err() {
        // Dropping it would write to the closed terminal, and panic.
        std::mem::forget(terminal);
    }
    shown.map_err(unusable)?;
    outcome(&unconfirmed)
}

/// What the bench keeps of a machine.
fn kept(machine: &Machine) -> Kept {
    let filter = |(name, of): (&String, &Filter)| {
        let Filter { nodes, services, without, object, ids, text, alarming, transfers } = of.clone();
        (name.clone(), TraceFilter { nodes, services, without, object, ids, text, alarming, transfers })
    };
    Kept {
        sequences: machine.sequences.iter().map(|path| path.display().to_string()).collect(),
        messages: machine.messages.keys().cloned().collect(),
        filters: machine.filters.iter().map(filter).collect(),
        recorded: None,
    }
}

impl Args {
    /// Opens the bus.
    fn open(&self, shell: Shell) -> Result<Bench, Failure> {
        let (name, bit_rate) = match &self.bus {
            Some(bus) => (bus.url().to_string(), kinds::bit_rate(bus.url())),
            None => ("demo".to_owned(), None),
        };
        let recorded = self.bus.as_ref().and_then(BusArgs::recorded).transpose()?;
        let (link, nodes, simulation) = match (&self.bus, &recorded) {
            (_, Some(_)) => (None, Vec::new(), None),
            (bus, None) => {
                let Bus { link, nodes, simulation } = bus.as_ref().map_or_else(demo, |bus| bus.open(Pace::RealTime))?;
                (Some(link), nodes, simulation)
            }
        };
        // The bit rate of a simulation is known.
        let bit_rate = bit_rate.or(simulation.as_ref().map(|simulation| simulation.bit_rate));
        let simulation = simulation.map(Devices);
        let simulated = |node| simulation.as_ref().and_then(|devices| devices.name(node));
        let named = |node| simulated(node).or_else(|| self.known.name(node));
        let shown = |(node, sheet): (NodeId, DataSheet)| {
            let name = sheet.input.eds.name().to_owned();
            (node, named(node), Some(Sheet::new(&name, sheet)))
        };
        // The demo has no URL by which it could be opened, so this is only a name.
        let of_demo = || url("sim:demo").expect("it is one");
        let bus = BusArgs::named(self.bus.as_ref().map_or_else(of_demo, |bus| bus.url().clone()));
        let context = Context { shell, bus, as_json: false, machine: self.known.machine() };
        let kept = context.machine.as_deref().map(kept).unwrap_or_default();
        let player = Sequences { context: Arc::new(context), nodes: nodes.clone() };
        let nodes = self.known.load(nodes)?.into_iter().map(shown).collect();
        let simulation = simulation.map(|devices| Box::new(devices) as Box<dyn Simulation>);
        let bus = BusInfo { name, is_writable: recorded.is_none(), bit_rate };
        let setup = Setup { bus, nodes, simulation, kept, player: Some(Box::new(player)) };
        let begun = match (link, recorded) {
            (Some(link), _) => Bench::live(link, setup),
            (None, frames) => Bench::replay(frames.unwrap_or_default(), setup),
        };
        begun.map_err(|error| Failure::new(format_args!("the bench cannot begin: {}", reason(&error))))
    }

    /// Watches and plots what the machine's file says, for as long as the returned client lives.
    fn show_at_first(&self, bench: &Bench) -> Option<Client> {
        let machine = self.known.machine().filter(|machine| !machine.bench.is_empty())?;
        let client = bench.open_client();
        for shown in &machine.bench {
            let (node, signal, every) = (shown.node.get(), shown.signal.to_string(), in_milliseconds(shown.every));
            let every_ms = u32::try_from(every).unwrap_or(u32::MAX);
            let request = match shown.as_curve {
                true => Request::Plot { node, signals: vec![signal], every_ms },
                false => Request::Watch { node, address: signal, every_ms },
            };
            if let Err(refused) = client.ask(request).wait() {
                warn(format_args!("node {node}: {}", refused.why));
            }
        }
        Some(client)
    }

    fn bind(&self) -> Result<Server, Failure> {
        Server::bind(self.listen, self.host.clone()).map_err(|error| {
            Failure::new(format_args!("cannot serve the page at {}: {}", self.listen, reason(&error)))
                .help("leave out the port of --listen for any that is free")
        })
    }
}

/// The machine of the demo, and its files.
const MACHINE: &str = include_str!("../../machines/line.toml");
const FILES: Files<'_> = Files::Embedded(&[
    ("io.eds", include_str!("../../machines/io.eds")),
    ("encoder.eds", include_str!("../../machines/encoder.eds")),
]);

fn demo() -> Result<Bus, Failure> {
    simulate(Plant::parse(MACHINE, "line.toml", FILES)?, Pace::RealTime)
}

/// Prints the address of the page and its risk, and opens the page. The file that opens it lives as long as the
/// returned value.
fn print_address(server: &Server, args: &Args) -> Result<Option<Opening>, Failure> {
    let address = server.address();
    let language = args.lang.map(|language| format!("&lang={}", language.tag())).unwrap_or_default();
    let url = server.url() + &language;
    let mut out = stdout();
    writeln!(out, "{url}")?;
    out.flush()?;
    if let Some((risk, better)) = risk(address) {
        warn(risk);
        note(better);
    }
    note("Ctrl-C stops what the bench has started, and ends it");
    if args.no_open || !has_screen() {
        return Ok(None);
    }
    let opening = Opening::of(&url).ok();
    // A sandboxed browser may not be able to read the file.
    note(if opening.is_some() {
        "if the browser shows no page, open the address above"
    } else {
        "no browser could be opened: open the address above"
    });
    Ok(opening)
}

/// The risk of an address that other machines can reach, and a better way.
fn risk(address: SocketAddr) -> Option<(String, String)> {
    let port = address.port();
    let risk = format!(
        "who is on the way to {address} reads along, the token too, and can move drives: the page is not encrypted"
    );
    let better = format!("better: --listen {port}, and where the browser is: ssh -L {port}:127.0.0.1:{port} MACHINE");
    (!address.ip().is_loopback()).then_some((risk, better))
}

/// Whether a browser can open a window. Without a screen, a text browser might take over the terminal.
fn has_screen() -> bool {
    let has = |variable| std::env::var_os(variable).is_some_and(|value| !value.is_empty());
    cfg!(any(windows, target_os = "macos")) || ["DISPLAY", "WAYLAND_DISPLAY", "WSL_DISTRO_NAME"].into_iter().any(has)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_may_leave_out_its_port_or_its_host() {
        let at = |text| listen(text).map(|address| address.to_string());
        assert_eq!(at("8080").as_deref(), Ok("127.0.0.1:8080"));
        assert_eq!(at("192.168.0.7").as_deref(), Ok("192.168.0.7:0"));
        assert_eq!(at("[::1]:8080").as_deref(), Ok("[::1]:8080"));
        for wrong in ["localhost", "70000", "", "127.0.0.1:"] {
            assert!(at(wrong).unwrap_err().contains("127.0.0.1:8080"), "{wrong}");
        }
    }

    #[test]
    fn what_other_machines_can_reach_is_warned_of() {
        for safe in ["127.0.0.1:8080", "127.9.9.9:1", "[::1]:8080"] {
            assert_eq!(risk(safe.parse().unwrap()), None, "{safe}");
        }
        for open in ["0.0.0.0:8080", "[::]:8080", "192.168.0.7:8080"] {
            let (risk, better) = risk(open.parse().unwrap()).unwrap();
            assert!(risk.contains("not encrypted") && better.contains("ssh -L 8080:127.0.0.1:8080"), "{open}");
        }
    }
}
