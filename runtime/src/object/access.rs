//! What may be done with an object, as types: a handle that lacks a right does not compile.

mod sealed {
    pub trait Sealed {}
}
use sealed::Sealed;

/// Read only (`ro`).
#[derive(Clone, Copy, Debug)]
pub enum Ro {}
/// Write only (`wo`).
#[derive(Clone, Copy, Debug)]
pub enum Wo {}
/// Read and write (`rw`, `rwr`, `rww`).
#[derive(Clone, Copy, Debug)]
pub enum Rw {}
/// Read only, and never changing (`const`).
#[derive(Clone, Copy, Debug)]
pub enum Const {}

/// Access rights that include reading.
#[diagnostic::on_unimplemented(
    message = "the EDS does not allow reading this object",
    label = "this object is write-only (`wo`)",
    note = "if the device does allow it, correct its data sheet with an overlay: access = \"rw\""
)]
pub trait Readable: Sealed {}
/// Access rights that include writing.
#[diagnostic::on_unimplemented(
    message = "the EDS does not allow writing this object",
    label = "this object is read-only (`ro` or `const`)",
    note = "if the device does allow it, correct its data sheet with an overlay: access = \"rw\""
)]
pub trait Writable: Sealed {}

impl Sealed for Ro {}
impl Sealed for Wo {}
impl Sealed for Rw {}
impl Sealed for Const {}
impl Readable for Ro {}
impl Readable for Rw {}
impl Readable for Const {}
impl Writable for Wo {}
impl Writable for Rw {}

/// Not mappable into any PDO (`PDOMapping=0`).
#[derive(Clone, Copy, Debug)]
pub enum Unmapped {}
/// Mappable into a PDO that the device transmits.
#[derive(Clone, Copy, Debug)]
pub enum Tpdo {}
/// Mappable into a PDO that the device receives.
#[derive(Clone, Copy, Debug)]
pub enum Rpdo {}
/// Mappable into PDOs of both directions.
#[derive(Clone, Copy, Debug)]
pub enum Mappable {}

/// The mark of a handle that was written by hand: of an object that many devices have. Generated handles have the mark
/// of their device instead.
#[derive(Clone, Copy, Debug)]
pub enum AnyDevice {}

/// May be mapped into a PDO that the device transmits.
#[diagnostic::on_unimplemented(
    message = "the EDS does not allow mapping this object into a transmit PDO",
    label = "`PDOMapping=0`, or an access right of the other direction",
    note = "if the device does allow it, correct its data sheet with an overlay: pdo_mapping = true"
)]
pub trait TpdoMappable: Sealed {}
/// May be mapped into a PDO that the device receives.
#[diagnostic::on_unimplemented(
    message = "the EDS does not allow mapping this object into a receive PDO",
    label = "`PDOMapping=0`, or an access right of the other direction",
    note = "if the device does allow it, correct its data sheet with an overlay: pdo_mapping = true"
)]
pub trait RpdoMappable: Sealed {}

impl Sealed for Unmapped {}
impl Sealed for Tpdo {}
impl Sealed for Rpdo {}
impl Sealed for Mappable {}
impl TpdoMappable for Tpdo {}
impl TpdoMappable for Mappable {}
impl RpdoMappable for Rpdo {}
impl RpdoMappable for Mappable {}
