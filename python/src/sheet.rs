//! Data sheets.

use std::path::PathBuf;
use std::sync::Arc;

use lexican_eds::diff::{self, ChangeKind};
use lexican_eds::dump;
use lexican_eds::model::{self, Meaning};
use lexican_runtime::NodeId;
use lexican_toolbox::data_sheet::DataSheet as Sheet;
use lexican_toolbox::pdo::dbc::{Database, Node as DatabaseNode};
use lexican_toolbox::pdo::{PdoName, PdoState};
use lexican_toolbox::values::lookup::{ObjectError, resolve};
use lexican_toolbox::values::{DeviceValues, choices};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

use crate::error::{ObjectUnknown, Raise, wrong};
use crate::pdo::Pdo;
use crate::value::{ObjectName, python};

/// Loads a data sheet: an EDS, DCF, XDD or XDC file, or a device that lexican knows, with overlays from files.
///
/// Mistakes in the data sheet are no errors; `lint()` lists them.
///
/// Raises DataSheetError if there is no such file or device, or it describes no object.
#[pyfunction]
#[pyo3(signature = (name, overlays = Vec::new()))]
pub(crate) fn load(py: Python<'_>, name: PathBuf, overlays: Vec<PathBuf>) -> PyResult<DataSheet> {
    let name = name.to_string_lossy().into_owned();
    let sheet = py.detach(|| Sheet::load_unjudged(&name, &overlays)).map_err(Raise::raise)?;
    Ok(DataSheet { library: sheet.library, sheet, name, overlays })
}

/// A device as described by its data sheet: a mapping from index and sub-index, or name, to entries.
#[pyclass(module = "lexican", frozen, mapping)]
pub(crate) struct DataSheet {
    sheet: Sheet,
    /// The id of the device in the library, if it is from there.
    #[pyo3(get)]
    library: Option<&'static str>,
    /// The name by which it was loaded.
    #[pyo3(get)]
    pub(crate) name: String,
    pub(crate) overlays: Vec<PathBuf>,
}

#[pymethods]
impl DataSheet {
    /// The entry by name, by index, or by index and sub-index; an index alone means sub-index 0.
    ///
    /// Raises ObjectUnknown with similar names.
    fn __getitem__(&self, py: Python<'_>, object: ObjectName) -> PyResult<Entry> {
        let text = object.text();
        let device = &self.sheet.device;
        let unknown = |error: ObjectError| ObjectUnknown::new_err(format!("{error}; {}", error.advice()));
        let address = resolve(Some(device), &text).map_err(unknown)?;
        let entry = device.entry(address.index(), address.sub());
        let none = || unknown(ObjectError::Unknown { text, similar: Vec::new() });
        Entry::of(py, device, entry.ok_or_else(none)?)
    }

    fn __contains__(&self, py: Python<'_>, object: ObjectName) -> bool {
        self.__getitem__(py, object).is_ok()
    }

    fn __len__(&self) -> usize {
        self.sheet.device.entries().count()
    }

    fn __iter__(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(PyList::new(py, self.keys())?.try_iter()?.into_any().unbind())
    }

    /// Index and sub-index of all entries, ascending.
    fn keys(&self) -> Vec<(u16, u8)> {
        self.sheet.device.entries().map(|entry| (entry.index, entry.sub)).collect()
    }

    /// All entries.
    fn values(&self, py: Python<'_>) -> PyResult<Vec<Entry>> {
        self.sheet.device.entries().map(|entry| Entry::of(py, &self.sheet.device, entry)).collect()
    }

    /// All entries with their index and sub-index.
    fn items(&self, py: Python<'_>) -> PyResult<Vec<((u16, u8), Entry)>> {
        Ok(self.keys().into_iter().zip(self.values(py)?).collect())
    }

    /// The entries that a DCF configures, with its values as `value`.
    fn configured(&self, py: Python<'_>) -> PyResult<Vec<Entry>> {
        let entries = self.sheet.device.entries().filter(|entry| entry.configured.is_some());
        entries.map(|entry| Entry::of(py, &self.sheet.device, entry)).collect()
    }

    /// The findings of `lexican eds lint`.
    fn lint(&self, py: Python<'_>) -> Vec<Finding> {
        let input = &self.sheet.input;
        let (_, diagnostics) = py.detach(|| lexican_eds::load(input));
        let finding = |it: &lexican_eds::Diagnostic| {
            let json = it.to_json(input);
            let number = |key: &str| json[key].as_u64();
            Finding {
                rule: it.code,
                severity: it.severity.name(),
                message: it.message.clone(),
                file: json["file"].as_str().map(str::to_owned),
                line: number("line"),
                column: number("column"),
                remedy: it.help.clone(),
                text: it.render(input),
            }
        };
        diagnostics.iter().map(finding).collect()
    }

    /// The differences of another data sheet from this one, by object; order and spelling do not matter.
    fn diff(&self, other: &DataSheet) -> Vec<Change> {
        diff::diff(&self.sheet.device, &other.sheet.device).into_iter().map(Change::from).collect()
    }

