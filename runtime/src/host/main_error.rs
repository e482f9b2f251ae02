//! The error of a program's `main`.

use core::fmt;
use std::boxed::Box;
use std::error::Error;

/// An error for a `main` that returns a `Result`: `?` converts any error into it. Rust prints the error of `main` by
/// `Debug`, which looks like code for most errors; this one prints its message.
///
/// ```
/// use lexican_runtime::host::MainError;
///
/// fn node() -> Result<lexican_runtime::NodeId, MainError> {
///     Ok(lexican_runtime::NodeId::try_from(200)?)
/// }
/// # let words = format!("{:?}", node().unwrap_err());
/// # assert!(words.contains("127") && !words.contains('{'), "{words}");
/// ```
pub struct MainError(Box<dyn Error>);

impl<E: Into<Box<dyn Error>>> From<E> for MainError {
    fn from(error: E) -> Self {
        MainError(error.into())
    }
}

impl fmt::Debug for MainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, f)
    }
}
