//! Readers of other languages, each in a process of its own that reads the paths from standard input.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use super::described::{Address, Reading};
use crate::eds::python::interpreter;

/// A line for each file: `-` when it was refused, else its addresses; at the end the time that reading took, in ns.
const PYTHON: &str = "
import logging, sys, time
from canopen.objectdictionary import ODVariable, import_od
logging.disable(logging.CRITICAL)
spent = 0
for path in sys.stdin.read().splitlines():
    start = time.perf_counter_ns()
    try:
        od = import_od(path, 5)
    except Exception:
        od = None
    spent += time.perf_counter_ns() - start
    if od is None:
        print('-')
        continue
    addresses = []
    for index, item in od.items():
        subs = [0] if isinstance(item, ODVariable) else item.subindices
        addresses += [f'{index:04X}{sub:02X}' for sub in subs]
    print(' '.join(addresses))
print(spent)
";

/// The same for node-canopen, of which only the reader is loaded: the rest wants a module that is to be compiled.
const NODE: &str = "
const { Eds } = require('./node_modules/canopen/source/eds.js');
console.warn = () => {};
const hex = (number, digits) => number.toString(16).padStart(digits, '0');
let spent = 0n;
for (const path of require('fs').readFileSync(0, 'utf8').trim().split('\\n')) {
    const start = process.hrtime.bigint();
    let eds = null;
    try { eds = Eds.fromFile(path); } catch {}
    spent += process.hrtime.bigint() - start;
    if (eds === null) { console.log('-'); continue; }
    const addresses = [];
    for (const [, entry] of eds.entries()) {
        if (!entry.subNumber) { addresses.push(hex(entry.index, 4) + '00'); continue; }
        for (let sub = 0; sub < 256; sub++)
            if (entry.at(sub) !== undefined) addresses.push(hex(entry.index, 4) + hex(sub, 2));
    }
    console.log(addresses.join(' '));
}
console.log(String(spent));
";

/// # Errors
///
/// Why it cannot take part, in words.
pub(super) fn python(files: &[PathBuf]) -> Result<(Vec<Reading>, Duration), String> {
    let python = interpreter()?;
    read(Command::new(python).args(["-c", PYTHON]), files)
}

/// # Errors
///
/// Why it cannot take part, in words: there is no Node.js, or npm gets no package.
pub(super) fn node(files: &[PathBuf]) -> Result<(Vec<Reading>, Duration), String> {
    let folder = package()?;
    read(Command::new("node").args(["-e", NODE]).current_dir(folder), files)
}

/// A folder with the package in it, made when there is none yet, beside what cargo builds.
fn package() -> Result<PathBuf, String> {
    const PACKAGE: &str = "canopen@6.2.1";
    let this = std::env::current_exe().map_err(|error| error.to_string())?;
    let folder = this.ancestors().nth(2).ok_or("the program lies in no target folder")?.join(PACKAGE);
    if !folder.join("node_modules/canopen").exists() {
        std::fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
        let options = ["install", "--silent", "--no-audit", "--no-fund", "--ignore-scripts", "--prefix"];
        run(Command::new("npm").args(options).arg(&folder).arg(PACKAGE))?;
    }
    Ok(folder)
}

fn run(command: &mut Command) -> Result<(), String> {
    let line = format!("{command:?}");
    let output = command.output().map_err(|error| format!("{line}: {error}"))?;
    if output.status.success() { Ok(()) } else { Err(format!("{line}: {}", output.status)) }
}

fn read(command: &mut Command, files: &[PathBuf]) -> Result<(Vec<Reading>, Duration), String> {
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = command.spawn().map_err(|error| format!("{command:?}: {error}"))?;
    let paths = files.iter().map(|path| absolute(path)).collect::<Result<Vec<_>, _>>()?.join("\n");
    let mut input = child.stdin.take().expect("it is piped");
    // It reads all of it before it says anything.
    input.write_all(paths.as_bytes()).map_err(|error| error.to_string())?;
    drop(input);
    let output = child.wait_with_output().map_err(|error| error.to_string())?;
    let text = String::from_utf8_lossy(&output.stdout);
    let mut lines: Vec<&str> = text.lines().collect();
    let time = lines.pop().and_then(|line| line.parse().ok()).map(Duration::from_nanos);
    let time = time.filter(|_| lines.len() == files.len()).ok_or("it has ended before the last file")?;
    Ok((lines.into_iter().map(reading).collect(), time))
}

fn absolute(path: &Path) -> Result<String, String> {
    let path = std::path::absolute(path).map_err(|error| error.to_string())?;
    path.into_os_string().into_string().map_err(|_| "a path is not UTF-8".to_owned())
}

fn reading(line: &str) -> Reading {
    (line != "-").then(|| line.split_ascii_whitespace().filter_map(address).collect::<BTreeSet<_>>())
}

fn address(text: &str) -> Option<Address> {
    let number = u32::from_str_radix(text, 16).ok()?;
    Some((u16::try_from(number >> 8).ok()?, u8::try_from(number & 0xFF).ok()?))
}
