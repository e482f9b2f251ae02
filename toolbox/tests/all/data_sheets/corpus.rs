//! Drives of real data sheets, which are not part of this project (`eds/tests/corpus_files`). Each is simulated by its
//! data sheet as a DCF with its own node-ID, and moved as by `lexican drive`. A table of what keeps the others from
//! moving is printed by `cargo test -p lexican-toolbox --test all data_sheets::corpus -- --nocapture`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, thread};

use lexican_driver::{Error, Missing, Mode};
use lexican_eds::{Input, Source};
use lexican_runtime::NodeId;
use lexican_toolbox::data_sheet::DataSheet;
use lexican_toolbox::drive::{Ending, Order, describe};

use super::rig::Rig;
use crate::corpus_files;

/// The percentage of drives that have to move.
const SHARE: usize = 89;

/// How a drive has moved.
enum Moved {
    AsItIs,
    /// After setting what the refusal names.
    OnceSet,
}

#[test]
fn the_drives_of_real_data_sheets_move() {
    let Some(mut files) = corpus_files::corpus() else { return };
    let is = |path: &Path, kind: &str| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(kind));
    files.retain(|path| is(path, "eds") || is(path, "dcf"));
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let results: Vec<(PathBuf, Result<Moved, String>)> = thread::scope(|scope| {
        let one_in = |start: usize| {
            let files = files.iter().skip(start).step_by(threads);
            scope.spawn(move || files.filter_map(|path| Some((path.clone(), moved(path)?))).collect::<Vec<_>>())
        };
        let running: Vec<_> = (0..threads).map(one_in).collect();
        running.into_iter().flat_map(|thread| thread.join().expect("the reasons are above")).collect()
    });
    let mut causes: BTreeMap<&str, Vec<&Path>> = BTreeMap::new();
    for (path, result) in &results {
        causes.entry(result.as_ref().err().map_or("", String::as_str)).or_default().push(path);
    }
    let as_it_is = results.iter().filter(|(_, result)| matches!(result, Ok(Moved::AsItIs))).count();
    let moved = causes.remove("").map_or(0, |paths| paths.len());
    println!(
        "{moved} of {} drives, of {} files, move, {as_it_is} as they are; the others:",
        results.len(),
        files.len()
    );
    for (why, paths) in &causes {
        println!("{:4} {why}", paths.len());
        paths.iter().for_each(|path| println!("         {}", path.display()));
        let names_an_object =
            ["6040", "6041", "6060", "6064", "606C", "607A", "6081", "60FF"].iter().any(|it| why.contains(it));
        assert!(names_an_object && !why.contains('\n'), "one line for its maker: {why}");
    }
    assert!(moved * 100 >= results.len() * SHARE, "{moved} of {}", results.len());
}

/// Whether the drive of a data sheet moves; `None` if the file does not describe one.
fn moved(path: &Path) -> Option<Result<Moved, String>> {
    let bytes = fs::read(path).expect("the corpus is readable");
    let name = path.to_string_lossy().into_owned();
    let sheet = DataSheet::parse(Input::new(Source::from_bytes(name.clone(), &bytes)));
    let has = |index: &u16| sheet.device.object(*index).is_some();
    if ![0x6040, 0x6041, 0x6060, 0x607A].iter().all(has) {
        return None;
    }
    let own = sheet.device.commissioning.as_ref().and_then(|own| NodeId::new(own.node_id?));
    let description = match describe(&sheet.input) {
        Ok(description) => description,
        Err(error) => {
            let text = error.to_string();
            return Some(Err(text.split_once("error[").map_or(text.clone(), |(_, text)| text.to_owned())));
        }
    };
    assert_eq!(description.findings(), [""; 0], "{name}");
    let positions = description.code_of(Mode::Positioning).is_some();
    let order = if positions { Order::Step(Some(100)) } else { Order::Run(100) };
    let go = |profile: Option<i64>| -> Result<Ending, Error> {
        let mut rig = Rig::new(sheet.clone(), own.unwrap_or(NodeId::literal(5)))?;
        rig.protect()?;
        let ending = rig.carry_out(order, profile)?;
        if ending == Ending::Reached && positions {
            let position = rig.drive.position()?;
            assert!((90..=110).contains(&position), "{name}: reached {position}");
        }
        rig.drive.disable()?;
        Ok(ending)
    };
    let (mut result, mut moved) = (go(None), Moved::AsItIs);
    if let Err(Error::Refused(refusal)) = &result
        && refusal.0.iter().any(|missing| matches!(missing, Missing::ProfileVelocity(_)))
    {
        (result, moved) = (go(Some(1000)), Moved::OnceSet);
    }
    Some(match result {
        Ok(Ending::Reached) => Ok(moved),
        Ok(other) => Err(other.to_string()),
        Err(error) => Err(error.to_string()),
    })
}
