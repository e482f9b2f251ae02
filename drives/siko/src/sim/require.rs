//! Conditions of an order.

use crate::order::Refused;

pub(super) fn require(condition: bool, refused: Refused) -> Result<(), Refused> {
    if condition { Ok(()) } else { Err(refused) }
}
