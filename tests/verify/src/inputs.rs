//! What is compared.

use std::collections::BTreeMap;
use std::path::Path;

/// The texts that are compared.
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    /// The data sheet.
    pub eds: String,
    /// Its overlay.
    pub overlay: String,
    /// The manual's tables: file name and text.
    pub tables: BTreeMap<String, String>,
    /// The code was not generated from this data sheet and overlay. Generated anew, it would agree with them, so the
    /// two are not compared: what is wrong in them has to show against the manual.
    pub code_is_stale: bool,
}

impl Inputs {
    /// Reads them where they lie below the workspace's root.
    ///
    /// # Errors
    ///
    /// The file that cannot be read, and why.
    pub fn read(root: &Path) -> Result<Self, String> {
        let text = |path: &Path| {
            std::fs::read_to_string(root.join(path)).map_err(|error| format!("{}: {error}", path.display()))
        };
        let device = Path::new("eds/devices/siko/ag03-1");
        let folder = Path::new("tests/manual/ag03-1");
        let mut tables = BTreeMap::new();
        let entries = std::fs::read_dir(root.join(folder)).map_err(|error| format!("{}: {error}", folder.display()))?;
        for entry in entries.filter_map(Result::ok) {
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.ends_with(".csv") {
                tables.insert(name.clone(), text(&folder.join(name))?);
            }
        }
        let (eds, overlay) = (text(&device.join("SIKOAG03.EDS"))?, text(&device.join("SIKOAG03.toml"))?);
        Ok(Inputs { eds, overlay, tables, code_is_stale: false })
    }
}
