//! What a device takes on a Cortex-M4: the size of `tests/size` with all services, and with one more or less of them;
//! and the instructions for each frame, counted in QEMU.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use object::{Object as _, ObjectSection as _, ObjectSymbol as _, SectionKind, SymbolKind};

use crate::qemu::{self, Board};
use crate::{command, outside, workspace};

const TARGET: &str = "thumbv7em-none-eabihf";

/// The file with the figures.
const FIGURES: &str = "tests/size/README.md";
/// The text above this heading is written by hand.
const HEADING: &str = "## Figures\n";

/// The relative change of a size that is no error, because compilers differ.
const TOLERANCE: f64 = 0.01;

/// The number of functions that are listed.
const LARGEST: usize = 12;

/// A device to measure: its name, the profile, and the features of `tests/size`.
struct Variant {
    name: &'static str,
    profile: &'static str,
    features: &'static str,
    /// Whether it has a service more than the first variant, not less. The table says what one service costs either
    /// way.
    adds: bool,
}

const fn variant(name: &'static str, profile: &'static str, features: &'static str) -> Variant {
    Variant { name, profile, features, adds: false }
}

const VARIANTS: [Variant; 12] = [
    variant("everything", "release", ""),
    variant("everything, opt-level s", "speed", ""),
    variant("without SDO block transfer", "release", "no-blocks"),
    variant("without guarding", "release", "no-guarding"),
    variant("without TIME", "release", "no-time"),
    variant("without heartbeat consumers", "release", "no-heartbeat-consumers"),
    variant("as CANopenNode: without guarding and TIME", "release", "no-guarding,no-time"),
    variant("the same, small memory functions", "release", "no-guarding,no-time,small-memory"),
    variant("the same, opt-level s", "speed", "no-guarding,no-time,small-memory"),
    Variant { adds: true, ..variant("with a behaviour chosen at run time", "release", "chosen-behaviour") },
    Variant { adds: true, ..variant("with a second SDO server", "release", "extra-servers") },
    Variant { adds: true, ..variant("with LSS", "release", "lss") },
];

/// What a device takes, in bytes.
struct Size {
    code: u64,
    constants: u64,
    /// RAM of the device, and of its dictionary.
    ram: [u64; 2],
    /// The largest functions, in descending order.
    functions: Vec<(String, u64)>,
}

impl Size {
    fn flash(&self) -> u64 {
        self.code + self.constants
    }
}

/// Measures, and writes the figures; with `check` only compares them.
pub(crate) fn run(root: &Path, check: bool) -> Result<(), String> {
    if !workspace::has_target(TARGET) {
        println!("skipped: the size of a device: rustup target add {TARGET}");
        return Ok(());
    }
    let lock = |folder: &str| root.join(folder).join("Cargo.lock");
    fs::copy(lock(""), lock("tests/size")).map_err(|error| format!("Cargo.lock: {error}"))?;
    let mut sizes = Vec::new();
    for variant in &VARIANTS {
        let features = ["--profile", variant.profile, "--features", variant.features];
        build(root, "tests/size", &features)?;
        sizes.push(measure(&built(root, variant.profile, "device-size"))?);
    }
    let mut figures = table(&sizes);
    match qemu::is_installed() {
        Ok(()) => figures += &instructions(root)?,
        Err(reason) if check => println!("skipped: instructions of a frame: {reason}"),
        Err(reason) => return Err(reason),
    }
    println!("{figures}");
    let path = root.join(FIGURES);
    let text = fs::read_to_string(&path).map_err(|error| format!("{FIGURES}: {error}"))?;
    let (prose, written) = text.split_once(HEADING).ok_or_else(|| format!("{FIGURES} has no {HEADING:?}"))?;
    if check {
        return compare(written, &figures);
    }
    outside::write(&path, &format!("{prose}{HEADING}{figures}"))
}

/// Builds the program in a folder for the microcontroller.
fn build(root: &Path, folder: &str, arguments: &[&str]) -> Result<(), String> {
    let mut cargo = command::cargo();
    cargo.args(["build", "--quiet", "--target", TARGET]).args(arguments).current_dir(root.join(folder));
    command::output(cargo.env("CARGO_TARGET_DIR", target_folder(root))).map(|_| ())
}

fn target_folder(root: &Path) -> PathBuf {
    workspace::target_folder(root).join("device-size")
}

fn built(root: &Path, profile: &str, program: &str) -> PathBuf {
    target_folder(root).join(TARGET).join(profile).join(program)
}

/// The table of instructions; the program prints its rows.
fn instructions(root: &Path) -> Result<String, String> {
    build(root, "tests/size/instructions", &["--release", "--locked"])?;
    let elf = built(root, "release", "device-instructions");
    // At one nanosecond per instruction.
    let board = Board { elf: &elf, folder: &target_folder(root).join("board"), icount: Some(0), seconds: 60 };
    Ok(format!("\n| what a device does for | instructions |\n| --- | --: |\n{}", board.run()?))
}

