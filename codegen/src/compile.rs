//! From the model to text.

use lexican_eds::model::Device;
use lexican_eds::{Diagnostics, Severity};

use crate::{emit, plan, standard};

/// What to generate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Whether the device's side is generated too: `TABLE`, `Storage` and what the overlay says of conditions.
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
        explain: "Several items would have one name in Rust, or one that lexican uses itself. All of them have their \
                  address appended, so that adding one never renames another in silence. An overlay can give better names.",
    },
    Finding {
        code: "od::unknown-type",
        severity: Severity::Warning,
        explain: "The data type of an entry is not one of CiA 301. The handle reads and writes bytes.",
    },
    Finding {
        code: "od::value-out-of-type",
        severity: Severity::Warning,
        explain: "A default or a limit is not a value of the data type. It is left out.",
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
    let device = standard::complete(device);
    let plan = plan::Plan::new(&device, &mut diagnostics);
    let code = emit::emit(&plan, options);
    diagnostics.finish();
    Output { code, diagnostics }
}
