//! What an order needs.

use crate::order::Refused;

pub(super) fn require(condition: bool, refused: Refused) -> Result<(), Refused> {
    if condition { Ok(()) } else { Err(refused) }
}
