//! `lexican bench --demo` in a headless browser, used as people do: find the faulty node, write a limit, map a PDO,
//! plot and stop a motion, restore parameters; two browsers, a lost page, and who is refused.
//!
//! With LEXICAN_PICTURES=FOLDER it saves pictures there: `cargo xtask bench-pictures`.
#![cfg(unix)]

use std::path::Path;

use crate::bench::Bench;
use crate::browser::{Browser, Page};
use crate::common::{self, folder, lexican_in};
use crate::recording::record;
use serde_json::{Value as Json, json};

/// The data sheet of a device that is not in the library.
const SENSOR: &str = include_str!("../sensor.eds");
/// The objects of a device that stores its data sheet.
const STORED: &str = "[1021]\nParameterName=Store EDS\nObjectType=0x2\nDataType=0x000F\nAccessType=ro\n\
    [1022]\nParameterName=Store format\nObjectType=0x7\nDataType=0x0005\nAccessType=ro\nDefaultValue=0\n";

/// Stores a picture if LEXICAN_PICTURES is set.
fn picture(page: &Page, name: &str) {
    if let Some(folder) = std::env::var_os("LEXICAN_PICTURES") {
        std::fs::write(Path::new(&folder).join(name), page.picture()).unwrap();
    }
}

/// Checks that the console is empty, that nothing was loaded from elsewhere, and that every control has an accessible
/// name.
#[track_caller]
fn is_in_order(page: &Page, bench: &Bench) {
    assert_eq!(page.said(), [""; 0]);
    assert_eq!(page.nameless(), [""; 0]);
    let place = bench.origin().strip_prefix("http").unwrap();
    let elsewhere = |url: &String| !["http", "ws"].iter().any(|scheme| url.starts_with(&format!("{scheme}{place}/")));
    assert_eq!(page.requests().into_iter().filter(elsewhere).collect::<Vec<_>>(), [""; 0]);
}

fn start(test: &str, args: &[&str]) -> Option<(Bench, Browser)> {
    start_in(&folder(test), args)
}

fn start_in(folder: &Path, args: &[&str]) -> Option<(Bench, Browser)> {
    let Some(browser) = Browser::start(folder) else {
        eprintln!("skipped: no Chromium to open the bench with: apt-get install chromium-headless-shell");
        return None;
    };
    Some((Bench::begin(folder, args), browser))
}

/// Opens the bench as a separate user.
fn opens(browser: &Browser, bench: &Bench) -> Page {
    let page = browser.window();
    page.opens(&bench.url);
    page.reads("connection", "connected");
    page
}

#[track_caller]
fn takes_control(page: &Page) {
    page.clicks("take-control");
    page.until("document.querySelector('[data-test=release-control]')");
}

/// Chooses a node and an entry of its dictionary.
#[track_caller]
fn chooses_entry(page: &Page, node: &str, address: &str) {
    page.clicks("tab-objects");
    page.chooses("pick-node", node);
    page.types("object-search", address);
    page.clicks(&format!("object-{address}"));
    page.reads("entry", address);
}

/// Writes an entry, and the node accepts it.
#[track_caller]
fn writes(page: &Page, node: &str, address: &str, value: &str, read: &str) {
    chooses_entry(page, node, address);
    page.types("object-value", value);
    page.clicks("object-write");
    page.part("object-written");
    page.reads("object-present", read);
}

#[test]
fn the_faulty_node_is_found_and_says_why() {
    let Some((bench, browser)) = start("bench-fault", &["--demo"]) else { return };
    let page = opens(&browser, &bench);
    assert_eq!(page.value("location.search"), "", "the token is taken out of the address bar");
    for (node, name) in [(5, "feeder"), (6, "cutter"), (7, "io"), (8, "encoder")] {
        page.reads(&format!("node-{node}"), name);
    }
    // The feeder's shaft is blocked half a second after it has set off.
    takes_control(&page);
    page.clicks("tab-drives");
    page.clicks("drive-5-enable");
    page.reads("drive-5-state", "OPERATION ENABLED");
    page.types("drive-5-value", "100000 increments");
    page.clicks("drive-5-move-to");
    page.clicks("tab-nodes");
    let fault = page.part("node-5-fault");
    assert!(fault.contains("shaft"), "{fault}");
    page.clicks("node-5");
    page.reads("faults", "shaft");
    picture(&page, "nodes.png");
    // From the fault to the frames before it.
    page.clicks("fault-row");
    page.reads("trace", "EMCY");
    is_in_order(&page, &bench);
    assert_eq!(bench.interrupt(), Some(0));
    page.reads("lost", "The bench has ended");
}

