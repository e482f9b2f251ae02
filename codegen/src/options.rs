//! What to generate.

/// What to generate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Whether the device's side is generated too: `TABLE`, `Storage` and what the overlay says of conditions. It
    /// starts with what a DCF configures, else with the defaults.
    pub storage: bool,
    /// Whether the table `NAMES` is generated, by which tools show entries. It takes room in the flash.
    pub names: bool,
    /// Whether the module `driver` is generated, which describes a drive of CiA 402 for `lexican-driver`: its
    /// `DESCRIPTION`, its `Kind`, and `Drive`.
    pub driver: bool,
    /// The path of the runtime: `::lexican_runtime`, or where a crate re-exports it.
    pub runtime_path: String,
}

impl Default for Options {
    fn default() -> Self {
        Options { storage: false, names: false, driver: false, runtime_path: "::lexican_runtime".into() }
    }
}
