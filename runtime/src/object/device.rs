//! Which device an object is of, as a type: a handle of another device does not compile.

use super::{AnyDevice, Name};

/// A device whose dictionary is known. Generated code has one, `DEVICE`, and marks its handles by the type of it.
///
/// A table of names is one too, of which only names are known: those of a data sheet that is read at run time.
pub trait DeviceModel {
    /// The names of all entries, ascending by address; none if they were not generated
    /// (`lexican_codegen::Config::names`).
    fn names(&self) -> &'static [Name] {
        &[]
    }
}

impl DeviceModel for &'static [Name] {
    fn names(&self) -> &'static [Name] {
        self
    }
}

/// Handles that fit a device: its own, and those that were written by hand. All handles fit [`AnyDevice`].
#[diagnostic::on_unimplemented(
    message = "this object is not one of the node's device",
    label = "an object of `{Self}`, and the node is a `{D}`",
    note = "the handle comes from the dictionary of another device: take the one of the dictionary that the node is bound to"
)]
pub trait Fits<D> {}

impl<D: DeviceModel> Fits<D> for D {}
impl<D: DeviceModel> Fits<D> for AnyDevice {}
impl<E> Fits<AnyDevice> for E {}

/// Devices whose handles may stand in one mapping: the same one, or one and [`AnyDevice`].
#[diagnostic::on_unimplemented(
    message = "a PDO maps objects of one device",
    label = "an object of `{E}` in a mapping of `{Self}`",
    note = "the handles come from the dictionaries of two devices"
)]
pub trait Joins<E> {
    /// The device of both.
    type Device;
}

impl<D: DeviceModel> Joins<D> for D {
    type Device = D;
}
impl<D: DeviceModel> Joins<AnyDevice> for D {
    type Device = D;
}
impl<D: DeviceModel> Joins<D> for AnyDevice {
    type Device = D;
}
impl Joins<AnyDevice> for AnyDevice {
    type Device = AnyDevice;
}