#[test]
fn a_value_is_refused_in_words_then_accepted_and_restored() {
    let Some((bench, browser)) = start("bench-values", &["--demo"]) else { return };
    let page = opens(&browser, &bench);
    chooses_entry(&page, "6", "6081:00");
    let hint = page.part("entry");
    assert!(hint.contains("Press “Take control” first"), "{hint}");
    takes_control(&page);

    // The data sheet's limit of the feeder's gain.
    chooses_entry(&page, "5", "2410:01");
    page.types("object-value", "60000");
    page.clicks("object-write");
    let refusal = page.part("object-refusal");
    assert!(refusal.contains("2410:01") && refusal.contains("500"), "{refusal}");
    picture(&page, "objects.png");
    writes(&page, "5", "2410:01", "120", "120");

    // The encoder's parameters are saved in a file, changed, and restored.
    let kept = folder("bench-files");
    page.keeps_files_in(&kept);
    page.chooses("pick-node", "5");
    page.clicks("backup");
    page.reads("jobs", "backup of node 5");
    let file = loop {
        // The browser gives the file this name when it is complete.
        match common::files(&kept).into_iter().find(|name| name.ends_with(".dcf")) {
            Some(name) => break kept.join(name),
            None => page.until("true"),
        }
    };
    writes(&page, "5", "2410:01", "250", "250");
    page.gives("dcf", &file);
    page.clicks("compare-dcf");
    page.reads("differences", "2410:01");
    page.clicks("restore");
    page.reads("jobs", "restore of node 5");
    page.clicks("object-read");
    page.reads("object-present", "120");
    is_in_order(&page, &bench);
}

/// Adds an object to the mapping in the editor.
#[track_caller]
fn adds(page: &Page, address: &str) {
    page.types("pdo-search", address);
    page.clicks(&format!("mappable-{address}"));
    page.clicks("pdo-add");
}

#[test]
fn a_pdo_is_mapped_and_its_conflicts_are_named_before() {
    let Some((bench, browser)) = start("bench-pdos", &["--demo"]) else { return };
    let page = opens(&browser, &bench);
    takes_control(&page);
    page.clicks("tab-pdos");
    // The mapping of the feeder's PDOs cannot be changed.
    page.chooses("pick-node", "5");
    page.clicks("pdo-TPDO2-edit");
    adds(&page, "6064:00");
    page.reads("pdo-objections", "is fixed");

    page.chooses("pick-node", "6");
    page.clicks("pdo-TPDO2-edit");
    // 16, 8, 32 and 32 bits.
    adds(&page, "6064:00");
    page.reads("pdo-objections", "Nothing speaks against it");
    adds(&page, "606C:00");
    page.until("document.querySelector('[data-test=pdo-objections] .conflict')");
    picture(&page, "pdos.png");
    page.clicks("pdo-revert");
    adds(&page, "6064:00");
    page.clicks("pdo-apply");
    page.until("!document.querySelector('[data-test=map-editor]')");
    page.reads("pdo-TPDO2", "Position actual value");
    is_in_order(&page, &bench);
}

