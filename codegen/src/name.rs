//! Identifiers made from the names in a data sheet. `tests/names.tsv` freezes the rules, so that updating lexican
//! renames nothing.

use lexican_eds::model::Object;

/// The spelling of an identifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Case {
    /// `MOTOR_SPEED`.
    Shouty,
    /// `motor_speed`.
    Snake,
    /// `MotorSpeed`.
    Pascal,
}

/// The keywords of all editions of Rust, reserved ones included.
#[rustfmt::skip]
const KEYWORDS: [&str; 52] = [
    "Self", "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do", "dyn", "else",
    "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop", "macro", "match", "mod", "move",
    "mut", "override", "priv", "pub", "ref", "return", "self", "static", "struct", "super", "trait", "true", "try", "type",
    "typeof", "unsafe", "unsized", "use", "virtual", "where", "while", "yield",
];

/// The longest identifier in snake case, not counting underscores that Rust requires.
const MAX_LENGTH: usize = 60;

/// The identifier for a name; empty if the name has neither letter nor digit.
pub(crate) fn identifier(name: &str, case: Case) -> String {
    let joined = join(&short_words(name), case);
    if joined.starts_with(|c: char| c.is_ascii_digit()) {
        format!("_{joined}")
    } else if KEYWORDS.contains(&&*joined) {
        format!("{joined}_")
    } else {
        joined
    }
}

/// Whether it is a Rust path, such as `::lexican_runtime` or `crate::bus`.
pub(crate) fn is_path(path: &str) -> bool {
    let is_letter = |c: char| c.is_alphabetic() || c == '_';
    path.strip_prefix("::").unwrap_or(path).split("::").all(|name| {
        name != "_"
            && name.starts_with(is_letter)
            && name.chars().all(|c| is_letter(c) || c.is_numeric())
            && (["crate", "self", "super"].contains(&name) || !KEYWORDS.contains(&name))
    })
}

/// Appends `suffix`, which consists of lower-case words.
pub(crate) fn with_suffix(identifier: &str, suffix: &str, case: Case) -> String {
    // With a suffix it is no longer a keyword, and snake case has no double underscores.
    let identifier = identifier.trim_end_matches('_');
    match case {
        Case::Shouty => format!("{identifier}_{}", suffix.to_uppercase()),
        Case::Snake => format!("{identifier}_{suffix}"),
        Case::Pascal => format!("{identifier}{}{}", between(identifier, suffix), join(&words(suffix), case)),
    }
}

/// The words of a name. If they exceed [`MAX_LENGTH`], remarks in brackets are dropped first, then words before the
/// last one, which is often the number of an element. The result depends on the name alone, so adding objects does not
/// change it.
fn short_words(name: &str) -> Vec<String> {
    let all = words(name);
    if length(&all) <= MAX_LENGTH {
        return all;
    }
    let outside = words(&outside_brackets(name));
    let mut words = if outside.is_empty() { all } else { outside };
    while length(&words) > MAX_LENGTH && words.len() > 1 {
        words.remove(words.len() - 2);
    }
    if let [only] = words.as_mut_slice() {
        only.truncate(MAX_LENGTH);
    }
    words
}

/// The length in snake case.
fn length(words: &[String]) -> usize {
    words.iter().map(|word| word.len() + 1).sum::<usize>().saturating_sub(1)
}

/// The name with a blank in place of each text in brackets. An unmatched opening bracket does not count.
fn outside_brackets(name: &str) -> String {
    let mut outside = String::new();
    let mut rest = name;
    while let Some((before, after)) = rest.split_once('(') {
        let mut depth = 1;
        let end = after.char_indices().find(|(_, c)| {
            depth += i32::from(*c == '(') - i32::from(*c == ')');
            depth == 0
        });
        let Some((end, _)) = end else { break };
        outside.push_str(before);
        outside.push(' ');
        rest = &after[end + 1..];
    }
    outside + rest
}

/// Words end at a character that is neither letter nor digit, and where an upper-case letter follows a lower-case one.
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
            let (first, rest) = word.split_at(1);
            let first = first.to_ascii_uppercase();
            format!("{joined}{}{first}{}", between(&joined, word), rest.to_ascii_lowercase())
        }),
    }
}

