//! Generates code from a model.

use lexican_eds::model::Device;
use lexican_eds::{Diagnostics, Span, meanings};

use crate::name::Case;
use crate::options::Options;
use crate::scope::{self, Claim};
use crate::{defined, emit, plan};

/// Generated code and what was found on the way.
#[derive(Clone, Debug)]
pub struct Output {
    /// The generated code: items for any module.
    pub code: String,
    /// What could not be generated as the data sheet has it; see [`FINDINGS`](crate::FINDINGS).
    pub diagnostics: Diagnostics,
}

/// Generates the typed dictionary of a device. The same device and options always give the same bytes.
///
/// # Panics
///
/// If `options.runtime_path` is not a path; [`Config`](crate::Config) checks it.
#[must_use]
pub fn compile(device: &Device, options: &Options) -> Output {
    let mut diagnostics = Diagnostics::default();
    let drive = options.driver.then(|| lexican_eds::drive::read(device)).and_then(|(drive, findings)| {
        diagnostics.extend(findings);
        drive
    });
    planned(device, diagnostics, |plan| emit::emit(plan, drive.as_ref(), options))
}

/// Generates only the structs of a device's PDOs, for a module inside the one with the rest, whose types they use.
/// Nodes with the same data sheet may have different PDOs.
///
/// # Panics
///
/// As [`compile`].
#[must_use]
pub fn compile_pdos(device: &Device, options: &Options) -> Output {
    planned(device, Diagnostics::default(), |plan| emit::emit_pdos(plan, options))
}

fn planned(device: &Device, mut diagnostics: Diagnostics, emit: impl FnOnce(&plan::Plan<'_>) -> String) -> Output {
    let mut device = meanings::complete(device);
    defined::resolve(&mut device);
    let code = emit(&plan::Plan::new(&device, &mut diagnostics));
    diagnostics.finish();
    Output { code, diagnostics }
}

/// Module identifiers for these names: all different, and none of them in `reserved`.
#[must_use]
pub fn module_names(names: &[&str], reserved: &[&str]) -> Vec<String> {
    let claim = |name: &&str| Claim::new(name, Case::Snake, "x".into(), Span::default());
    let claims: Vec<Claim> = names.iter().map(claim).collect();
    scope::resolve("module", reserved, &claims, &mut Diagnostics::default())
}