#[test]
fn a_travel_is_plotted_and_stopped() {
    let Some((bench, browser)) = start("bench-travel", &["--demo"]) else { return };
    let page = opens(&browser, &bench);
    takes_control(&page);
    page.clicks("tab-plots");
    page.chooses("plot-node", "6");
    page.clicks("plot-quick-6064:00");
    page.part("curve-6-6064:00");
    page.clicks("plot-quick-606C:00");
    page.part("curve-6-606C:00");
    page.clicks("tab-drives");
    page.clicks("drive-6-enable");
    page.reads("drive-6-state", "OPERATION ENABLED");
    page.types("drive-6-value", "15000");
    page.clicks("drive-6-move-to");
    page.until(
        "parseFloat(document.querySelector('[data-test=drive-6-position]').innerText.replaceAll(',', '')) > 2000",
    );
    picture(&page, "drives.png");
    // By the key, whatever has the focus.
    page.presses("Escape");
    page.until("document.querySelector('[data-test=stop-answer].answered')");
    page.part("drive-6-ending");
    // It stands: its position is the same a second later.
    let position = "document.querySelector('[data-test=drive-6-position]').innerText";
    page.until(&format!("{position} === await new Promise(done => setTimeout(() => done({position}), 1000))"));
    page.clicks("tab-plots");
    page.until("document.querySelector('[data-test=chart] canvas')");
    picture(&page, "plots.png");
    is_in_order(&page, &bench);
}

#[test]
fn two_browsers_see_the_same_and_a_lost_page_stops_what_it_started() {
    let Some((bench, browser)) = start("bench-two", &["--demo"]) else { return };
    let (one, other) = (opens(&browser, &bench), opens(&browser, &bench));
    one.reads("clients", "2");
    takes_control(&one);
    other.until("document.querySelector('.control').innerText.includes('1')");
    other.clicks("tab-drives");
    other.until("document.querySelector('[data-test=drive-6-enable]').ariaDisabled === 'true'");
    one.clicks("tab-drives");
    one.clicks("drive-6-enable");
    one.types("drive-6-value", "100");
    one.clicks("drive-6-run");
    let runs = "parseFloat(document.querySelector('[data-test=drive-6-velocity]').innerText) > 0";
    one.until(runs);
    other.until(runs);
    // A reloaded page is a new client, because its content is gone; the browser's tab still has the token.
    one.closes();
    other.reads("clients", "only this page");
    other.until(&format!("!({runs})"));
    other.until("document.querySelector('.control').innerText.includes('Take control')");
    other.reloads();
    other.reads("connection", "connected");

    // A page that hangs is treated as lost, though its browser runs.
    let hanging = opens(&browser, &bench);
    takes_control(&hanging);
    hanging.hangs();
    other.reads("clients", "2");
    other.reads("clients", "only this page");
    takes_control(&other);
    is_in_order(&other, &bench);
}

#[test]
fn who_has_no_token_or_comes_from_elsewhere_is_not_let_in() {
    let Some((bench, browser)) = start("bench-403", &["--demo"]) else { return };
    let token = bench.token();
    let page = browser.window();
    // Opened by hand, without the token: the page says what to do.
    page.opens(bench.origin());
    page.reads("lost", "Open the address that");
    page.opens(&format!("{}/?token=0{token}", bench.origin()));
    assert!(page.text().contains("open the address that lexican bench printed"), "{}", page.text());
    // A page of another site that knows the token.
    let socket = format!("{}/ws", bench.origin().replace("http", "ws"));
    let attempt = format!(
        "new Promise(done => {{ const socket = new WebSocket({}, ['lexican-bench', {}]);
        socket.onopen = () => done('open'); socket.onerror = () => done('refused'); }})",
        json!(socket),
        json!(token)
    );
    let foreign = browser.window();
    foreign.opens("data:text/html,<title>elsewhere</title>");
    assert_eq!(foreign.value(&attempt), "refused");
    let own = opens(&browser, &bench);
    assert_eq!(own.value(&attempt), "open");
}

