//! Parameters that statements are about.

/// Faster by so many rev/min each 100 ms.
pub(super) const A_POS: (u16, u8) = (0x2410, 0x04);
pub(super) const V_POS: (u16, u8) = (0x2410, 0x05);
pub(super) const A_ROT: (u16, u8) = (0x2410, 0x06);
pub(super) const A_INCH: (u16, u8) = (0x2410, 0x08);
pub(super) const V_INCH: (u16, u8) = (0x2410, 0x09);
pub(super) const D_POS: (u16, u8) = (0x2410, 0x0A);

pub(super) const fn one((index, sub): (u16, u8), value: i64) -> (u16, u8, i64, u8) {
    (index, sub, value, 1)
}
