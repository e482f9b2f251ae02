//! The Python package `lexican`: the API of Rust with Python's names. It has no logic of its own.
//!
//! Every wait releases the interpreter's lock and checks for signals ([`wait`]). Errors become exceptions with their
//! full text ([`error`]).

mod backup;
mod callbacks;
mod conform;
mod drive;
mod error;
mod frames;
mod lss;
mod network;
mod opened;
mod pdo;
mod sheet;
mod simulation;
mod value;
mod wait;

/// The compiled module of the package.
#[pyo3::pymodule]
mod _native {
    use pyo3::prelude::*;
    use pyo3::types::IntoPyDict;

    use crate::opened::{close_all, forget_all};
    #[pymodule_export]
    use crate::{
        backup::Restored,
        conform::{CaseResult, Conformance},
        drive::{Drive, Outcome},
        error::{
            Closed, DataSheetError, DriveError, LexicanError, LinkFailed, MachineFileError, NoAnswer, ObjectUnknown,
            SdoAborted, ValueRefused,
        },
        frames::Frames,
        lss::{lss_configure, lss_scan},
        network::{Event, Events, Fault, Machine, Network, Node, simulate},
        pdo::Pdo,
        sheet::{Change, DataSheet, Entry, Finding, load},
        value::Value,
    };

    /// The end of the interpreter stops all moving drives; a forked interpreter leaves them to its parent.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let py = module.py();
        let close_all = wrap_pyfunction!(close_all, module)?;
        if let Ok(at_fork) = py.import("os")?.getattr("register_at_fork") {
            let forget_all = [("after_in_child", wrap_pyfunction!(forget_all, module)?)];
            at_fork.call((), Some(&forget_all.into_py_dict(py)?))?;
        }
        py.import("atexit")?.call_method1("register", (close_all,)).map(drop)
    }

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
