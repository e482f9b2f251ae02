//! Blanks and line breaks of the generated code: each row of tokens is laid out as rustfmt would.

use proc_macro2::{Delimiter, Spacing, TokenStream, TokenTree};

/// The longest line, unless a name is longer.
const WIDTH: usize = 120;

/// A type with parameters: `path<a, b>`.
pub(super) struct Generic {
    pub(super) path: TokenStream,
    pub(super) parameters: Vec<TokenStream>,
}

/// A call followed by method calls.
pub(super) struct Chain {
    pub(super) first: TokenStream,
    pub(super) methods: Vec<TokenStream>,
}

impl Generic {
    fn line(&self) -> String {
        let parameters: Vec<String> = self.parameters.iter().map(line).collect();
        format!("{}<{}>", line(&self.path), parameters.join(", "))
    }

    fn lines(&self, indent: &str) -> String {
        let parameters: String = self.parameters.iter().map(|it| format!("{indent}    {},\n", line(it))).collect();
        format!("{}<\n{parameters}{indent}>", line(&self.path))
    }
}

impl Chain {
    fn line(&self) -> String {
        line(&self.first) + &self.methods.iter().map(line).collect::<String>()
    }

    /// On one line if it fits, `beside` other characters included.
    fn lines(&self, beside: usize, indent: &str) -> String {
        let line = self.line();
        if beside + line.len() <= WIDTH {
            return line;
        }
        let methods = self.methods.iter().map(|method| format!("\n{indent}    {}", self::line(method)));
        self::line(&self.first) + &methods.collect::<String>()
    }
}

/// `pub const NAME: type = value;`
pub(super) fn constant(code: &mut String, name: &str, r#type: &Generic, value: &Chain) {
    let head = format!("pub const {name}: {}", r#type.line());
    if head.len() + value.line().len() + 4 <= WIDTH {
        *code += &format!("{head} = {};\n", value.line());
    } else if head.len() + 2 <= WIDTH {
        *code += &format!("{head} =\n    {};\n", value.lines(5, "    "));
    } else {
        *code += &format!("pub const {name}: {} = {};\n", r#type.lines(""), value.lines(5, ""));
    }
}

/// `pub const fn name(&self) -> type { value }`, indented by one step.
pub(super) fn member(code: &mut String, name: &str, r#type: &Generic, value: &Chain) {
    let line = format!("    pub const fn {name}(&self) -> {} {{\n", r#type.line());
    if line.len() <= WIDTH + 1 {
        *code += &line;
    } else {
        *code += &format!("    pub const fn {name}(&self) -> {} {{\n", r#type.lines("    "));
    }
    *code += &format!("        {}\n    }}\n", value.lines(8, "        "));
}

/// `&[ rows ]`, a line for each, closed at `indent`.
pub(super) fn rows(indent: &str, rows: impl IntoIterator<Item = String>) -> String {
    let mut text = String::from("&[");
    for row in rows {
        text.extend(["\n", indent, "    ", &row, ","]);
    }
    if text.len() > 2 {
        text.extend(["\n", indent]);
    }
    text + "]"
}

/// `b"..."`, continued on the next line when a line is full.
pub(super) fn bytes(bytes: &[u8], indent: &str) -> String {
    let mut lines = vec![String::new()];
    for (at, &byte) in bytes.iter().enumerate() {
        // Before a digit, `\0` would look like an octal number of C.
        let is_before_digit = bytes.get(at + 1).is_some_and(|next| matches!(next, b'0'..=b'7'));
        let escaped = match byte {
            0 if !is_before_digit => "\\0".to_owned(),
            _ => byte.escape_ascii().to_string(),
        };
        if lines.last().is_some_and(|line| indent.len() + line.len() + escaped.len() >= WIDTH) {
            lines.push(String::new());
        }
        // A continued line loses its leading blanks.
        let line = lines.last_mut().expect("there is a line");
        *line += if byte == b' ' && line.is_empty() { "\\x20" } else { &escaped };
    }
    match lines.as_slice() {
        [line] => format!("b\"{line}\""),
        _ => format!("b\"\\\n{indent}{}\"", lines.join(&format!("\\\n{indent}"))),
    }
}

pub(super) fn line(tokens: &TokenStream) -> String {
    let mut text = String::new();
    append(&mut text, tokens);
    text
}

fn append(text: &mut String, tokens: &TokenStream) {
    let mut operator = String::new();
    for token in tokens.clone() {
        match token {
            TokenTree::Punct(punct) => {
                operator.push(punct.as_char());
                if punct.spacing() == Spacing::Joint {
                    continue;
                }
                match std::mem::take(&mut operator).as_str() {
                    spaced @ ("=" | "+" | "/" | "->") => text.extend([" ", spaced, " "]),
                    separator @ ("," | ";" | ":") => text.extend([separator, " "]),
                    close => *text += close,
                }
            }
            TokenTree::Group(group) => {
                let (open, close) = match group.delimiter() {
                    Delimiter::Parenthesis => ("(", ")"),
                    Delimiter::Bracket => ("[", "]"),
                    Delimiter::Brace => (" { ", " }"),
                    Delimiter::None => ("", ""),
                };
                *text += open;
                append(text, &group.stream());
                *text += close;
            }
            word @ (TokenTree::Ident(_) | TokenTree::Literal(_)) => {
                if text.ends_with(|last: char| last.is_alphanumeric() || matches!(last, '_' | '"')) {
                    text.push(' ');
                }
                *text += &word.to_string();
            }
        }
    }
    text.truncate(text.trim_end().len());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zero_before_a_digit_is_no_octal_number() {
        assert_eq!(bytes(b"\0\x001\0\x008\0a", ""), r#"b"\0\x001\0\08\0a""#);
    }
}
