//! A Linux kernel with CAN as an ordinary program: Debian's package `user-mode-linux`.
//!
//! The guest's root is that of the machine, read-only, under a layer in memory: programs, libraries and test binaries
//! are at their usual paths. Both sides write to the job folder: the guest finds its orders there, and leaves the exit
//! status of the command.

use std::fs;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The init script of the guest, run by busybox.
const GUEST: &str = include_str!("guest.sh");

/// A library that lets the guest's kernel run on processors newer than itself; see the file.
const XSTATE: &str = include_str!("xstate.c");

/// The modules that are taken out of the package, besides the kernel.
const MODULES: [&str; 8] = ["overlay", "can-dev", "can", "can-raw", "can-bcm", "vcan", "vxcan", "slcan"];

/// A guest that has not booted by then is started again. Booting takes about 2 s; beside a busy build, 5 s.
const BOOT_LIMIT: Duration = Duration::from_secs(60);

const TRIES: u32 = 3;

/// The exit status of a command whose time was out, as that of `timeout`.
const OUT_OF_TIME: u8 = 124;

pub(super) struct Kernel {
    /// `linux.uml`, `busybox`, `xstate.so` and the modules.
    folder: PathBuf,
}

impl Kernel {
    /// The kernel in the cache; it is downloaded if it is not there.
    pub(super) fn in_cache(folder: &Path) -> Result<Self, String> {
        let kernel = Kernel { folder: folder.to_path_buf() };
        if !kernel.folder.join("complete").is_file() {
            kernel.fetch().map_err(|error| {
                format!(
                    "{error}\nthis kernel has no CAN, and the packages user-mode-linux and busybox-static of Debian \
                     (amd64) cannot be had;\nrun it on a Linux with the module vcan: sudo modprobe vcan && sudo ip \
                     link add dev vcan0 type vcan && sudo ip link set vcan0 up"
                )
            })?;
        }
        kernel.compile_xstate()?;
        Ok(kernel)
    }

    /// Compiles the library that is preloaded into the kernel, since no package has it.
    fn compile_xstate(&self) -> Result<(), String> {
        let library = self.xstate();
        if library.is_file() {
            return Ok(());
        }
        let source = self.folder.join("xstate.c");
        fs::write(&source, XSTATE).map_err(|error| format!("{}: {error}", source.display()))?;
        let new = library.with_extension("new");
        let mut cc = Command::new("cc");
        cc.args(["-shared", "-fPIC", "-O2", "-o"]).arg(&new).arg(&source).arg("-ldl");
        let status = cc.status().map_err(|error| format!("cc: {error}; install a C compiler: apt-get install gcc"))?;
        if !status.success() {
            return Err(format!("cc cannot compile {}: {status}", source.display()));
        }
        fs::rename(&new, &library).map_err(|error| format!("{}: {error}", library.display()))
    }

    fn xstate(&self) -> PathBuf {
        self.folder.join("xstate.so")
    }

    fn fetch(&self) -> Result<(), String> {
        println!("vcan: fetching user-mode-linux (42 MB) into {}", self.folder.display());
        // Work beside the cache, so that an interrupted attempt leaves no cache that looks complete.
        let new = self.folder.with_extension("new");
        let _ = fs::remove_dir_all(&new);
        fs::create_dir_all(&new).map_err(|error| format!("{}: {error}", new.display()))?;
        if !download(&new) {
            // Outdated package lists name versions that the archive no longer has.
            let _ = quietly(Command::new("apt-get").arg("update"));
            if !download(&new) {
                return Err("apt-get download user-mode-linux busybox-static has failed".to_owned());
            }
        }
        let modules = MODULES.iter().map(|module| format!("{module}.ko*"));
        unpack(
            &new,
            "user-mode-linux",
            "linux.uml",
            &["*bin/linux.uml".to_owned()].into_iter().chain(modules).collect::<Vec<_>>(),
        )?;
        unpack(&new, "busybox-static", "busybox", &["*bin/busybox".to_owned()])?;
        fs::write(new.join("complete"), "").map_err(|error| error.to_string())?;
        let _ = fs::remove_dir_all(&self.folder);
        fs::rename(&new, &self.folder).map_err(|error| format!("{}: {error}", self.folder.display()))
    }