    /// The output of `lexican eds dump --json`.
    fn dump<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (dump::json(&self.sheet.device).to_string(),))
    }

    /// A row for each entry, with the columns of `lexican eds dump`: `pandas.DataFrame(sheet.rows())`.
    fn rows<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let objects = self.sheet.device.objects.iter();
        let rows = objects.flat_map(|object| object.entries.iter().map(move |entry| dump::facts(object, entry)));
        rows.map(|facts| {
            let row = PyDict::new(py);
            dump::COLUMNS.into_iter().try_for_each(|column| row.set_item(column, ""))?;
            facts.into_iter().try_for_each(|(column, text)| row.set_item(column, text))?;
            Ok(row)
        })
        .collect()
    }

    /// The enabled PDOs of both directions, for a node-ID and for `decode`.
    fn pdos(&self, node: u8) -> PyResult<Vec<Pdo>> {
        let device = Arc::new(self.sheet.device.clone());
        let node = node_id(node)?;
        let pdos = PdoName::of_sheet(&device).into_iter().filter_map(|name| PdoState::of_sheet(&device, node, name));
        let pdos = pdos.filter(|it| it.cob_id.is_valid() && !it.mapping.is_empty());
        let pdo = |state| Pdo { live: None, device: Arc::clone(&device), seen: Arc::default(), state };
        Ok(pdos.map(pdo).collect())
    }

    /// A CAN database (DBC) of its PDOs, for these node-IDs, or by default for that of a DCF.
    #[pyo3(signature = (*nodes))]
    fn to_dbc<'py>(&self, py: Python<'py>, nodes: Vec<u8>) -> PyResult<Bound<'py, PyBytes>> {
        let device = &self.sheet.device;
        let configured = device.commissioning.as_ref().and_then(|commissioning| commissioning.node_id);
        let nodes = if nodes.is_empty() { configured.into_iter().collect() } else { nodes };
        let nodes = nodes.into_iter().map(|id| Ok(DatabaseNode::new(node_id(id)?, device)));
        let nodes = nodes.collect::<PyResult<Vec<_>>>()?;
        if nodes.is_empty() {
            return Err(wrong(format_args!("which node-ID has {}? to_dbc(5)", self.name)));
        }
        Ok(PyBytes::new(py, &Database::new(&nodes).to_bytes()))
    }

    fn __repr__(&self) -> String {
        format!("<DataSheet {} with {} entries>", self.name, self.__len__())
    }
}

pub(crate) fn node_id(id: u8) -> PyResult<NodeId> {
    NodeId::new(id).ok_or_else(|| wrong(format_args!("{id} is no node-ID: they are 1 to 127")))
}

/// An entry of a data sheet.
#[pyclass(module = "lexican", frozen, get_all)]
pub(crate) struct Entry {
    index: u16,
    sub: u8,
    name: String,
    /// The name of its object; the same as its own for a single value.
    object: String,
    data_type: &'static str,
    access: &'static str,
    pdo_mapping: bool,
    default: Py<PyAny>,
    low: Py<PyAny>,
    high: Py<PyAny>,
    /// The value that a DCF configures.
    value: Py<PyAny>,
    /// The unit by default.
    unit: Option<String>,
    /// The names that can be written: of its values, or of its bits.
    choices: Vec<String>,
    description: Option<String>,
}

impl Entry {
    fn of(py: Python<'_>, device: &model::Device, entry: &model::Entry) -> PyResult<Self> {
        let known = |value: &Option<model::Value>| python(py, Some(entry.data_type), value.as_ref()).map(Bound::unbind);
        let unit = match entry.meaning {
            Meaning::Quantity(_) => DeviceValues::new(device).unit(entry).map(|unit| unit.symbol.clone()),
            _ => None,
        };
        Ok(Entry {
            index: entry.index,
            sub: entry.sub,
            name: entry.name.clone(),
            object: device.object(entry.index).map_or_else(String::new, |object| object.name.clone()),
            data_type: entry.data_type.name(),
            access: entry.access.name(),
            pdo_mapping: entry.pdo_mapping,
            default: known(&entry.default)?,
            low: known(&entry.low)?,
            high: known(&entry.high)?,
            value: known(&entry.configured)?,
            unit,
            choices: choices(device, entry),
            description: entry.description.clone(),
        })
    }
}

#[pymethods]
impl Entry {
    fn __repr__(&self) -> String {
        format!("<Entry {:04X}:{:02X} {}>", self.index, self.sub, self.name)
    }
}

/// A finding about a data sheet, with its remedy. Its text includes the lines.
#[pyclass(module = "lexican", frozen, get_all, str = "{text}")]
pub(crate) struct Finding {
    rule: &'static str,
    /// "error", "warning" or "note".
    severity: &'static str,
    message: String,
    file: Option<String>,
    line: Option<u64>,
    column: Option<u64>,
    remedy: Option<String>,
    text: String,
}

#[pymethods]
impl Finding {
    fn __repr__(&self) -> String {
        let place = |number: Option<u64>| number.map(|number| format!(":{number}")).unwrap_or_default();
        let file = self.file.as_deref().unwrap_or_default();
        format!("<Finding {file}{}{}: {} {}>", place(self.line), place(self.column), self.severity, self.rule)
    }
}

/// A difference between two data sheets.
#[pyclass(module = "lexican", frozen, get_all, str = "{text}")]
pub(crate) struct Change {
    /// `6064:00`, or "DeviceInfo".
    place: String,
    name: String,
    /// "added", "removed" or "changed".
    kind: &'static str,
    /// The column that differs.
    attribute: Option<&'static str>,
    before: Option<String>,
    after: Option<String>,
    text: String,
}

impl From<diff::Change> for Change {
    fn from(change: diff::Change) -> Self {
        let text = change.to_string();
        let (kind, attribute, before, after) = match change.kind {
            ChangeKind::Added => ("added", None, None, None),
            ChangeKind::Removed => ("removed", None, None, None),
            ChangeKind::Changed { attribute, from, to } => ("changed", Some(attribute), Some(from), Some(to)),
        };
        Change { place: change.place, name: change.name, kind, attribute, before, after, text }
    }
}

#[pymethods]
impl Change {
    fn __repr__(&self) -> String {
        format!("<Change {}>", self.text)
    }
}
