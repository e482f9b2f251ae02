//! Data sheets that a command changes in place: read in a way that they can be written back byte for byte.

use std::path::Path;

use anstyle::{AnsiColor, Style};
use lexican_eds::{Input, Source, xdd};
use similar::{ChangeTag, TextDiff};

use crate::output::{Failure, styled, write_whole};
use lexican_toolbox::data_sheet::find;
use lexican_toolbox::text::files::read_up_to;

/// Refuses names of the library, and files that do not exist.
pub(super) fn must_be_file(name: &str) -> Result<(), Failure> {
    if Path::new(name).is_file() {
        return Ok(());
    }
    // Its error message is better if the file does not exist.
    find(name)?;
    Err(Failure::new(format_args!("{name} is not a file that could be written")))
}

/// Reads a data sheet that is a file.
pub(super) fn open(name: &str) -> Result<Input, Failure> {
    must_be_file(name)?;
    let bytes = read_up_to(Path::new(name), lexican_eds::text::MAX_BYTES + 1)?;
    let eds = Source::from_bytes(name, &bytes);
    if eds.refusal().is_none() && eds.to_bytes().as_deref() != Some(&bytes) {
        let encoding = eds.encoding().name();
        return Err(Failure::new(format_args!("{name} is not whole: it begins in {encoding}, but not all of it is"))
            .help("save it in another encoding first"));
    }
    Ok(Input::new(eds))
}

/// Refuses XML, in which objects cannot be added or removed.
pub(super) fn must_be_ini(eds: &Source) -> Result<(), Failure> {
    if !xdd::is_xml(eds) {
        return Ok(());
    }
    let name = eds.name();
    Err(Failure::new(format_args!("{name} is XML, in which this command changes nothing")).help(format!(
        "make an EDS of it first: lexican eds convert {name} -o sheet.eds; convert makes an XDD of that again"
    )))
}

/// Writes a data sheet in its own encoding.
pub(super) fn write(sheet: &Source) -> Result<(), Failure> {
    let bytes = sheet.to_bytes().ok_or_else(|| {
        let encoding = sheet.encoding();
        let missing = sheet.text().chars().find(|letter| encoding.encode(&letter.to_string()).is_none());
        let missing = missing.map(String::from).unwrap_or_default();
        Failure::new(format_args!("{} is in {}, which has no {missing:?}", sheet.name(), encoding.name()))
            .help("save it as UTF-8 first, or do without the character")
    })?;
    write_whole(Path::new(sheet.name()), &bytes)
}

/// The difference in the format of `diff -u`, for `patch`; empty if there is none.
pub(super) fn difference(before: &Source, after: &Source) -> String {
    let diff = TextDiff::from_lines(before.text(), after.text());
    let mut text = String::new();
    for hunk in diff.unified_diff().context_radius(3).iter_hunks() {
        if text.is_empty() {
            let bold = Style::new().bold();
            text += &styled(bold, format_args!("--- {0}\n+++ {0}", before.name()));
            text.push('\n');
        }
        text += &styled(AnsiColor::Cyan.on_default(), hunk.header());
        text.push('\n');
        for change in hunk.iter_changes() {
            let style = match change.tag() {
                ChangeTag::Delete => AnsiColor::Red.on_default(),
                ChangeTag::Insert => AnsiColor::Green.on_default(),
                ChangeTag::Equal => Style::new(),
            };
            let line = change.value();
            let end = line.len() - line.trim_end_matches(['\r', '\n']).len();
            let (line, end) = line.split_at(line.len() - end);
            text += &styled(style, format_args!("{}{line}", change.tag()));
            text += end;
            if change.missing_newline() {
                text += "\n\\ No newline at end of file\n";
            }
        }
    }
    text
}