    /// Runs the command in the guest and returns its exit status.
    pub(super) fn run(&self, command: &[String], time_limit_s: u32, writable: &[PathBuf]) -> Result<u8, String> {
        for _ in 0..TRIES {
            let job = Job::new(self, command, time_limit_s, writable)
                .map_err(|error| format!("the job's folder: {error}"))?;
            match job.run(self, Duration::from_secs(time_limit_s.into()))? {
                Outcome::Status(status) => return Ok(status),
                Outcome::NotBooted(words) => eprintln!("vcan: the guest did not come up; {words}"),
            }
        }
        Err(format!("the guest did not come up in {TRIES} tries"))
    }
}

/// Whether both packages were downloaded.
fn download(folder: &Path) -> bool {
    let options = ["-q", "-o", "APT::Sandbox::User=root", "download", "user-mode-linux", "busybox-static"];
    quietly(Command::new("apt-get").args(options).current_dir(folder))
}

/// Extracts the members that match `patterns` from a package, directly into `folder`.
fn unpack(folder: &Path, package: &str, proof: &str, patterns: &[String]) -> Result<(), String> {
    let failed = |error: io::Error| format!("unpacking {package}: {error}");
    let deb = fs::read_dir(folder).map_err(failed)?.filter_map(Result::ok).map(|entry| entry.path());
    let deb = deb.into_iter().find(|path| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        name.starts_with(&format!("{package}_")) && name.ends_with(".deb")
    });
    let deb = deb.ok_or(format!("no package {package} was downloaded"))?;
    let mut archive =
        Command::new("dpkg-deb").arg("--fsys-tarfile").arg(&deb).stdout(Stdio::piped()).spawn().map_err(failed)?;
    let stdout = archive.stdout.take().ok_or("dpkg-deb has no output")?;
    // Drop the folders of the members: the names are unique.
    let tar = Command::new("tar")
        .args(["-x", "--wildcards", "--no-anchored", "--transform", "s,.*/,,", "-C"])
        .arg(folder)
        .args(patterns)
        .stdin(stdout)
        .stderr(Stdio::null())
        .status()
        .map_err(failed)?;
    archive.wait().map_err(failed)?;
    fs::remove_file(deb).map_err(failed)?;
    // Ignore the status of tar, which fails if a pattern matches nothing: not every release has all members.
    let _ = tar;
    for entry in fs::read_dir(folder).map_err(failed)?.filter_map(Result::ok) {
        if entry.path().extension().is_some_and(|extension| extension == "xz") {
            quietly(Command::new("xz").arg("-d").arg(entry.path()));
        }
    }
    if folder.join(proof).is_file() { Ok(()) } else { Err(format!("package {package} has no {proof}")) }
}

