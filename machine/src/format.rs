//! Formats the file of a machine.

use toml_edit::{DocumentMut, Item, KeyMut, Table, TomlError, Value};

/// Formats the text: normalises blanks and empty lines, and keeps comments and the order of keys.
///
/// Errors: the text is not valid TOML.
pub fn format(text: &str) -> Result<String, TomlError> {
    let mut document: DocumentMut = text.parse()?;
    table(document.as_table_mut());
    let lines = document.to_string();
    let lines = lines.lines().map(str::trim_end).collect::<Vec<_>>();
    let mut formatted = String::new();
    let mut blank = true;
    for line in lines {
        // Keep at most one empty line in a row.
        if !(line.is_empty() && blank) {
            formatted.push_str(line);
            formatted.push('\n');
        }
        blank = line.is_empty();
    }
    Ok(formatted.trim_end().to_owned() + "\n")
}

fn table(table: &mut Table) {
    for (key, item) in table.iter_mut() {
        entry(key, item);
    }
}

fn entry(mut key: KeyMut<'_>, item: &mut Item) {
    match item {
        Item::Table(below) => self::table(below),
        Item::ArrayOfTables(below) => below.iter_mut().for_each(self::table),
        Item::Value(value) => {
            key.leaf_decor_mut().set_suffix(" ");
            // Text behind a value is a comment.
            let comment =
                value.decor().suffix().and_then(|raw| raw.as_str()).map(str::trim).unwrap_or_default().to_owned();
            inner(value);
            let comment = if comment.is_empty() { comment } else { format!("  {comment}") };
            *value.decor_mut() = toml_edit::Decor::new(" ", comment);
        }
        Item::None => {}
    }
}

/// Normalises the blanks within a value, unless it contains comments.
fn inner(value: &mut Value) {
    let has_comment = value.to_string().contains('#');
    match value {
        Value::Array(array) if !has_comment && !array.to_string().contains('\n') => array.fmt(),
        Value::InlineTable(table) if !has_comment => table.fmt(),
        _ => {}
    }
}