#[test]
fn the_page_is_read_in_the_dark_and_in_german() {
    let Some((bench, browser)) = start("bench-dark", &["--demo", "--lang", "de"]) else { return };
    let page = browser.window();
    page.opens(&bench.url);
    page.reads("connection", "verbunden");
    assert_eq!(page.value("location.search"), "");
    let background = "getComputedStyle(document.body).backgroundColor";
    let light = page.value(background);
    page.prefers("prefers-color-scheme", "dark");
    assert_ne!(page.value(background), light);
    page.reads("tab-drives", "Antriebe");
    page.until("document.documentElement.lang === 'de'");
    // From now on, the language chosen by hand counts.
    page.clicks("language");
    page.reads("tab-drives", "Drives");
    page.reloads();
    page.reads("tab-drives", "Drives");
    page.clicks("language");
    page.reads("tab-drives", "Antriebe");
    for tab in ["nodes", "objects", "pdos", "trace", "plots", "drives", "bus", "devices"] {
        page.clicks(&format!("tab-{tab}"));
        is_in_order(&page, &bench);
    }
    page.clicks("tab-bus");
    page.reads("bus", "500 kbit/s");
    picture(&page, "bus-dark.png");
}

#[test]
fn a_device_gets_its_node_id_and_its_data_sheet() {
    let folder = folder("bench-lss");
    std::fs::write(folder.join("sensor.eds"), SENSOR).unwrap();
    std::fs::write(folder.join("stores.eds"), format!("{STORED}{SENSOR}")).unwrap();
    std::fs::write(folder.join("machine.toml"), "[node.a]\nid = 'none'\nsheet = 'stores.eds'\n").unwrap();
    let Some((bench, browser)) = start_in(&folder, &["--bus", "sim:machine.toml"]) else { return };
    let page = opens(&browser, &bench);
    takes_control(&page);
    page.types("lss-node", "9");
    page.clicks("lss-assign");
    page.reads("jobs", "is node 9");
    page.clicks("node-9");
    page.reads("node-details", "0x0000002A");
    // Only that node is left on the bus.
    page.types("lss-node", "10");
    page.clicks("lss-assign");
    page.reads("jobs", "no device without node-ID answers");

    page.clicks("sheet-fetch");
    page.reads("node-9", "1021h of node 9");
    page.types("sheet", "no-such.eds");
    page.clicks("sheet-set");
    page.reads("sheet-refusal", "no-such.eds");
    page.types("sheet", "sensor.eds");
    page.clicks("sheet-set");
    page.reads("node-9", "sensor.eds");
    chooses_entry(&page, "9", "2000:00");
    page.clicks("object-read");
    page.part("object-present");
    is_in_order(&page, &bench);
}

/// The output of `lexican monitor` for the log, in the same order.
fn said(folder: &Path, args: &[&str]) -> Vec<(f64, [String; 4])> {
    let run = lexican_in(folder, &[&["monitor", "--bus", "log:bus.log", "--json"], args].concat());
    let lines = run.stdout.lines().map(|line| serde_json::from_str::<Json>(line).unwrap());
    let line = |line: Json| {
        let text = |key: &str| line[key].as_str().unwrap_or_default().to_owned();
        let node = line["node"].as_u64().map(|node| format!("{node} ")).unwrap_or_default();
        (line["time"].as_f64().unwrap(), [text("id"), text("service"), text("data"), node + &text("text")])
    };
    lines.filter(|line| line.get("event").is_none()).map(line).collect()
}

/// Waits until the page shows exactly these rows: it asks again until the bench has filtered all frames.
#[track_caller]
fn shows(page: &Page, said: &[(f64, [String; 4])]) {
    assert!((1..30).contains(&said.len()), "all of them are in sight at once: {}", said.len());
    let rows: Vec<_> = said.iter().map(|(_, row)| row).collect();
    // Without number and time, which only the bench has.
    let shown = "[...document.querySelectorAll('[data-test^=row-]')].map(row => [...row.children].slice(2).map(cell => cell.textContent))";
    page.until(&format!("JSON.stringify({shown}) === {}", json!(json!(rows).to_string())));
}

