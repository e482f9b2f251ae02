//! Drives (CiA 402). The id of each case begins with `402/`, and each needs [`Hazard::Motion`](crate::Hazard::Motion).

use crate::case::Case;

pub(crate) const CASES: &[Case] = &[];
