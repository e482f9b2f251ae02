//! The data sheet that a device has in it (CiA 301, objects 1021h and 1022h).

use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{AccessError, Link};
use lexican_runtime::object::Address;
use lexican_runtime::service::sdo_client::SdoError;
use lexican_runtime::{AbortCode, NodeId, cia301};

/// Where the data sheet is.
pub const SHEET: Address = Address::new(cia301::STORE_EDS, 0);
/// Where its form is.
pub const FORM: Address = Address::new(cia301::STORE_FORMAT, 0);
/// The form of a text that is not compressed. Others are the vendor's.
pub const TEXT: u8 = 0;

/// In which form a node has its data sheet; `None` if it has none.
pub fn form<L: Link>(network: &mut Network<L>, node: NodeId) -> Result<Option<u8>, AccessError> {
    match network.read_bytes(node, FORM) {
        Ok(data) => Ok(Some(data.first().copied().unwrap_or(TEXT))),
        Err(AccessError::Sdo { error: SdoError::Aborted { code: AbortCode::NO_SUCH_OBJECT, .. }, .. }) => Ok(None),
        Err(error) => Err(error),
    }
}
