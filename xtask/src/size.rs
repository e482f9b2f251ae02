//! The memory that a device takes on a microcontroller (`device`), and the costs of generated code: compile time,
//! lines, and the instructions of one write.
//!
//! In the mix of real data sheets, handles and plain constants take the same time, because arrays save what records
//! cost. In records alone, a member (a `const fn`) takes some 25 µs more than a constant, whatever its body: shorter
//! paths, one call in place of three, `self` by value and no alias were tried, and none of them changes that. It is the
//! price of a member's own documentation and search entry.

pub(crate) mod device;

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::outside;

/// Numbers of entries in the synthetic data sheet, in the proportions of the 207,000 entries of 326 real files: 9 %
/// single values, 36 % in arrays of 29 elements, 55 % in records of 6.
const SINGLE: usize = 450;
const ARRAYS: usize = 60;
const ELEMENTS: usize = 30;
const RECORDS: usize = 458;
const MEMBERS: usize = 6;

/// The number of timed builds of each kind, in alternation; the shortest time counts.
const RUNS: usize = 9;
/// The relative difference that two measurements of the same thing may have.
const NOISE: f64 = 0.05;
/// The most instructions before the call in a typed write.
const MAX_INSTRUCTIONS: usize = 4;
/// The most lines of generated code per object, documentation included.
const MAX_LINES_PER_OBJECT: usize = 10;

/// Measures everything; with `check`, only what is the same on every machine.
pub(crate) fn run(root: &Path, check: bool) -> Result<(), String> {
    device::run(root, check)?;
    let workspace = outside::empty_folder(root, "size")?;
    let sheet = Sheet::new();
    let lexican = outside::lexican(root)?;
    let code = generate(&lexican, &workspace, &sheet)?;
    outside::write(
        &workspace.join("Cargo.toml"),
        "[workspace]\nresolver = \"3\"\nmembers = [\"handles\", \"plain\"]\n",
    )?;
    let lib = "//! Handles.\n#![no_std]\n/// The dictionary.\npub mod od;\n";
    outside::write_crate(root, &workspace.join("handles"), "2024", &format!("{lib}{TYPED_WRITE}"))?;
    outside::write(&workspace.join("handles/src/od.rs"), &code)?;
    outside::write_crate(root, &workspace.join("plain"), "2024", lib)?;
    outside::write(&workspace.join("plain/src/od.rs"), &sheet.plain)?;

    let mut wrong = Vec::new();
    let objects = sheet.entries;
    let lines = code.lines().count();
    if !check {
        let [handles, plain] = times(root, &workspace)?;
        println!("cargo check of {objects} entries: handles {handles:.2?}, a plain constant each {plain:.2?}");
        if handles > plain.mul_f64(1.0 + NOISE) {
            wrong.push("handles take longer to check than plain constants".to_owned());
        }
    }
    println!(
        "lines per entry: handles {}, a plain constant each {}",
        lines / objects,
        sheet.plain.lines().count() / objects
    );
    let instructions = typed_write(root, &workspace)?;
    println!("a typed write, up to its call:\n{}", instructions.join("\n"));

    if lines / objects > MAX_LINES_PER_OBJECT {
        wrong.push(format!("more than {MAX_LINES_PER_OBJECT} lines per entry"));
    }
    if instructions.len() > MAX_INSTRUCTIONS {
        wrong.push(format!("a typed write takes {} instructions, not {MAX_INSTRUCTIONS}", instructions.len()));
    }
    if wrong.is_empty() {
        Ok(())
    } else {
        Err(format!("size: {}\nrun it again alone: cargo xtask size", wrong.join("; ")))
    }
}

/// The data sheet, and its entries as plain constants.
struct Sheet {
    eds: String,
    plain: String,
    entries: usize,
}

