//! From the model to text.

use lexican_eds::model::Device;
use lexican_eds::{Diagnostics, Severity};

use crate::{defined, emit, plan, standard};

/// What to generate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Whether the device's side is generated too: `TABLE`, `Storage` and what the overlay says of conditions. It
    /// starts with what a DCF configures, else with the defaults.
    pub storage: bool,
    /// Whether the table `NAMES` is generated, which tools show entries by. It takes its place in the flash.
    pub names: bool,
    /// The path of the runtime: `::lexican_runtime`, or where a crate re-exports it.
    pub runtime_path: String,
}

impl Default for Options {
    fn default() -> Self {
        Options { storage: false, names: false, runtime_path: "::lexican_runtime".into() }
    }
}

/// What came out.
#[derive(Clone, Debug)]
pub struct Output {
    /// The generated code: items for any module.
    pub code: String,
    /// What the data sheet has that could not be generated as it stands; see [`FINDINGS`].
    pub diagnostics: Diagnostics,
}

/// A code of a finding that generating may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Stable words.
    pub code: &'static str,
    /// Its severity, unless the configuration says otherwise.
    pub severity: Severity,
    /// What it means and what to do.
    pub explain: &'static str,
}

/// All codes of findings that generating may have, by name.
pub const FINDINGS: &[Finding] = &[
    Finding {
        code: "od::name-collision",
        severity: Severity::Warning,
        explain: "Several items would have one name in Rust, or one that lexican uses itself. The one with the lowest \
                  address keeps the name, the others have their address appended: one that is added after them renames \
                  none. An overlay can give better names.",
    },
    Finding {
        code: "od::unknown-type",
        severity: Severity::Warning,
        explain: "The data type of an entry is not one of CiA 301, and no DEFTYPE of the data sheet says how many bits it \
                  has. The handle reads and writes bytes. Of a DEFTYPE with at most 64 bits the handle has them as an \
                  unsigned number.",
    },
    Finding {
        code: "od::value-out-of-type",
        severity: Severity::Warning,
        explain: "A default, a configured value or a limit is not a value of the data type, or a limit depends on the \
                  node-ID. It is left out.",
    },
    Finding {
        code: "pdo::too-long",
        severity: Severity::Warning,
        explain: "The default mapping of a PDO has more than 64 bits, which no CAN frame has. No struct is generated.",
    },
    Finding {
        code: "pdo::untyped",
        severity: Severity::Warning,
        explain: "A PDO maps an object that the data sheet does not describe, or one without a fixed size. The field has \
                  the bare bits as `u64`.",
    },
];

/// Generates the typed dictionary of a device. Pure: the same device and options give the same bytes.
///
/// # Panics
///
/// When `options.runtime_path` is not a path; [`Config`](crate::Config) checks it.
#[must_use]
pub fn compile(device: &Device, options: &Options) -> Output {
    let mut diagnostics = Diagnostics::default();
    let mut device = standard::complete(device);
    defined::resolve(&mut device);
    let plan = plan::Plan::new(&device, &mut diagnostics);
    let code = emit::emit(&plan, options);
    diagnostics.finish();
    Output { code, diagnostics }
}
