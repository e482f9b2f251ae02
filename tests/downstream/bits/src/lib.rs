//! Values of every data type at every bit offset of a PDO are packed and unpacked without change.

#[cfg(test)]
mod tests {
    use lexican_runtime::object::{
        DataType, I24, I40, I48, I56, Pdo, TimeDifference, TimeOfDay, Type, U24, U40, U48, U56, Value,
    };

    mod od {
        lexican_runtime::include_od!("bits");
    }

    /// Patterns of bits: none, all, alternating, and a single one at either end.
    const PATTERNS: [u64; 8] =
        [0, u64::MAX, 0xAAAA_AAAA_AAAA_AAAA, 0x5555_5555_5555_5555, 1, 0x8000_0000_0000_0000, 0x0123_4567_89AB_CDEF, 2];

    /// The value of `bits` bits, widened to 64 bits one by one.
    fn widened(pattern: u64, bits: u32, signed: bool) -> u64 {
        let bit = |at: u32| (pattern >> at) & 1;
        let sign = if signed { bit(bits - 1) } else { 0 };
        (0..64).fold(0, |number, at| number | (if at < bits { bit(at) } else { sign }) << at)
    }

    fn check<P: Pdo, T: Value + PartialEq>(field: fn(&mut P) -> &mut T, low: u32, bits: u32) {
        for pattern in PATTERNS {
            let signed = T::DATA_TYPE.is_signed();
            let expected = T::from_raw(widened(pattern, bits, signed));
            // Unpacked from a frame whose other bits are all set.
            let inside = widened(pattern, bits, false) << low;
            let around = !(widened(u64::MAX, bits, false) << low);
            for frame in [inside, inside | around] {
                let mut pdo = P::from_raw(frame);
                let found = *field(&mut pdo);
                let same = found == expected || found.to_raw() == expected.to_raw();
                assert!(same, "{} of {bits} bits at {low}: {found:?}, not {expected:?}", T::DATA_TYPE);
            }
            // Packed into a frame that is otherwise empty.
            let mut pdo = P::from_raw(0);
            *field(&mut pdo) = expected;
            assert_eq!(pdo.to_raw() & !around, kept::<T>(inside, low), "{} of {bits} bits at {low}", T::DATA_TYPE);
            assert_eq!(pdo.to_raw() & around, 0, "{} of {bits} bits at {low} touches others", T::DATA_TYPE);
            // And by way of the bytes of a frame.
            let bytes = pdo.to_raw().to_le_bytes();
            let back = P::from_data(&bytes[..P::LENGTH]).expect("as many bytes as mapped");
            assert_eq!(back.to_raw(), pdo.to_raw());
        }
    }

    /// Four of the 48 bits of a time are reserved (CiA 301, 7.1.6.5).
    fn kept<T: Type>(inside: u64, low: u32) -> u64 {
        match T::DATA_TYPE {
            DataType::TimeOfDay | DataType::TimeDifference => inside & (0xFFFF_0FFF_FFFF << low),
            _ => inside,
        }
    }

    macro_rules! case {
        ($pdo:ty, $field:ident: $type:ty, $low:literal, $bits:literal) => {
            check::<$pdo, $type>(|pdo| &mut pdo.$field, $low, $bits);
        };
    }

    include!(concat!(env!("OUT_DIR"), "/cases.rs"));
}