impl Sheet {
    fn new() -> Self {
        let mut sheet = Sheet { eds: HEAD.to_owned(), plain: String::new(), entries: 0 };
        let count = SINGLE + ARRAYS + RECORDS;
        let _ = writeln!(sheet.eds, "[ManufacturerObjects]\nSupportedObjects={count}");
        for number in 1..=count {
            let _ = writeln!(sheet.eds, "{number}=0x{:04X}", 0x1FFF + number);
        }
        for number in 0..SINGLE {
            sheet.entry(0x2000 + number, None, &format!("Single parameter {number}"), number);
        }
        for number in 0..ARRAYS {
            let index = 0x2000 + SINGLE + number;
            sheet.object(index, &format!("List {number}"), 8, ELEMENTS);
            (1..ELEMENTS).for_each(|sub| sheet.entry(index, Some(sub), &format!("Element {sub}"), number));
        }
        for number in 0..RECORDS {
            let index = 0x2000 + SINGLE + ARRAYS + number;
            sheet.object(index, &format!("Parameter group {number}"), 9, MEMBERS);
            (1..MEMBERS)
                .for_each(|sub| sheet.entry(index, Some(sub), &format!("Parameter {}", LETTERS[sub]), number + sub));
        }
        sheet
    }

    fn object(&mut self, index: usize, name: &str, object_type: u8, subs: usize) {
        let _ = writeln!(self.eds, "\n[{index:04X}]\nParameterName={name}\nObjectType={object_type}\nSubNumber={subs}");
        let _ = writeln!(
            self.eds,
            "\n[{index:04X}sub0]\nParameterName=Highest sub-index supported\nObjectType=7\nDataType=5\n\
             AccessType=ro\nDefaultValue={}\nPDOMapping=0",
            subs - 1
        );
        self.constant(index, 0, "Highest sub-index supported", "UNSIGNED8", "ro", "u8", "Ro", "", subs - 1);
    }

    /// Adds an entry. `number` decides type, access, default and limits.
    fn entry(&mut self, index: usize, sub: Option<usize>, name: &str, number: usize) {
        let (code, data_type, rust) =
            [(5, "UNSIGNED8", "u8"), (6, "UNSIGNED16", "u16"), (7, "UNSIGNED32", "u32"), (3, "INTEGER16", "i16")]
                [number % 4];
        let (access, marker) = [("rw", "Rw"), ("ro", "Ro")][number % 2];
        let section = sub.map_or_else(|| format!("{index:04X}"), |sub| format!("{index:04X}sub{sub:X}"));
        let default = number % 100;
        let _ = writeln!(
            self.eds,
            "\n[{section}]\nParameterName={name}\nObjectType=7\nDataType={code}\nAccessType={access}\n\
             DefaultValue={default}\nPDOMapping=0"
        );
        let limits = if number.is_multiple_of(3) { ".with_limits(0, 100)" } else { "" };
        if !limits.is_empty() {
            self.eds += "LowLimit=0\nHighLimit=100\n";
        }
        self.constant(index, sub.unwrap_or(0), name, data_type, access, rust, marker, limits, default);
    }

    #[expect(clippy::too_many_arguments, reason = "one line of a table")]
    fn constant(
        &mut self,
        index: usize,
        sub: usize,
        name: &str,
        data_type: &str,
        access: &str,
        rust: &str,
        marker: &str,
        limits: &str,
        default: usize,
    ) {
        self.entries += 1;
        let range = if limits.is_empty() { "" } else { " · limits 0…100" };
        let _ = writeln!(
            self.plain,
            "/// {name}\n///\n/// Address 0x{index:04X}:{sub:02X} · {data_type} · {access} · default {default}{range}\n\
             #[doc(alias(\"0x{index:04X}:{sub:02X}\", \"{index:04X}\"))]\n\
             pub const OBJECT_{index:04X}_{sub:02X}: ::lexican_runtime::object::Object<\n    {rust},\n    \
             ::lexican_runtime::object::{marker},\n> = ::lexican_runtime::object::Object::new(0x{index:04X}, 0x{sub:02X})\
             {limits}.with_default({default});\n"
        );
    }
}

const LETTERS: [&str; MEMBERS] = ["none", "alpha", "beta", "gamma", "delta", "epsilon"];

const HEAD: &str = "[FileInfo]\nFileName=size.eds\n\n[DeviceInfo]\nVendorName=none\nBaudRate_1000=1\n\n\
                    [MandatoryObjects]\nSupportedObjects=0\n\n[OptionalObjects]\nSupportedObjects=0\n\n";

