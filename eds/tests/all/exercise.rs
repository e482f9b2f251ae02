//! Runs everything that the crate does with a data sheet; the fuzz targets (`fuzz/`) use it, too.

use lexican_eds::{Input, Source, convert, diff, dump, fmt, load, write, xdd};

pub(crate) fn exercise(input: &Input) {
    let (device, diagnostics) = load(input);
    let again = load(input);
    assert!(again.1 == diagnostics, "two readings differ");
    let _ = (diagnostics.render(input), diagnostics.to_json(input), diagnostics.to_sarif(input));
    let _ = (dump::csv(&device), dump::md(&device), dump::json(&device), write::dcf(&device));
    let _ = (diff::diff(&device, &again.0), fmt::normalise(&input.eds));
    let xdc = xdd::xdc(&device);
    let _ = convert::losses(&device, &xdc);
    let of_written = load(&Input::new(Source::new("written.xdc", xdc))).1;
    assert!(of_written.iter().all(|finding| finding.code != "eds::xml"), "what is written is XML");
    for label in diagnostics.iter().flat_map(|finding| &finding.labels) {
        let source = input.source(label.span.source).expect("a label is in one of the texts");
        let range = label.span.start as usize..label.span.end as usize;
        assert!(source.text().get(range).is_some(), "a label lies within its text");
    }
}
