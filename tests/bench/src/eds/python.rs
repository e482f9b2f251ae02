//! python-canopen in a process of its own, which takes the time itself: one import per line that it is sent.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

use crate::measure::Contender;

/// Names the Python that has python-canopen.
const PYTHON: &str = "LEXICAN_PYTHON";

/// Reads the file once before it says that it is ready, as the others do.
const SCRIPT: &str = "
import sys, time
from canopen.objectdictionary import import_od
import_od(sys.argv[1], 5)
print('ready', flush=True)
for line in sys.stdin:
    start = time.perf_counter_ns()
    for _ in range(int(line)):
        import_od(sys.argv[1], 5)
    print(time.perf_counter_ns() - start, flush=True)
";

/// # Errors
///
/// Why it cannot take part, in words: there is no Python, pip gets no package, or it refuses the file.
pub(super) fn contender(path: &Path) -> Result<Contender, String> {
    let python = interpreter()?;
    let mut peer = Peer::new(&python, path)?;
    Ok(Contender::with_own_clock("python-canopen 2.4.1", move |times| peer.batch(times)))
}

struct Peer {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Peer {
    fn new(python: &Path, path: &Path) -> Result<Self, String> {
        let mut child = Command::new(python)
            .args(["-c", SCRIPT])
            .arg(path)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| format!("{}: {error}", python.display()))?;
        let input = child.stdin.take().expect("it is piped");
        let output = BufReader::new(child.stdout.take().expect("it is piped"));
        let mut peer = Peer { child, input, output };
        if peer.line() == "ready" { Ok(peer) } else { Err("it does not accept the file".to_owned()) }
    }

    fn batch(&mut self, times: u64) -> Duration {
        writeln!(self.input, "{times}").expect("Python lives");
        Duration::from_nanos(self.line().parse().expect("Python prints a number"))
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        let _ = self.output.read_line(&mut line);
        line.trim().to_owned()
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The Python that has python-canopen, which the task makes and names.
pub(crate) fn interpreter() -> Result<PathBuf, String> {
    let python = std::env::var_os(PYTHON).ok_or_else(|| format!("{PYTHON} names no Python: cargo xtask bench does"))?;
    Ok(python.into())
}
