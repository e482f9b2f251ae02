//! Identifiers from the names of a data sheet. The rules are frozen by `tests/names.rs`: whoever updates
//! lexican must not have to rename anything.

/// How an identifier is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Case {
    /// `MOTOR_SPEED`.
    Shouty,
    /// `motor_speed`.
    Snake,
    /// `MotorSpeed`.
    Pascal,
}

/// So many letters of a name become an identifier: rustdoc writes a file named after it, and 255 is the most that file
/// systems allow.
const MAX_LENGTH: usize = 200;

/// The identifier for a name; empty when the name has no letter and no digit.
pub(crate) fn identifier(name: &str, case: Case) -> String {
    let mut joined = join(&words(name), case);
    joined.truncate(MAX_LENGTH);
    joined.truncate(joined.trim_end_matches('_').len());
    if joined.starts_with(|c: char| c.is_ascii_digit()) {
        format!("_{joined}")
    } else if joined.is_empty() || syn::parse_str::<syn::Ident>(&joined).is_ok() && joined != "gen" {
        joined
    } else {
        // `gen` is a keyword since edition 2024; all others are asked of syn.
        format!("{joined}_")
    }
}

/// Appends `suffix`, which is made of lower-case words.
pub(crate) fn with_suffix(identifier: &str, suffix: &str, case: Case) -> String {
    // With a suffix it is no keyword any more, and two underscores are no snake case.
    let identifier = identifier.trim_end_matches('_');
    match case {
        Case::Shouty => format!("{identifier}_{}", suffix.to_uppercase()),
        Case::Snake => format!("{identifier}_{suffix}"),
        // A digit in front of a digit needs the separator: `Mode2_6040` is not `Mode26040`.
        Case::Pascal => {
            let digits_meet =
                identifier.ends_with(|c: char| c.is_ascii_digit()) && suffix.starts_with(|c: char| c.is_ascii_digit());
            let separator = if digits_meet { "_" } else { "" };
            format!("{identifier}{separator}{}", join(&words(suffix), case))
        }
    }
}

/// Words end at whatever is neither letter nor digit, and where an upper-case letter follows a lower-case one.
fn words(name: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut word = String::new();
    let mut after_lower = false;
    for c in name.chars() {
        let plain = plain(c);
        let starts_upper = c.is_uppercase();
        if plain.is_empty() || (after_lower && starts_upper) {
            words.extend((!word.is_empty()).then(|| std::mem::take(&mut word)));
        }
        word.push_str(&plain);
        after_lower = c.is_lowercase() && !plain.is_empty();
    }
    words.extend((!word.is_empty()).then_some(word));
    words
}

fn join(words: &[String], case: Case) -> String {
    match case {
        Case::Shouty => words.join("_").to_ascii_uppercase(),
        Case::Snake => words.join("_").to_ascii_lowercase(),
        Case::Pascal => words.iter().fold(String::new(), |joined, word| {
            let digits_meet =
                joined.ends_with(|c: char| c.is_ascii_digit()) && word.starts_with(|c: char| c.is_ascii_digit());
            let (first, rest) = word.split_at(1);
            format!(
                "{joined}{}{}{}",
                if digits_meet { "_" } else { "" },
                first.to_ascii_uppercase(),
                rest.to_ascii_lowercase()
            )
        }),
    }
}

