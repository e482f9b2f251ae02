//! Exceptions: one class for each kind of error that a program may want to catch, with the full text.

use lexican_machine::MachineError;
use lexican_runtime::host::{AccessError, LinkError};
use lexican_runtime::service::sdo_client::SdoError;
use lexican_toolbox::data_sheet::DataSheetError as SheetError;
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

macro_rules! exceptions {
    ($($name:ident($base:ident): $doc:literal;)*) => {
        $(create_exception!(lexican, $name, $base, $doc);)*
    };
}

exceptions! {
    LexicanError(PyException): "What lexican cannot do, and why.";
    DataSheetError(LexicanError): "A data sheet that cannot be read, or describes nothing.";
    MachineFileError(LexicanError): "A machine's file in which something is wrong: all findings.";
    ObjectUnknown(LexicanError): "The data sheet has no such object, or several: what is similar.";
    ValueRefused(LexicanError): "A text that is no value of the object, or one that may not be written; nothing was sent.";
    LinkFailed(LexicanError): "The bus cannot be opened, or carries nothing.";
    Closed(LinkFailed): "The program has closed it.";
    SdoAborted(LexicanError): "The device has aborted an SDO transfer of `index` and `sub`: `code` is that of CiA 301.";
    NoAnswer(LexicanError): "The device does not answer a transfer of `index` and `sub`.";
    DriveError(LexicanError): "A drive that refuses, is in fault, or does not do what it was ordered.";
}

/// Converts an error of Rust to an exception.
pub(crate) trait Raise {
    fn raise(self) -> PyErr;
}

/// The exception for a failed transfer, with its entry.
fn of_sdo(error: SdoError, text: String) -> PyErr {
    let exception = match error {
        SdoError::Aborted { .. } => SdoAborted::new_err(text),
        SdoError::TimedOut { .. } => NoAnswer::new_err(text),
        _ => return LexicanError::new_err(text),
    };
    let address = error.address();
    Python::attach(|py| {
        let value = exception.value(py);
        value.setattr("index", address.index())?;
        value.setattr("sub", address.sub())?;
        match error {
            SdoError::Aborted { code, .. } => value.setattr("code", code.0),
            _ => Ok(()),
        }
    })
    .err()
    .unwrap_or(exception)
}

/// The exception for a failed access.
fn of_access(error: AccessError, text: String) -> PyErr {
    match error {
        AccessError::Sdo { error, .. } => of_sdo(error, text),
        AccessError::Link(_) => LinkFailed::new_err(text),
        AccessError::OutOfRange(_) => ValueRefused::new_err(text),
        _ => LexicanError::new_err(text),
    }
}

impl Raise for MachineError {
    fn raise(self) -> PyErr {
        let text = self.to_string();
        match self {
            MachineError::Access { error, .. } => of_access(error, text),
            MachineError::Drive(lexican_driver::Error::Sdo(error)) => of_sdo(error, text),
            MachineError::Drive(lexican_driver::Error::Link(_))
            | MachineError::Open { .. }
            | MachineError::Url(_)
            | MachineError::NoBus(_)
            | MachineError::Link(_)
            | MachineError::Io(_) => LinkFailed::new_err(text),
            MachineError::Read(_) | MachineError::Wrong { .. } | MachineError::WhichBus(_) => {
                MachineFileError::new_err(text)
            }
            MachineError::Object { .. } => ObjectUnknown::new_err(text),
            MachineError::Value { .. } => ValueRefused::new_err(text),
            MachineError::Drive(_) | MachineError::NotADrive { .. } | MachineError::Together { .. } => {
                DriveError::new_err(text)
            }
            _ => LexicanError::new_err(text),
        }
    }
}

impl Raise for AccessError {
    fn raise(self) -> PyErr {
        let text = self.to_string();
        of_access(self, text)
    }
}

impl Raise for LinkError {
    fn raise(self) -> PyErr {
        LinkFailed::new_err(self.to_string())
    }
}

impl Raise for SheetError {
    fn raise(self) -> PyErr {
        let remedy = self.remedy().map(|remedy| format!("; {remedy}")).unwrap_or_default();
        DataSheetError::new_err(format!("{self}{remedy}"))
    }
}

/// Adds what had been done by then to an exception: to the text of our own, or as a note to another one.
pub(crate) fn also(py: Python<'_>, error: PyErr, what: &str) -> PyErr {
    let value = error.value(py);
    let _ = match error.is_instance_of::<LexicanError>(py) {
        true => value.setattr("args", (format!("{value}; {what}"),)),
        // Notes exist from Python 3.11 on.
        false => value.call_method1("add_note", (what,)).map(drop),
    };
    error
}

/// The exception for an error of neither a device nor a bus.
pub(crate) fn wrong(what: impl ToString) -> PyErr {
    LexicanError::new_err(what.to_string())
}
