//! Positions in a TOML text, even an unfinished one.

use std::ops::Range;

use toml_parser::Source;
use toml_parser::lexer::TokenKind as Token;

/// The tables and the key around an offset.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    /// From the outermost table on; for a value, including its key.
    pub(crate) path: Vec<String>,
    pub(crate) part: Part,
    /// The word at the offset, without quotes; empty between words.
    pub(crate) word: Range<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// The name of a table, between brackets.
    Header,
    Key,
    Value,
}

/// The tables and key around an offset; `None` in a comment.
pub(crate) fn place(text: &str, offset: usize) -> Option<Place> {
    let (mut header, mut key, mut part) = (Vec::new(), Vec::new(), Part::Key);
    // The keys of the surrounding tables and arrays; the flag is true for tables.
    let mut around: Vec<(Vec<String>, bool)> = Vec::new();
    let (mut line_begins, mut word) = (true, offset..offset);
    for token in Source::new(text).lex() {
        let (start, end) = (token.span().start(), token.span().end());
        let found = match token.kind() {
            Token::Atom => start..end,
            Token::BasicString | Token::LiteralString => {
                let is_closed = end > start + 1 && text.as_bytes()[start] == text.as_bytes()[end - 1];
                start + 1..end - usize::from(is_closed)
            }
            _ => start..start,
        };
        if !found.is_empty() || found.start > start {
            if (found.start..=found.end).contains(&offset) {
                word = found;
                break;
            }
            if part != Part::Value && end <= offset {
                key.push(text[found].to_owned());
            }
        }
        if start >= offset {
            break;
        }
        match token.kind() {
            Token::Comment if offset <= end => return None,
            // Lines of a multi-line value do not begin with a bracket, but an unfinished value may be followed by a
            // table.
            Token::LeftSquareBracket if line_begins => {
                (around, header, key, part) = (Vec::new(), Vec::new(), Vec::new(), Part::Header);
            }
            Token::RightSquareBracket if part == Part::Header => header.append(&mut key),
            Token::LeftSquareBracket if part == Part::Value => around.push((std::mem::take(&mut key), false)),
            Token::LeftCurlyBracket => {
                around.push((std::mem::take(&mut key), true));
                part = Part::Key;
            }
            Token::RightSquareBracket | Token::RightCurlyBracket => {
                key = around.pop().map_or_else(Vec::new, |(key, _)| key);
                part = Part::Value;
            }
            Token::Comma if around.last().is_some_and(|(_, is_table)| *is_table) => {
                (key, part) = (Vec::new(), Part::Key);
            }
            Token::Equals => part = Part::Value,
            Token::Newline if around.is_empty() => (key, part) = (Vec::new(), Part::Key),
            _ => {}
        }
        line_begins = token.kind() == Token::Newline;
    }
    let path = [&[header], &around.into_iter().map(|(key, _)| key).collect::<Vec<_>>()[..], &[key]].concat();
    Some(Place { path: path.concat(), part, word })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `path part word` for the position of the bar in the text.
    fn at_bar(text: &str) -> String {
        let offset = text.find('|').unwrap();
        let text = text.replace('|', "");
        place(&text, offset).map_or_else(String::new, |place| {
            format!("{} {:?} {}", place.path.join("/"), place.part, &text[place.word])
        })
    }

    #[test]
    fn tables_and_keys_are_found_in_unfinished_texts() {
        for (text, expected) in [
            ("|", " Key "),
            ("[node.fee|der]", "node Header feeder"),
            ("[object.\"24|10:05\"]\n", "object Header 2410:05"),
            ("[node.feeder]\nsh|", "node/feeder Key sh"),
            ("[node.feeder]\nsheet = \"a|", "node/feeder/sheet Value a"),
            ("[node.a]\nsettings = { 6060 = \"x\", 24|", "node/a/settings Key 24"),
            ("[node.a]\nsettings = { 6060 = |", "node/a/settings/6060 Value "),
            ("[node.a]\ntpdo.1 = [\"6000:01\", \"60|\"]", "node/a/tpdo/1 Value 60"),
            ("[node.a]\ntpdo.1 = [\n  \"6000\",\n  |", "node/a/tpdo/1 Value "),
            ("[a]\nx = [ { y = 1 }, { z|", "a/x Key z"),
            ("[a]\nx = [\n[b]\ny|", "b Key y"),
            ("[[fault]]\naction = \"lo|se\"\n", "fault/action Value lose"),
            ("[wire]\n\"a.b\" = { to = [\"|\"] }", "wire/a.b/to Value "),
            ("a = 1 # see |", ""),
            ("a = 1\n|b = 2", " Key b"),
            ("x = \"ü\" |", "x Value "),
        ] {
            assert_eq!(at_bar(text), expected, "{text:?}");
        }
    }
}
