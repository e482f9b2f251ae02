//! Values and names of objects.

use lexican_eds::model::Value as Known;
use lexican_eds::types::{Class, DataType};
use lexican_runtime::object::Address;
use lexican_toolbox::values::report::ValueReport;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyBool, PyBytes, PyDict, PyInt, PyString};

/// A value as `bool`, `int`, `float`, `str` or `bytes`; a COB-ID that depends on the node-ID is a `str`.
pub(crate) fn python<'py>(
    py: Python<'py>,
    data_type: Option<DataType>,
    value: Option<&Known>,
) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        None => py.None().into_bound(py),
        Some(Known::Integer(number)) if data_type.is_some_and(|it| it.class() == Class::Boolean) => {
            PyBool::new(py, *number != 0).to_owned().into_any()
        }
        Some(Known::Integer(number)) => number.into_pyobject(py)?.into_any(),
        Some(Known::Real(number)) => number.into_pyobject(py)?.into_any(),
        Some(Known::Text(text)) => PyString::new(py, text).into_any(),
        Some(Known::Bytes(bytes)) => PyBytes::new(py, bytes).into_any(),
        Some(value @ Known::NodeIdPlus(_)) => PyString::new(py, &lexican_eds::dump::value_text(value)).into_any(),
    })
}

/// How Python refers to an object: by name or address, by index, or by index and sub-index.
#[derive(FromPyObject)]
pub(crate) enum ObjectName {
    Index(u16),
    Entry(u16, u8),
    Name(String),
}

impl ObjectName {
    /// In the notation that the toolbox's `resolve` reads.
    pub(crate) fn text(&self) -> String {
        match self {
            ObjectName::Index(index) => format!("{index:04X}"),
            ObjectName::Entry(index, sub) => Address::new(*index, *sub).to_string(),
            ObjectName::Name(name) => name.clone(),
        }
    }
}

/// The value of a node's object: in counts, with its unit, as text and as bytes.
#[pyclass(module = "lexican", frozen, get_all, str = "{text}")]
pub(crate) struct Value {
    index: u16,
    sub: u8,
    /// From the data sheet: `Motor Parameter Set, v-Pos`.
    name: Option<String>,
    /// In counts of the device; `None` without a data sheet.
    value: Py<PyAny>,
    /// In its unit: 24.0 for "24.0 V".
    scaled: Option<f64>,
    unit: Option<String>,
    /// With its unit, or as names of its enumeration or bits.
    text: String,
    /// The bytes of the SDO transfer; `None` for a value in a PDO.
    raw: Option<Py<PyBytes>>,
}

impl Value {
    pub(crate) fn of(py: Python<'_>, report: ValueReport) -> PyResult<Self> {
        let value = python(py, report.data_type, report.value.as_ref())?.unbind();
        let raw = report.raw.map(|raw| PyBytes::new(py, &raw).unbind());
        let (unit, scaled) = report.unit.unzip();
        let (index, sub, text) = (report.address.index(), report.address.sub(), report.text.unwrap_or_default());
        Ok(Value { index, sub, name: report.name.as_deref().map(str::to_owned), value, scaled, unit, text, raw })
    }

    fn equation(&self) -> String {
        let name = self.name.as_ref().map(|name| format!(" {name}")).unwrap_or_default();
        format!("{}{name} = {}", Address::new(self.index, self.sub), self.text)
    }

    fn is_no(&self, what: &str) -> PyErr {
        PyTypeError::new_err(format!("{} is no {what}", self.equation()))
    }
}

#[pymethods]
impl Value {
    fn __int__(&self, py: Python<'_>) -> PyResult<i128> {
        self.value.extract(py).map_err(|_| self.is_no("integer"))
    }

    fn __float__(&self, py: Python<'_>) -> PyResult<f64> {
        self.scaled.or_else(|| self.value.extract(py).ok()).ok_or_else(|| self.is_no("number"))
    }

    fn __repr__(&self) -> String {
        format!("<Value {}>", self.equation())
    }
}

/// Values by the names of their entries.
pub(crate) fn by_name(py: Python<'_>, reports: Vec<ValueReport>) -> PyResult<Bound<'_, PyDict>> {
    let named = reports.into_iter().map(|report| {
        let name = report.entry.as_deref().map_or_else(|| report.address.to_string(), str::to_owned);
        Ok((name, Value::of(py, report)?))
    });
    named.collect::<PyResult<Vec<_>>>()?.into_py_dict(py)
}

/// A value, position or velocity as text: as given, or a number in counts of the device.
pub(crate) fn words(value: &Bound<'_, PyAny>) -> PyResult<String> {
    if value.is_instance_of::<PyBool>() {
        return Ok(value.extract::<bool>()?.to_string());
    }
    let text = value.str()?.to_str()?.to_owned();
    Ok(if value.is_instance_of::<PyInt>() { format!("raw:{text}") } else { text })
}
