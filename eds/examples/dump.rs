//! Prints a data sheet as CSV, or its findings: `dump FILE [OVERLAY] [--lint]`.

use std::{env, fs};

use lexican_eds::{Input, Source, dump, library, load};

fn main() -> std::io::Result<()> {
    let (options, names): (Vec<String>, Vec<String>) = env::args().skip(1).partition(|name| name.starts_with("--"));
    let mut sources = names.iter().filter(|name| library::find(name).is_none()).map(|name| {
        let bytes = fs::read(name)?;
        Ok(Source::from_bytes(name, &bytes))
    });
    let mut input = match names.first().and_then(|name| library::find(name)) {
        Some(shipped) => shipped.input(),
        None => Input::new(sources.next().unwrap_or(Ok(Source::new("", "")))?),
    };
    input.overlays.extend(sources.collect::<std::io::Result<Vec<_>>>()?);
    let (device, diagnostics) = load(&input);
    if options.iter().any(|option| option == "--lint") {
        print!("{}", diagnostics.render(&input));
    } else {
        print!("{}", dump::csv(&device));
    }
    Ok(())
}
