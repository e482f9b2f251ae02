//! Collects the folders `devices/<vendor>/<device>/` into the device library.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("set by Cargo")).join("devices");
    println!("cargo:rerun-if-changed={}", root.display());
    let mut code = String::from("const SHIPPED: &[Shipped] = &[\n");
    for vendor in sorted(&root)? {
        for device in sorted(&vendor)? {
            code += &shipped(&vendor, &device)?;
        }
    }
    code += "];\n";
    fs::write(PathBuf::from(env::var_os("OUT_DIR").expect("set by Cargo")).join("library.rs"), code)
}

fn shipped(vendor: &Path, device: &Path) -> io::Result<String> {
    println!("cargo:rerun-if-changed={}", device.display());
    let with_extension = |wanted: &str| -> io::Result<Option<PathBuf>> {
        let is = |path: &PathBuf| path.extension().is_some_and(|found| found.eq_ignore_ascii_case(wanted));
        Ok(sorted(device)?.into_iter().find(is))
    };
    let Some(eds) = with_extension("eds")? else { return Ok(String::new()) };
    let overlay = with_extension("toml")?;
    let names = overlay.as_deref().map(names).transpose()?.unwrap_or_default();
    let mut code = String::new();
    let _ = writeln!(
        code,
        "    Shipped {{ id: {:?}, file_name: {:?}, eds: include_bytes!({eds:?}), overlay_name: {:?}, overlay: {}, names: &{names:?} }},",
        format!("{}/{}", name(vendor), name(device)),
        name(&eds),
        overlay.as_deref().map(name).unwrap_or_default(),
        overlay.as_deref().map_or("None".to_owned(), |path| format!("Some(include_str!({path:?}))")),
    );
    Ok(code)
}

/// The `names` of `[overlay]`. An overlay that is not well-formed is reported when it is read, not here.
fn names(overlay: &Path) -> io::Result<Vec<String>> {
    println!("cargo:rerun-if-changed={}", overlay.display());
    let text = fs::read_to_string(overlay)?;
    let table: toml::Table = text.parse().unwrap_or_default();
    let names = table.get("overlay").and_then(|overlay| overlay.get("names")).and_then(toml::Value::as_array);
    Ok(names.into_iter().flatten().filter_map(|name| name.as_str().map(str::to_owned)).collect())
}

/// The entries of a folder, sorted by name; none if the folder does not exist.
fn sorted(folder: &Path) -> io::Result<Vec<PathBuf>> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let mut paths =
        fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.path())).collect::<io::Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
