//! The pictures in `docs/` are those that the example draws now. `LEXICAN_BLESS=1` updates them.

#[path = "../examples/motion_plots/runs.rs"]
mod runs;

use std::path::Path;

#[test]
fn the_golden_pictures_are_those_that_the_example_draws() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let bless = std::env::var_os("LEXICAN_BLESS").is_some();
    let mut stale = Vec::new();
    for (name, draw) in runs::PICTURES {
        let drawn = lexican_pictures::svg(&[draw().unwrap()]);
        let path = folder.join(name);
        if bless {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &drawn).unwrap();
        } else if std::fs::read_to_string(&path).ok().as_deref() != Some(drawn.as_str()) {
            stale.push(*name);
        }
    }
    assert!(stale.is_empty(), "{stale:?} are stale: cargo run -p lexican-siko-ag03-1 --example motion_plots");
}

#[test]
fn two_runs_draw_the_same() {
    let draw = || runs::PICTURES.iter().map(|(_, draw)| lexican_pictures::svg(&[draw().unwrap()])).collect::<Vec<_>>();
    assert_eq!(draw(), draw());
}

#[test]
fn there_is_no_picture_that_nobody_draws() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    for file in std::fs::read_dir(folder).unwrap() {
        let name = file.unwrap().file_name().into_string().unwrap();
        assert!(runs::PICTURES.iter().any(|(drawn, _)| *drawn == name), "{name}");
    }
}
