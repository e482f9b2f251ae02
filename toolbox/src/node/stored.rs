//! The data sheet that a device stores itself (CiA 301, 1021h and 1022h).

use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{AbortCode, NodeId, cia301};

/// The data sheet, 1021h.
pub const SHEET: Address = Address::new(cia301::STORE_EDS, 0);
/// The format of it, 1022h.
pub const FORM: Address = Address::new(cia301::STORE_FORMAT, 0);
/// Uncompressed text. Other formats are manufacturer-specific.
pub const TEXT: u8 = 0;

/// The format in which a node stores its data sheet; `None` if it stores none.
pub fn form<L: Link>(network: &mut Network<L>, node: NodeId) -> Result<Option<u8>, AccessError> {
    match network.read_bytes(node, FORM) {
        Ok(data) => Ok(Some(data.first().copied().unwrap_or(TEXT))),
        Err(AccessError::Sdo { error: SdoError::Aborted { code: AbortCode::NO_SUCH_OBJECT, .. }, .. }) => Ok(None),
        Err(error) => Err(error),
    }
}
