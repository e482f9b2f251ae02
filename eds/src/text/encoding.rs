//! The encodings of data sheets.

/// The encoding of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// UTF-8 (or ASCII).
    Utf8,
    /// UTF-8 with a byte order mark.
    Utf8WithMark,
    /// UTF-16, little-endian.
    Utf16Le {
        /// Whether the file begins with a byte order mark.
        mark: bool,
    },
    /// UTF-16, big-endian.
    Utf16Be {
        /// Whether the file begins with a byte order mark.
        mark: bool,
    },
    /// Windows code page 1252: the bytes are not UTF-8.
    Windows1252,
    /// DOS code page 437: in code page 1252, symbols would stand within words.
    CodePage437,
    /// Code page 850 of DOS, for the same reason.
    CodePage850,
}

impl Encoding {
    /// The usual name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Utf8 => "UTF-8",
            Self::Utf8WithMark => "UTF-8 with a byte order mark",
            Self::Utf16Le { .. } | Self::Utf16Be { .. } => "UTF-16",
            Self::Windows1252 => "code page 1252",
            Self::CodePage437 => "code page 437",
            Self::CodePage850 => "code page 850",
        }
    }

    /// Encodes a text; `None` if the encoding lacks one of the characters.
    #[must_use]
    pub fn encode(self, text: &str) -> Option<Vec<u8>> {
        let utf_16 = |mark: bool, bytes: fn(u16) -> [u8; 2]| {
            let mark = mark.then_some(0xFEFF);
            Some(mark.into_iter().chain(text.encode_utf16()).flat_map(bytes).collect())
        };
        match self {
            Self::Utf8 => Some(text.as_bytes().to_vec()),
            Self::Utf8WithMark => Some([b"\xEF\xBB\xBF", text.as_bytes()].concat()),
            Self::Utf16Le { mark } => utf_16(mark, u16::to_le_bytes),
            Self::Utf16Be { mark } => utf_16(mark, u16::to_be_bytes),
            Self::Windows1252 | Self::CodePage437 | Self::CodePage850 => {
                let high = |letter: char| self.high().position(|known| known == letter).map(|at| at as u8 + 0x80);
                let byte = |letter: char| u8::try_from(letter).ok().filter(u8::is_ascii).or_else(|| high(letter));
                text.chars().map(byte).collect()
            }
        }
    }

    /// The characters for the bytes from 80h on.
    fn high(self) -> impl Iterator<Item = char> {
        let table = match self {
            Self::CodePage437 => CODE_PAGE_437,
            Self::CodePage850 => CODE_PAGE_850,
            _ => WINDOWS_1252,
        };
        // From A0h on, code page 1252 equals Unicode.
        table.chars().chain('\u{A0}'..='\u{FF}').take(0x80)
    }
}

/// 80h to 9Fh; the five undefined bytes are C1 controls, as in browsers.
const WINDOWS_1252: &str = "€\u{81}‚ƒ„…†‡ˆ‰Š‹Œ\u{8D}Ž\u{8F}\u{90}‘’“”•–—˜™š›œ\u{9D}žŸ";

const CODE_PAGE_437: &str = "ÇüéâäàåçêëèïîìÄÅÉæÆôöòûùÿÖÜ¢£¥₧ƒáíóúñÑªº¿⌐¬½¼¡«»░▒▓│┤╡╢╖╕╣║╗╝╜╛┐└┴┬├─┼╞╟╚╔╩╦╠═╬╧╨╤╥╙╘╒╓╫╪┘┌█▄▌▐▀αßΓπΣσµτΦΘΩδ∞φε∩≡±≥≤⌠⌡÷≈°∙·√ⁿ²■\u{A0}";

const CODE_PAGE_850: &str = "ÇüéâäàåçêëèïîìÄÅÉæÆôöòûùÿÖÜø£Ø×ƒáíóúñÑªº¿®¬½¼¡«»░▒▓│┤ÁÂÀ©╣║╗╝¢¥┐└┴┬├─┼ãÃ╚╔╩╦╠═╬¤ðÐÊËÈıÍÎÏ┘┌█▄¦Ì▀ÓßÔÒõÕµþÞÚÛÙýÝ¯´\u{AD}±‗¾¶§÷¸°¨·¹³²■\u{A0}";

