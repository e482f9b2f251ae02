//! The options of generating.

/// What to generate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Whether the device's side is generated as well: `TABLE`, `Storage` and the conditions of the overlay. Initial
    /// values are those that a DCF configures, else the defaults.
    pub storage: bool,
    /// Whether the table `NAMES` is generated, with which tools show entries. It takes flash memory.
    pub names: bool,
    /// Whether the module `driver` is generated: `DESCRIPTION`, `Kind` and `Drive` of a CiA 402 drive, for
    /// `lexican-driver`.
    pub driver: bool,
    /// The path of the runtime: `::lexican_runtime`, or the path by which a crate re-exports it.
    pub runtime_path: String,
}

impl Default for Options {
    fn default() -> Self {
        Options { storage: false, names: false, driver: false, runtime_path: "::lexican_runtime".into() }
    }
}