fn quietly(command: &mut Command) -> bool {
    let command = command.stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

enum Outcome {
    Status(u8),
    /// With the last lines of its console.
    NotBooted(String),
}

/// The folder by which the two sides communicate; removed when dropped.
struct Job {
    folder: PathBuf,
}

impl Job {
    fn new(kernel: &Kernel, command: &[String], time_limit_s: u32, writable: &[PathBuf]) -> io::Result<Self> {
        // The path is on the kernel's command line and in the names of sockets, so keep it short and without spaces.
        let folder = PathBuf::from(format!("/tmp/lexican-vcan-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(folder.join("uml"))?;
        let job = Job { folder };
        let here = std::env::current_dir()?;
        let mut orders = format!(
            "BUSYBOX={}\nMODULES={}\nTIME_LIMIT={time_limit_s}\nFOLDER={}\nWRITABLE={}\n",
            quote(&kernel.folder.join("busybox").to_string_lossy()),
            quote(&kernel.folder.to_string_lossy()),
            quote(&here.to_string_lossy()),
            quote(&canonical(writable)?.join("\n")),
        );
        orders.push_str(GUEST);
        job.write("guest.sh", &orders)?;
        let environment = std::env::vars().filter(|(key, _)| is_name(key));
        let environment: String = environment.map(|(key, value)| format!("export {key}={}\n", quote(&value))).collect();
        let words: Vec<String> = command.iter().map(|word| quote(word)).collect();
        job.write("command.sh", &format!("{environment}{}\n", words.join(" ")))?;
        let shell = kernel.folder.join("busybox");
        job.write("init", &format!("#!{} sh\n. {}/guest.sh\n", shell.display(), job.folder.display()))?;
        fs::set_permissions(job.folder.join("init"), fs::Permissions::from_mode(0o755))?;
        Ok(job)
    }

    fn write(&self, name: &str, text: &str) -> io::Result<()> {
        fs::write(self.folder.join(name), text)
    }

    #[expect(clippy::disallowed_methods, reason = "a guest that hangs is ended by the clock on the wall")]
    fn run(&self, kernel: &Kernel, time_limit: Duration) -> Result<Outcome, String> {
        let mut guest = self.boot(kernel).map_err(|error| format!("linux.uml: {error}"))?;
        let mut deadline = Instant::now() + BOOT_LIMIT;
        let mut started = false;
        while guest.try_wait().map_err(|error| error.to_string())?.is_none() {
            if !started && self.has("started") {
                started = true;
                // The guest itself ends the command in time, unless it hangs.
                deadline = Instant::now() + time_limit + Duration::from_secs(20);
            }
            if Instant::now() >= deadline {
                end(&mut guest);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        if self.has("out-of-time") {
            eprintln!("vcan: out of time after {} s", time_limit.as_secs());
            return Ok(Outcome::Status(OUT_OF_TIME));
        }
        if !started && !self.has("started") {
            return Ok(Outcome::NotBooted(self.last_words()));
        }
        let status = fs::read_to_string(self.folder.join("status")).unwrap_or_default();
        let status = status.trim().parse().map_err(|_| format!("the guest died or hung; {}", self.last_words()))?;
        Ok(Outcome::Status(status))
    }

    fn boot(&self, kernel: &Kernel) -> io::Result<Child> {
        let linux = kernel.folder.join("linux.uml");
        // The guest has one processor that changes between host processes. Bound to one processor of the host, its
        // system calls are four times as fast as across two.
        let mut command = match processor() {
            Some(processor) => {
                let mut command = Command::new("taskset");
                command.args(["-c", &processor]).arg(linux);
                command
            }
            None => Command::new(linux),
        };
        let folder = self.folder.display();
        command
            .args(["mem=768M", "umid=vm", "noreboot", "quiet", "panic=-1", "root=/dev/root", "rootfstype=hostfs"])
            .args(["rootflags=/", "ro", "con=null", "con0=null,fd:2", "ssl=null", "ssl0=null,fd:1", "ssl1=fd:0,null"])
            .args([format!("uml_dir={folder}/uml"), format!("init={folder}/init")])
            .env("LD_PRELOAD", kernel.xstate())
            // A pipe that closes when this process ends, for whatever reason; this tells the guest to end, too.
            .stdin(Stdio::piped())
            .stderr(fs::File::create(self.folder.join("console"))?)
            .spawn()
    }

    fn has(&self, name: &str) -> bool {
        self.folder.join(name).exists()
    }

    fn last_words(&self) -> String {
        let console = fs::read(self.folder.join("console")).unwrap_or_default();
        let console = String::from_utf8_lossy(&console).into_owned();
        let lines: Vec<&str> = console.lines().rev().take(15).collect();
        let lines: Vec<&str> = lines.into_iter().rev().collect();
        format!("its last words:\n{}", lines.join("\n"))
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        // A folder that remains in /tmp does no harm.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// The signal makes the guest's kernel end its processes. A guest that does not react is killed.
fn end(guest: &mut Child) {
    quietly(Command::new("kill").arg(guest.id().to_string()));
    #[expect(clippy::disallowed_methods, reason = "the guest needs real time to end")]
    std::thread::sleep(Duration::from_secs(2));
    let _ = guest.kill();
}

/// One of the processors that this process may use, if there is a `taskset`.
fn processor() -> Option<String> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"))?;
    let last = list.trim().rsplit([',', '-']).next()?.to_owned();
    quietly(Command::new("taskset").arg("--version")).then_some(last)
}

fn canonical(folders: &[PathBuf]) -> io::Result<Vec<String>> {
    folders.iter().map(|folder| Ok(folder.canonicalize()?.to_string_lossy().into_owned())).collect()
}

fn is_name(key: &str) -> bool {
    key.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// A text as one word of the shell.
fn quote(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}