/// The separator of words in Pascal case: an underscore between digits, so that `Mode2_6040` is not `Mode26040`.
fn between(before: &str, after: &str) -> &'static str {
    let is_digit = |c: char| c.is_ascii_digit();
    if before.ends_with(is_digit) && after.starts_with(is_digit) { "_" } else { "" }
}

/// The usual ASCII spelling of a letter or digit; empty for anything else.
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

/// The suffix for an address: `2410_01`, or `2410` for an object with one value.
pub(crate) fn address_suffix(object: &Object, sub: Option<u8>) -> String {
    match sub {
        Some(sub) => format!("{:04x}_{sub:02x}", object.index),
        None => format!("{:04x}", object.index),
    }
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
    fn names_are_split_into_words() {
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
    fn a_suffix_replaces_the_underscore_of_a_keyword() {
        assert_eq!(with_suffix(&identifier("self", Case::Snake), "3000_02", Case::Snake), "self_3000_02");
        assert_eq!(with_suffix(&identifier("self", Case::Pascal), "3000", Case::Pascal), "Self3000");
        assert_eq!(with_suffix(&identifier("mode 2", Case::Pascal), "6040", Case::Pascal), "Mode2_6040");
        assert_eq!(with_suffix(&identifier("mode 2", Case::Pascal), "values", Case::Pascal), "Mode2Values");
        assert_eq!(with_suffix(&identifier("2nd", Case::Shouty), "3000", Case::Shouty), "_2ND_3000");
    }

    #[test]
    fn a_long_name_loses_its_remarks_first_and_its_middle_next() {
        let snake = |name, expected| assert_eq!(identifier(name, Case::Snake), expected);
        snake(
            "Analog output 6 error mode (output goes to value in 6C44h (if any) if CAN is lost)",
            "analog_output_6_error_mode",
        );
        snake(
            "Motor power limit map (for auto-config additional motor)",
            "motor_power_limit_map_for_auto_config_additional_motor",
        );
        snake(
            "Additional position encoder resolution - encoder increments feedback interface #2",
            "additional_position_encoder_resolution_encoder_increments_2",
        );
        snake(
            "(only a remark that is longer than sixty letters, and nothing else)",
            "only_a_remark_that_is_longer_than_sixty_letters_and_else",
        );
        snake(
            "Velocity demand value (after the profile acceleration rate was applied",
            "velocity_demand_value_after_the_profile_acceleration_applied",
        );
        let letters = "x".repeat(MAX_LENGTH);
        check(&format!("{letters}yz"), &letters.to_uppercase(), &letters, &format!("X{}", &letters[1..]));
        let words = "abc ".repeat(99);
        check(&words, &"ABC_".repeat(15)[..59], &"abc_".repeat(15)[..59], &"Abc".repeat(15));
    }

    #[test]
    fn a_name_that_rust_does_not_allow_is_changed() {
        check("2nd gear", "_2ND_GEAR", "_2nd_gear", "_2ndGear");
        check("type", "TYPE", "type_", "Type");
        check("self", "SELF", "self_", "Self_");
        check("gen", "GEN", "gen_", "Gen");
        check("???", "", "", "");
        check("位置", "", "", "");
    }

    /// Names from real data sheets. Changing a line breaks the code of users who update.
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

    #[test]
    fn a_keyword_is_no_identifier_and_a_path_has_none() {
        let refused = KEYWORDS.iter().filter(|word| syn::parse_str::<syn::Ident>(word).is_err());
        // syn does not know the keyword of edition 2024 yet.
        assert_eq!(refused.count(), KEYWORDS.len() - 1);
        assert_eq!(identifier("gen", Case::Snake), "gen_");
        for path in
            ["::lexican_runtime", "crate::bus", "super::a_1", "x", "", "::", "a b", "a::", "1a", "fn", "a::fn", "a::b;"]
        {
            assert_eq!(is_path(path), syn::parse_str::<syn::Path>(path).is_ok(), "{path}");
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