/// The source of a function with one typed write. Only the code before its call of `send` is measured.
const TYPED_WRITE: &str = r#"
/// Sends a value; the compiler sees what stands before the call.
#[inline(never)]
pub fn send(bus: &mut core::sync::atomic::AtomicU64, address: lexican_runtime::object::Address, raw: u64) {
    *bus.get_mut() = raw ^ u64::from(address.index());
}

fn write<T: lexican_runtime::object::Value, A: lexican_runtime::object::Writable, M, D>(
    bus: &mut core::sync::atomic::AtomicU64,
    object: lexican_runtime::object::Object<T, A, M, D>,
    value: T,
) {
    if object.check(value).is_ok() {
        send(bus, object.address(), value.to_raw());
    }
}

/// One typed write.
#[inline(never)]
pub fn typed_write(bus: &mut core::sync::atomic::AtomicU64, value: u32) {
    write(bus, od::PARAMETER_GROUP_1.parameter_alpha(), value);
}
"#;

fn generate(lexican: &Path, workspace: &Path, sheet: &Sheet) -> Result<String, String> {
    let eds = workspace.join("size.eds");
    outside::write(&eds, &sheet.eds)?;
    let output = Command::new(lexican)
        .args(["gen", "--ignore", "eds::missing-object", "--ignore", "cia301::missing-object"])
        .arg(&eds)
        .output()
        .map_err(|error| format!("{}: {error}", lexican.display()))?;
    if !output.status.success() {
        return Err(format!("lexican gen: {}\n{}", output.status, String::from_utf8_lossy(&output.stderr)));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The shortest times of `cargo check` for handles and for plain constants, with compiled dependencies: processor time
/// where the system reports it, else wall-clock time.
#[expect(clippy::disallowed_methods, reason = "a task that measures real time reads the clock")]
fn times(root: &Path, workspace: &Path) -> Result<[Duration; 2], String> {
    let mut best = [Duration::MAX; 2];
    outside::cargo_in(root, workspace, &["check", "--quiet"])?;
    for _ in 0..RUNS {
        for (name, best) in ["handles", "plain"].into_iter().zip(&mut best) {
            let lib = workspace.join(name).join("src/lib.rs");
            let text = std::fs::read_to_string(&lib).map_err(|error| format!("{}: {error}", lib.display()))?;
            outside::write(&lib, &text)?;
            let (start, before) = (Instant::now(), children_cpu());
            outside::cargo_in(root, workspace, &["check", "--quiet", "-p", name])?;
            let cpu = before.zip(children_cpu()).map(|(before, after)| after - before);
            *best = cpu.unwrap_or_else(|| start.elapsed()).min(*best);
        }
    }
    Ok(best)
}

/// The processor time of all children so far, which a busy machine disturbs less than wall-clock time; in steps of 10
/// ms (proc(5), `cutime` and `cstime`). `None` where there is no such file.
fn children_cpu() -> Option<Duration> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field is a name in parentheses, which may contain spaces and parentheses.
    let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace().skip(13);
    let mut ticks = || fields.next()?.parse::<u64>().ok();
    Some(Duration::from_millis((ticks()? + ticks()?) * 10))
}

/// The instructions of `typed_write` up to its call.
fn typed_write(root: &Path, workspace: &Path) -> Result<Vec<String>, String> {
    let arguments = ["rustc", "--quiet", "--release", "-p", "handles", "--", "--emit", "asm", "-C", "codegen-units=1"];
    outside::cargo_in(root, workspace, &arguments)?;
    let deps = workspace.join("target/release/deps");
    let entries = std::fs::read_dir(&deps).map_err(|error| format!("{}: {error}", deps.display()))?;
    let path = entries
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .find(|path| path.extension().is_some_and(|e| e == "s"));
    let path = path.ok_or("the compiler wrote no assembly")?;
    let asm = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let body = asm.lines().skip_while(|line| !(line.contains("typed_write") && line.ends_with(':'))).skip(1);
    let mut instructions = Vec::new();
    for line in body.filter(|line| line.starts_with('\t') && !line.starts_with("\t.")) {
        if line.contains("send") {
            return Ok(instructions);
        }
        instructions.push(line.to_owned());
    }
    Err("the assembly has no call of `send` in `typed_write`".to_owned())
}