/// The sizes in an ELF file.
fn measure(path: &Path) -> Result<Size, String> {
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let bytes = fs::read(path).map_err(|error| failed(&error))?;
    let elf = object::File::parse(&*bytes).map_err(|error| failed(&error))?;
    // Sections for unwinding do not count: a program that aborts does not need them.
    let sum = |kinds: &[SectionKind]| -> u64 {
        let is_counted = |name: &str| name != ".measured" && !name.starts_with(".ARM.ex");
        let sections = elf.sections().filter(|section| kinds.contains(&section.kind()));
        sections.filter(|section| section.name().is_ok_and(is_counted)).map(|section| section.size()).sum()
    };
    if sum(&[SectionKind::Data, SectionKind::UninitializedData]) > 0 {
        return Err(failed(&"the runtime has statics with state"));
    }
    let ram = |name| elf.symbols().find(|symbol| symbol.name() == Ok(name)).map(|symbol| symbol.size());
    let ram = ["RAM_OF_DEVICE", "RAM_OF_DICTIONARY"].map(ram);
    let mut functions = BTreeMap::new();
    for symbol in elf.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0) {
        // A function with several names counts once.
        functions.insert(symbol.address(), (path_of(symbol.name().unwrap_or_default()), symbol.size()));
    }
    let mut functions: Vec<_> = functions.into_values().collect();
    functions.sort_by_key(|(_, size)| std::cmp::Reverse(*size));
    Ok(Size {
        code: sum(&[SectionKind::Text]),
        constants: sum(&[SectionKind::ReadOnlyData, SectionKind::ReadOnlyString, SectionKind::ReadOnlyDataWithRel]),
        ram: ram.map(Option::unwrap_or_default),
        functions,
    })
}

/// The last two names of a mangled path; other names unchanged.
fn path_of(symbol: &str) -> String {
    let mut names = Vec::new();
    let mut rest = symbol.strip_prefix("_ZN").unwrap_or_default();
    while let Some(end) = rest.find(|c: char| !c.is_ascii_digit()).filter(|end| *end > 0) {
        let (len, tail) = rest.split_at(end);
        let Some((name, tail)) = len.parse().ok().and_then(|len| tail.split_at_checked(len)) else { break };
        names.push(name);
        rest = tail;
    }
    // The last name is a hash.
    names.pop();
    match names.as_slice() {
        [] => symbol.to_owned(),
        [name] => (*name).to_owned(),
        [.., module, name] => {
            let module = module.rsplit("..").next().unwrap_or(module);
            format!("{}::{name}", module.split('$').next().unwrap_or(module))
        }
    }
}

/// The figures as the file has them.
fn table(sizes: &[Size]) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "\n| device | code | constants | flash | RAM | the difference costs |\n| --- | --: | --: | --: | --: | --: |"
    );
    let full = &sizes[0];
    for (variant, size) in VARIANTS.iter().zip(sizes) {
        let [less, more] = if variant.adds { [full, size] } else { [size, full] };
        let cost = match (variant.profile, variant.features) {
            ("release", features) if !features.is_empty() => (more.flash() as i64 - less.flash() as i64).to_string(),
            _ => String::new(),
        };
        let (code, constants, flash) = (size.code, size.constants, size.flash());
        let _ = writeln!(text, "| {} | {code} | {constants} | {flash} | {} | {cost} |", variant.name, size.ram[0]);
    }
    let _ = writeln!(text, "\nThe dictionary takes {} bytes of RAM.", full.ram[1]);
    let _ = writeln!(text, "\n| the largest functions | bytes |\n| --- | --: |");
    for (name, size) in full.functions.iter().take(LARGEST) {
        let _ = writeln!(text, "| `{name}` | {size} |");
    }
    text
}

/// Compares flash and RAM of all devices, and instructions, with the file, within [`TOLERANCE`].
fn compare(written: &str, measured: &str) -> Result<(), String> {
    let (old, new) = (rows(written), rows(measured));
    let mut wrong = Vec::new();
    for (name, new) in &new {
        let Some(old) = old.get(name).filter(|old| old.len() == new.len()) else {
            wrong.push(format!("{name}: not there"));
            continue;
        };
        // A device has columns of flash and RAM; a frame has only the instructions.
        let columns =
            if new.len() > 3 { &[("bytes of flash", 2), ("bytes of RAM", 3)][..] } else { &[("instructions", 0)] };
        for (unit, column) in columns {
            let (old, new) = (old[*column], new[*column]);
            if (new - old).abs() > old * TOLERANCE {
                wrong.push(format!("{name}: {new} {unit}, and not {old}"));
            }
        }
    }
    if wrong.is_empty() {
        return Ok(());
    }
    Err(format!("{FIGURES}: {}\nif it must be so: cargo xtask size, and commit the figures", wrong.join("; ")))
}

/// The rows to compare, by name: those of devices and frames, not those of functions.
fn rows(figures: &str) -> BTreeMap<&str, Vec<f64>> {
    let cells = figures.lines().map(|line| line.trim_matches('|').split('|').map(str::trim));
    let rows = cells.filter_map(|mut cells| Some((cells.next()?, cells.map_while(|cell| cell.parse().ok()).collect())));
    rows.filter(|(name, numbers): &(&str, Vec<f64>)| !numbers.is_empty() && !name.starts_with('`')).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_symbol_is_shown_by_its_last_two_names() {
        let mangled = "_ZN15lexican_runtime6device19Device$LT$_$C$_$GT$10take_frame17h718340dfc93b58b8E";
        assert_eq!(path_of(mangled), "Device::take_frame");
        assert_eq!(path_of("__aeabi_memcpy"), "__aeabi_memcpy");
    }

    #[test]
    fn growth_is_noticed() {
        let figures = |flash| format!("| everything | 1 | 2 | {flash} | 100 | |\n| `take_frame` | 3 |\n");
        assert_eq!(compare(&figures(1000), &figures(1009)), Ok(()));
        for flash in [900, 1011] {
            let message = compare(&figures(1000), &figures(flash)).unwrap_err();
            assert!(message.contains(&format!("{flash} bytes of flash, and not 1000")), "{message}");
        }
        assert!(compare("", &figures(1)).is_err());
    }
}