/// Decodes the bytes of a file.
pub(super) fn decode(bytes: &[u8]) -> (String, Encoding) {
    let (le, be) = (|mark| Encoding::Utf16Le { mark }, |mark| Encoding::Utf16Be { mark });
    match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => match str::from_utf8(rest) {
            Ok(text) => (text.to_owned(), Encoding::Utf8WithMark),
            Err(_) => code_page(rest),
        },
        [0xFF, 0xFE, rest @ ..] => (utf_16(rest, u16::from_le_bytes), le(true)),
        [0xFE, 0xFF, rest @ ..] => (utf_16(rest, u16::from_be_bytes), be(true)),
        // A data sheet begins with ASCII: a bracket of INI or XML, a comment, a blank or an empty line.
        [b'[' | b'<' | b';' | b'#' | b' ' | b'\r' | b'\n', 0, _, 0, ..] => {
            (utf_16(bytes, u16::from_le_bytes), le(false))
        }
        [0, b'[' | b'<' | b';' | b'#' | b' ' | b'\r' | b'\n', 0, _, ..] => {
            (utf_16(bytes, u16::from_be_bytes), be(false))
        }
        _ => match str::from_utf8(bytes) {
            Ok(text) => (text.to_owned(), Encoding::Utf8),
            Err(_) => code_page(bytes),
        },
    }
}

fn utf_16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

fn code_page(bytes: &[u8]) -> (String, Encoding) {
    let encoding = which_code_page(bytes);
    let high: Vec<char> = encoding.high().collect();
    let character = |&byte: &u8| if byte.is_ascii() { char::from(byte) } else { high[usize::from(byte - 0x80)] };
    (bytes.iter().map(character).collect(), encoding)
}

/// Code page 1252, unless it gives a character that does not occur within words: a low or closing quotation mark, a
/// dagger or a control. In the DOS code pages, these bytes are letters with umlauts and accents.
fn which_code_page(bytes: &[u8]) -> Encoding {
    let is_letter = |byte: u8| byte.is_ascii_alphabetic() || !byte.is_ascii();
    let within_word = |bytes: &&[u8]| is_letter(bytes[0]) && is_letter(bytes[2]) && (bytes[0] & bytes[2]).is_ascii();
    let middle = || bytes.windows(3).filter(within_word).map(|bytes| bytes[1]);
    // `’`, `–` and the like do occur between letters.
    let is_nonsense =
        |byte: u8| matches!(byte, 0x81 | 0x82 | 0x84 | 0x86..=0x88 | 0x8B | 0x8D | 0x8F | 0x90 | 0x94 | 0x98 | 0x9D);
    if !middle().any(is_nonsense) {
        return Encoding::Windows1252;
    }
    // Where the two DOS code pages differ, the only letters of 437 are Greek ones, which stand alone.
    let differs = |byte: u8| {
        let at = |encoding: Encoding| encoding.high().nth(usize::from(byte & 0x7F));
        byte >= 0x80 && at(Encoding::CodePage437) != at(Encoding::CodePage850)
    };
    let is_greek = |byte: u8| differs(byte) && matches!(byte, 0xE0..=0xEE);
    if bytes.iter().any(|&byte| is_greek(byte)) && !middle().any(differs) {
        return Encoding::CodePage437;
    }
    Encoding::CodePage850
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(bytes: &[u8], text: &str, encoding: Encoding) {
        assert_eq!(decode(bytes), (text.to_owned(), encoding));
        assert_eq!(encoding.encode(text).as_deref(), Some(bytes), "{text:?} in {encoding:?}");
    }

    #[test]
    fn bytes_are_read_in_the_encoding_they_are_in_and_come_back() {
        check("°C".as_bytes(), "°C", Encoding::Utf8);
        check(b"\xEF\xBB\xBF[FileInfo]", "[FileInfo]", Encoding::Utf8WithMark);
        check(b"\xB0C \x93x\x94 \x80", "°C “x” €", Encoding::Windows1252);
        check(b"drive\x92s A\x96B", "drive’s A–B", Encoding::Windows1252);
        check(b"St\xF6rung", "Störung", Encoding::Windows1252);
        check(b"St\x94rung \x81ber 5 \xF8C", "Störung über 5 °C", Encoding::CodePage850);
        check(b"Gr\x94\xE1e in m\xFC", "Größe in m³", Encoding::CodePage850);
        check(b"Gr\x94\xE1e in \xEA", "Größe in Ω", Encoding::CodePage437);
        check(b"\xFF\xFE[\0]\0", "[]", Encoding::Utf16Le { mark: true });
        check(b"\xFE\xFF\0[\0]", "[]", Encoding::Utf16Be { mark: true });
        check(b"[\0\xE4\0]\0", "[ä]", Encoding::Utf16Le { mark: false });
        check(b"\0[\0a\0]", "[a]", Encoding::Utf16Be { mark: false });
        check(b"", "", Encoding::Utf8);
    }

    #[test]
    fn every_byte_of_a_code_page_is_a_character_of_its_own() {
        for page in [Encoding::Windows1252, Encoding::CodePage437, Encoding::CodePage850] {
            let high: Vec<char> = page.high().collect();
            let distinct: std::collections::BTreeSet<_> = high.iter().collect();
            assert_eq!((high.len(), distinct.len()), (128, 128), "{page:?}");
        }
        assert_eq!(Encoding::CodePage850.encode("Ω"), None);
    }
}