/// A letter or digit in ASCII, as people write it who have no other; empty for anything else.
fn plain(c: char) -> String {
    let letters = match c {
        'a'..='z' | 'A'..='Z' | '0'..='9' => return c.to_string(),
        'ä' | 'Ä' | 'æ' | 'Æ' => "ae",
        'ö' | 'Ö' | 'ø' | 'Ø' | 'œ' | 'Œ' => "oe",
        'ü' | 'Ü' => "ue",
        'å' | 'Å' => "aa",
        'ß' => "ss",
        '\u{B5}' | '\u{3BC}' => "u",
        '\u{2126}' | '\u{03A9}' => "ohm",
        'À'..='Ã' | 'à'..='ã' => "a",
        'Ç' | 'ç' => "c",
        'È'..='Ë' | 'è'..='ë' => "e",
        'Ì'..='Ï' | 'ì'..='ï' => "i",
        'Ñ' | 'ñ' => "n",
        'Ò'..='Õ' | 'ò'..='õ' => "o",
        'Ù'..='Û' | 'ù'..='û' => "u",
        'Ý' | 'ý' | 'ÿ' => "y",
        _ => "",
    };
    letters.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(name: &str, shouty: &str, snake: &str, pascal: &str) {
        let got = [Case::Shouty, Case::Snake, Case::Pascal].map(|case| identifier(name, case));
        assert_eq!(got, [shouty, snake, pascal], "{name}");
    }

    #[test]
    fn words_split_where_the_rules_say() {
        check("Controlword", "CONTROLWORD", "controlword", "Controlword");
        check("COB-ID SYNC message", "COB_ID_SYNC_MESSAGE", "cob_id_sync_message", "CobIdSyncMessage");
        check("v - Pos", "V_POS", "v_pos", "VPos");
        check("ü – Denominator", "UE_DENOMINATOR", "ue_denominator", "UeDenominator");
        check("motorTemperature [0.1°C]", "MOTOR_TEMPERATURE_0_1_C", "motor_temperature_0_1_c", "MotorTemperature0_1C");
        check("Größe in µm", "GROESSE_IN_UM", "groesse_in_um", "GroesseInUm");
        check("Ch1Value", "CH1VALUE", "ch1value", "Ch1value");
        check("NMTError", "NMTERROR", "nmterror", "Nmterror");
    }

    #[test]
    fn a_suffix_stands_where_a_keyword_had_its_underscore() {
        assert_eq!(with_suffix(&identifier("self", Case::Snake), "3000_02", Case::Snake), "self_3000_02");
        assert_eq!(with_suffix(&identifier("self", Case::Pascal), "3000", Case::Pascal), "Self3000");
        assert_eq!(with_suffix(&identifier("mode 2", Case::Pascal), "6040", Case::Pascal), "Mode2_6040");
        assert_eq!(with_suffix(&identifier("mode 2", Case::Pascal), "values", Case::Pascal), "Mode2Values");
        assert_eq!(with_suffix(&identifier("2nd", Case::Shouty), "3000", Case::Shouty), "_2ND_3000");
    }

    #[test]
    fn no_identifier_is_too_long_for_a_file_name() {
        let letters = "x".repeat(MAX_LENGTH);
        check(&format!("{letters}yz"), &letters.to_uppercase(), &letters, &format!("X{}", &letters[1..]));
        assert_eq!(identifier(&"abc ".repeat(99), Case::Snake).len(), MAX_LENGTH - 1);
    }

    #[test]
    fn what_rust_does_not_allow_is_mended() {
        check("2nd gear", "_2ND_GEAR", "_2nd_gear", "_2ndGear");
        check("type", "TYPE", "type_", "Type");
        check("self", "SELF", "self_", "Self_");
        check("gen", "GEN", "gen_", "Gen");
        check("???", "", "", "");
        check("位置", "", "", "");
    }

    /// Names as real data sheets have them. A line that must change breaks the code of whoever updates.
    #[test]
    fn the_identifiers_of_200_real_names_never_change() {
        let table = include_str!("../tests/names.tsv");
        assert_eq!(table.lines().count(), 200);
        for line in table.lines() {
            let [name, shouty, snake, pascal] = line.split('\t').collect::<Vec<_>>()[..] else {
                panic!("four columns: {line}")
            };
            check(name, shouty, snake, pascal);
        }
    }

    proptest! {
        #[test]
        fn every_name_becomes_a_valid_identifier_or_nothing(name in "\\PC{0,24}") {
            for case in [Case::Shouty, Case::Snake, Case::Pascal] {
                let identifier = identifier(&name, case);
                prop_assert!(identifier.is_empty() || syn::parse_str::<syn::Ident>(&identifier).is_ok(), "{}", identifier);
                prop_assert!(!identifier.contains("__"));
            }
        }

        #[test]
        fn snake_and_shouty_are_idempotent(name in "\\PC{0,24}") {
            for case in [Case::Shouty, Case::Snake] {
                let once = identifier(&name, case);
                prop_assert_eq!(identifier(once.trim_end_matches('_'), case), once);
            }
        }
    }
}