#[test]
fn a_log_is_played_and_its_rows_are_those_of_the_monitor() {
    let folder = folder("bench-page-log");
    record(&folder.join("bus.log"));
    std::fs::write(folder.join("sensor.eds"), SENSOR).unwrap();
    let Some((bench, browser)) = start_in(&folder, &["--bus", "log:bus.log"]) else { return };
    let page = opens(&browser, &bench);
    page.clicks("tab-trace");
    let all = said(&folder, &[]).len();
    page.reads("trace-extent", &all.to_string());
    // Frame by frame, as the monitor shows them without --transfers.
    page.clicks("filter-transfers");
    page.types("filter-nodes", "5");
    page.clicks("filter-sdo");
    let of_sdo = ["--node", "5", "--service", "sdo"];
    shows(&page, &said(&folder, &of_sdo));
    page.clicks("filter-sdo");
    page.clicks("filter-heartbeat");
    let of_heartbeat = ["--node", "5", "--service", "heartbeat"];
    let heartbeats = said(&folder, &of_heartbeat);
    shows(&page, &heartbeats);

    // The middle of the slider is the middle of the log.
    let began = said(&folder, &[])[0].0;
    page.clicks("log-position");
    let slider = "document.querySelector('[data-test=log-position]')";
    page.until(&format!("Math.abs({slider}.value / {slider}.max - 0.5) < 0.1"));
    let position: f64 = page.value(&format!("Number({slider}.value)")).as_f64().unwrap();
    let heard: Vec<_> = heartbeats.iter().filter(|(time, _)| time - began <= position).cloned().collect();
    assert!(!heard.is_empty() && heard.len() < heartbeats.len(), "{} at {position}", heard.len());
    shows(&page, &heard);
    // Plays from there to the end, and stops.
    page.clicks("log-play");
    page.until(&format!("{slider}.value === {slider}.max"));
    page.reads("log-play", "Play");
    shows(&page, &heartbeats);

    // A log refuses requests that change a bus, but accepts another data sheet, by which its frames are decoded anew.
    page.clicks("filter-heartbeat");
    page.clicks("filter-sdo");
    page.clicks("tab-nodes");
    page.clicks("node-5");
    page.types("sheet", "sensor.eds");
    page.clicks("sheet-set");
    page.reads("node-5", "sensor.eds");
    page.clicks("tab-trace");
    let by_sensor = said(&folder, &[&of_sdo[..], &["--device", "5=sensor.eds"]].concat());
    assert_ne!(by_sensor, said(&folder, &of_sdo));
    shows(&page, &by_sensor);
    is_in_order(&page, &bench);
}

/// When a tab is left, events of scrolling and resizing may still come until the next frame.
#[test]
fn tabs_that_are_left_while_they_are_scrolled_and_resized_raise_no_error() {
    let Some((bench, browser)) = start("bench-tabs", &["--demo"]) else { return };
    let page = opens(&browser, &bench);
    page.reads("node-5", "feeder");
    let left = page.value(
        "(async () => {
        const frames = async (count) => { while (count-- > 0) await new Promise(next => requestAnimationFrame(next)) };
        const open = (tab) => document.querySelector(`[data-test=tab-${tab}]`).click();
        const tabs = ['nodes', 'objects', 'pdos', 'trace', 'plots', 'drives', 'bus', 'devices'];
        const errors = [];
        window.addEventListener('error', (event) => errors.push(event.message));
        let left = 0;
        for (const from of tabs) for (const to of tabs) for (const pause of [0, 1]) {
            if (from === to) continue;
            open(from);
            await frames(6);
            for (const it of document.querySelectorAll('.frames-window, .rows, .chart, .scroll')) {
                it.dispatchEvent(new WheelEvent('wheel', { deltaY: 50, bubbles: true, cancelable: true }));
                it.style.height = '150px';
                it.scrollTop += 40;
            }
            await frames(pause);
            open(to);
            left++;
        }
        await frames(10);
        return errors.length === 0 ? left : errors.join('; ');
        })()",
    );
    assert_eq!(left, 8 * 7 * 2);
    is_in_order(&page, &bench);
}
