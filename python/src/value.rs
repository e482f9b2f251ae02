//! Values of objects, and what objects are called.

use lexican_eds::model::Value as Known;
use lexican_eds::types::{Class, DataType};
use lexican_runtime::object::Address;
use lexican_toolbox::values::report::ValueReport;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyInt, PyString};

/// A value in Python's words: `bool`, `int`, `float`, `str` or `bytes`; a COB-ID that depends on the node-ID is a text.
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

/// What an object is called: its name or address, its index, or index and sub-index.
#[derive(FromPyObject)]
pub(crate) enum ObjectName {
    Index(u16),
    Entry(u16, u8),
    Name(String),
}

impl ObjectName {
    /// As the toolbox's `resolve` takes it.
    pub(crate) fn text(&self) -> String {
        match self {
            ObjectName::Index(index) => format!("{index:04X}"),
            ObjectName::Entry(index, sub) => Address::new(*index, *sub).to_string(),
            ObjectName::Name(name) => name.clone(),
        }
    }
}

/// The value of an object of a node: as a number, with its unit, in words and in bytes.
#[pyclass(module = "lexican", frozen)]
pub(crate) struct Value(pub(crate) ValueReport);

#[pymethods]
impl Value {
    /// The index.
    #[getter]
    fn index(&self) -> u16 {
        self.0.address.index()
    }

    /// The sub-index.
    #[getter]
    fn sub(&self) -> u8 {
        self.0.address.sub()
    }

    /// By the data sheet: `Motor Parameter Set, v-Pos`.
    #[getter]
    fn name(&self) -> Option<&str> {
        self.0.name.as_deref()
    }

    /// As the device counts it; `None` if no data sheet says what the bytes are.
    #[getter]
    fn value<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        python(py, self.0.data_type, self.0.value.as_ref())
    }

    /// The number in its unit: 24.0 of "24.0 V".
    #[getter]
    fn scaled(&self) -> Option<f64> {
        self.0.unit.as_ref().map(|(_, scaled)| *scaled)
    }

    /// The unit.
    #[getter]
    fn unit(&self) -> Option<&str> {
        self.0.unit.as_ref().map(|(unit, _)| unit.as_str())
    }

    /// The value with its unit, or the names of its enumeration or bits.
    #[getter]
    fn text(&self) -> &str {
        self.0.text()
    }

    /// The bytes of the SDO transfer; `None` of a value that came in a PDO.
    #[getter]
    fn raw<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyBytes>> {
        self.0.raw.as_deref().map(|raw| PyBytes::new(py, raw))
    }

    fn __int__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match &self.0.value {
            Some(Known::Integer(number)) => Ok(number.into_pyobject(py)?.into_any()),
            _ => Err(PyTypeError::new_err(format!("{} is no integer", self.0.equation()))),
        }
    }

    fn __float__(&self) -> PyResult<f64> {
        match (&self.0.unit, &self.0.value) {
            (Some((_, scaled)), _) => Ok(*scaled),
            (None, Some(Known::Real(number))) => Ok(*number),
            (None, Some(Known::Integer(number))) => Ok(*number as f64),
            _ => Err(PyTypeError::new_err(format!("{} is no number", self.0.equation()))),
        }
    }

    fn __str__(&self) -> &str {
        self.0.text()
    }

    fn __repr__(&self) -> String {
        format!("<Value {}>", self.0.equation())
    }
}

/// Values by the names of their entries.
pub(crate) fn by_name(py: Python<'_>, reports: Vec<ValueReport>) -> PyResult<Bound<'_, PyDict>> {
    let values = PyDict::new(py);
    for report in reports {
        let name = report.entry.as_deref().map_or_else(|| report.address.to_string(), str::to_owned);
        values.set_item(name, Py::new(py, Value(report))?)?;
    }
    Ok(values)
}

/// A value, a position or a velocity in words: a text as people write it, or a number as the device counts.
pub(crate) fn words(value: &Bound<'_, PyAny>) -> PyResult<String> {
    if value.is_instance_of::<PyBool>() {
        return Ok(value.extract::<bool>()?.to_string());
    }
    let text = value.str()?.to_str()?.to_owned();
    Ok(if value.is_instance_of::<PyInt>() { format!("raw:{text}") } else { text })
}
