//! Draws the pictures of the simulated drive's motion, `docs/*.svg`: ramps, loops, inching, velocities, stops, and a
//! fault. Virtual time, so that a minute of motion takes no time, and the same pictures every time.
//!
//! `cargo run -p lexican-siko-ag03-1 --example motion_plots [FOLDER]`

mod runs;

use std::path::PathBuf;

use lexican_runtime::host::MainError;

fn main() -> Result<(), MainError> {
    let docs = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs");
    let folder = std::env::args_os().nth(1).map_or(docs, PathBuf::from);
    std::fs::create_dir_all(&folder)?;
    for (name, draw) in runs::PICTURES {
        let path = folder.join(name);
        std::fs::write(&path, lexican_pictures::svg(&[draw()?]))?;
        println!("{}", path.display());
    }
    Ok(())
}
