//! From the model to text.

use lexican_eds::Diagnostics;
use lexican_eds::model::Device;

use crate::options::Options;
use crate::{defined, emit, plan, standard};

/// Generated code and findings.
#[derive(Clone, Debug)]
pub struct Output {
    /// The generated code: items for any module.
    pub code: String,
    /// What in the data sheet could not be generated as it is written; see [`FINDINGS`](crate::FINDINGS).
    pub diagnostics: Diagnostics,
}

/// Generates the typed dictionary of a device. Pure: the same device and options give the same bytes.
///
/// # Panics
///
/// When `options.runtime_path` is not a path; [`Config`](crate::Config) checks it.
#[must_use]
pub fn compile(device: &Device, options: &Options) -> Output {
    let mut diagnostics = Diagnostics::default();
    let drive = options.driver.then(|| lexican_eds::drive::read(device)).and_then(|(drive, findings)| {
        diagnostics.extend(findings);
        drive
    });
    let mut device = standard::complete(device);
    defined::resolve(&mut device);
    let plan = plan::Plan::new(&device, &mut diagnostics);
    let code = emit::emit(&plan, drive.as_ref(), options);
    diagnostics.finish();
    Output { code, diagnostics }
}
