//! A firmware without std links and runs: `tests/bare`, with the dictionary of the AG03/1. Its size is measured.
//!
//! It is built for this machine and, if the target is installed (`rustup target add thumbv7em-none-eabihf`), for a
//! Cortex-M4F. `cargo test -p lexican-tests --test outside bare -- --nocapture` prints the sizes.
#![cfg(target_os = "linux")]

use crate::outside;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const CORTEX_M4F: &str = "thumbv7em-none-eabihf";

/// The only external symbols that the firmware may need: core calls these functions, and every C library has them.
const FROM_OUTSIDE: [&str; 5] = ["memcpy", "memmove", "memset", "memcmp", "bcmp"];

#[test]
fn a_firmware_without_std_links_and_runs() {
    let archive = build(None);
    // Reuses the build above: the dependencies of the build script are most of the work.
    outside::succeeds("bare", &["clippy", "--release", "--all-targets", "--", "-D", "warnings"]);
    measure("this machine", &archive);
    run(&archive);
    match run_for_text(Command::new("rustup").args(["target", "list", "--installed"])) {
        Some(targets) if targets.lines().any(|target| target == CORTEX_M4F) => {
            measure(CORTEX_M4F, &build(Some(CORTEX_M4F)));
        }
        _ => println!("skipped: {CORTEX_M4F} is not installed"),
    }
}

/// The archive with the firmware and all that it needs of core.
fn build(target: Option<&str>) -> PathBuf {
    let mut task = vec!["build", "--release"];
    task.extend(target.iter().flat_map(|target| ["--target", target]));
    outside::succeeds("bare", &task);
    outside::target_folder().join(target.unwrap_or_default()).join("release/libbare.a")
}

/// Links only what the main loop reaches, and prints its size.
#[track_caller]
fn measure(machine: &str, archive: &Path) {
    let Some(linker) = linker() else {
        println!("skipped: the toolchain has no rust-lld, so that the size for {machine} is not measured");
        return;
    };
    let linked = outside::target_folder().join("linked.elf");
    let mut command = Command::new(linker);
    command.args(["-flavor", "gnu", "-static", "--gc-sections", "-z", "norelro"]);
    command.args(["--entry", "bare_run", "--undefined", "bare_run"]);
    command.args(FROM_OUTSIDE.map(|name| format!("--defsym={name}=0")));
    let output = command.arg(archive).arg("-o").arg(&linked).output().expect("the linker can be started");
    // An allocator, a thread, a file: the linker names what std would need and what is missing.
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));

    let sections = sections(&fs::read(&linked).expect("the linker has written"));
    let sum = |wanted: fn(&Section) -> bool| -> u64 {
        sections.iter().filter(|section| wanted(section)).map(|section| section.size).sum()
    };
    let code = sum(|section| section.is_code);
    let constants = sum(|section| !section.is_code);
    println!("{machine}: {code} bytes of code, {constants} bytes of constants, no static memory");
    let state: Vec<&str> =
        sections.iter().filter(|section| section.is_state()).map(|section| section.name.as_str()).collect();
    assert_eq!(state, [""; 0], "the runtime has no statics with state");
    assert!(code > 10_000, "the main loop reaches the device");
}

/// Runs the firmware on a board written in C.
#[track_caller]
fn run(archive: &Path) {
    let program = outside::target_folder().join("board");
    let mut compiler = Command::new("cc");
    let board = Path::new(env!("CARGO_MANIFEST_DIR")).join("bare/board.c");
    compiler.args(["-std=c99", "-Wall", "-Wextra", "-Werror"]).arg(board).arg(archive);
    let Ok(output) = compiler.arg("-o").arg(&program).output() else {
        println!("skipped: no C compiler, so that the firmware does not run");
        return;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let sent = run_for_text(&mut Command::new(program)).expect("the firmware runs until the power fails");
    let sent: Vec<&str> = sent.lines().collect();
    assert_eq!(
        sent,
        ["705#00", "585#4300100092010000", "585#607A600000000000", "585#4364600088130000", "705#00"],
        "boot-up, the device type, the target, the position, boot-up"
    );
}

/// A section that the device holds in its memory.
struct Section {
    name: String,
    size: u64,
    is_code: bool,
    is_writable: bool,
}

impl Section {
    /// Constants with addresses are writable until they are relocated; in a firmware, this is done at link time.
    fn is_state(&self) -> bool {
        self.is_writable && !self.name.starts_with(".data.rel.ro") && self.name != ".got"
    }
}

/// The sections of a little-endian ELF file of 32 or 64 bits that take memory, without those for unwinding, which a
/// program that aborts does not need.
fn sections(elf: &[u8]) -> Vec<Section> {
    let number =
        |at: usize, len: usize| elf[at..at + len].iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte));
    let wide = elf[4] == 2;
    let word = if wide { 8 } else { 4 };
    // e_shoff; then e_shentsize, e_shnum and e_shstrndx in a row.
    let (table, counts) = if wide { (number(0x28, 8), 0x3A) } else { (number(0x20, 4), 0x2E) };
    let [size, count, names] = [0, 2, 4].map(|more| number(counts + more, 2) as usize);
    let header = |row: usize| table as usize + row * size;
    // A section header: name and type of four bytes each; then flags, address, offset and size of a word each.
    let field = |row: usize, index: usize| number(header(row) + 8 + index * word, word);
    let name = |row: usize| {
        let start = field(names, 2) as usize + number(header(row), 4) as usize;
        let bytes: Vec<u8> = elf[start..].iter().copied().take_while(|&byte| byte != 0).collect();
        String::from_utf8(bytes).expect("names of sections are ASCII")
    };
    const WRITE: u64 = 1;
    const ALLOC: u64 = 2;
    const EXECUTE: u64 = 4;
    (0..count)
        .map(|row| (row, field(row, 0)))
        .filter(|(_, flags)| flags & ALLOC != 0)
        .map(|(row, flags)| Section {
            name: name(row),
            size: field(row, 3),
            is_code: flags & EXECUTE != 0,
            is_writable: flags & WRITE != 0,
        })
        .filter(|section| !section.name.starts_with(".eh_frame") && !section.name.starts_with(".ARM.ex"))
        .collect()
}

/// The linker that comes with the toolchain, and links for every target.
fn linker() -> Option<PathBuf> {
    let sysroot = run_for_text(Command::new("rustc").args(["--print", "sysroot"]))?;
    let hosts = fs::read_dir(Path::new(sysroot.trim()).join("lib/rustlib")).ok()?;
    hosts.filter_map(Result::ok).map(|host| host.path().join("bin/rust-lld")).find(|linker| linker.exists())
}

/// The output of a command; `None` if it cannot be started or fails.
fn run_for_text(command: &mut Command) -> Option<String> {
    let output = command.output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}
