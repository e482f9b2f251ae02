//! Known deviations of a device.

/// A case that a device is known to fail: with which reason, and why it may.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Known {
    /// The [reason](crate::Verdict::reason) of the failure; `*` stands for any text. A case that fails for another
    /// reason counts as failed.
    pub seen: String,
    /// Why the device may deviate, such as a place in its manual.
    pub why: String,
}

impl Known {
    /// Whether `reason` matches [`seen`](Self::seen).
    #[must_use]
    pub fn is_seen_in(&self, reason: &str) -> bool {
        let mut parts = self.seen.split('*');
        let Some(mut rest) = parts.next().and_then(|head| reason.strip_prefix(head)) else { return false };
        let Some(tail) = parts.next_back() else { return rest.is_empty() };
        for part in parts {
            match rest.split_once(part) {
                Some((_, behind)) => rest = behind,
                None => return false,
            }
        }
        rest.ends_with(tail)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stands_for_any_text() {
        for (seen, reason, same) in [
            ("1000h is 5", "1000h is 5", true),
            ("1000h is 5", "1000h is 55", false),
            ("1000h is 5", "1000h", false),
            ("* is 5", "1000h is 5", true),
            ("1000h*", "1000h is 5", true),
            ("1000h*is*5", "1000h is 5", true),
            ("1000h*is*6", "1000h is 5", false),
            ("1000h*has*5", "1000h is 5", false),
            // No text serves twice.
            ("aba*aba", "aba", false),
            ("*aba*ba", "aba", false),
            ("*", "", true),
            ("", "", true),
            ("", "1000h", false),
        ] {
            let known = Known { seen: seen.to_owned(), why: String::new() };
            assert_eq!(known.is_seen_in(reason), same, "{seen:?} {reason:?}");
        }
    }
}
