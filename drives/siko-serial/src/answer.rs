//! The answers of table 3: meaning to bytes, and bytes to meaning.

use crate::error::ErrorNumber;
use crate::telegram::{self, Telegram};

/// The form of the answer to an accepted command. A refusal, `?`, two digits and CR, can come instead of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// No answer.
    None,
    /// `>` and CR.
    Done,
    /// Eight characters, `>` and CR.
    Text,
    /// A sign, seven digits, `>` and CR.
    Long,
    /// Five digits, `>` and CR.
    Short,
    /// Two digits, `>` and CR.
    Count,
    /// Ten letters, `>` and CR.
    Letters,
    /// Two hexadecimal digits, `>` and CR.
    Flags,
    /// Four hexadecimal digits, `>` and CR.
    Status,
    /// A sign, three digits, `>` and CR.
    Velocity,
    /// Four bytes, the most significant one first, and `>`, without CR.
    Binary,
}

/// How received bytes read as an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// The beginning of an answer.
    Begun,
    /// A complete answer.
    Whole(Answer),
    /// No answer, whatever bytes follow.
    Foreign,
}

/// An answer of the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The command is carried out.
    Done,
    /// It is refused (table 4).
    Refused(ErrorNumber),
    /// To `A`.
    Text([u8; 8]),
    /// To `E` and `Z`.
    Long(i32),
    /// To `G`.
    Short(u32),
    /// To `J0`.
    Count(u8),
    /// To `J1`: the letters of table 2 in the order in which the faults came, padded with `-`.
    Letters([u8; 10]),
    /// To `Q`; see [`Flags`].
    Flags(Flags),
    /// To `R`: the system status word (table 1).
    Status(u16),
    /// To `V`: in rev/min.
    Velocity(i16),
    /// To `W`: the position.
    Binary(i32),
}

/// The flag register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flags(pub u8);

impl Flags {
    /// Bit 0: the sense of rotation is e.
    pub const SENSE_E: u8 = 1 << 0;
    /// Bit 1: loop +.
    pub const LOOP_POSITIVE: u8 = 1 << 1;
    /// Bit 2: loop -.
    pub const LOOP_NEGATIVE: u8 = 1 << 2;
    /// Bit 4: velocity mode.
    pub const VELOCITY: u8 = 1 << 4;
}

impl Answer {
    /// The bytes that the drive sends; `None` if a number has too many digits, or if the bytes would be read as a
    /// refusal.
    #[must_use]
    pub fn encode(self) -> Option<Telegram> {
        let begun = Telegram::default();
        let begun = match self {
            Answer::Refused(number) => return Some(begun.push(b"?").digits(number.get().into(), 2).push(b"\r")),
            Answer::Done => begun,
            Answer::Text(text) if text.iter().all(|byte| is_printable(*byte)) => begun.push(&text),
            Answer::Long(number) if number.unsigned_abs() <= 9_999_999 => begun.signed(number, 7),
            Answer::Short(number) if number <= 99_999 => begun.digits(number, 5),
            Answer::Count(count) if count <= 99 => begun.digits(count.into(), 2),
            Answer::Letters(letters) if letters.iter().all(|byte| is_printable(*byte)) => begun.push(&letters),
            Answer::Flags(Flags(bits)) => begun.hex(bits.into(), 2),
            Answer::Status(word) => begun.hex(word, 4),
            Answer::Velocity(velocity) if velocity.unsigned_abs() <= 999 => begun.signed(velocity.into(), 3),
            Answer::Binary(position) => begun.push(&position.to_be_bytes()),
            _ => return None,
        };
        let binary = matches!(self, Answer::Binary(_));
        let whole = begun.push(if binary { b">" } else { b">\r" });
        refusal(whole.as_bytes()).is_none().then_some(whole)
    }

    /// The answer, or the number of a refusal.
    pub fn accepted(self) -> Result<Answer, ErrorNumber> {
        match self {
            Answer::Refused(number) => Err(number),
            answer => Ok(answer),
        }
    }

    /// The number in the answer to `E`, `G`, `J0`, `V`, `W` or `Z`.
    #[must_use]
    pub fn number(self) -> Option<i32> {
        match self {
            Answer::Long(number) | Answer::Binary(number) => Some(number),
            Answer::Short(number) => i32::try_from(number).ok(),
            Answer::Count(count) => Some(count.into()),
            Answer::Velocity(velocity) => Some(velocity.into()),
            _ => None,
        }
    }
}

impl Reply {
    /// All of them.
    pub const ALL: &[Reply] = &[
        Reply::None,
        Reply::Done,
        Reply::Text,
        Reply::Long,
        Reply::Short,
        Reply::Count,
        Reply::Letters,
        Reply::Flags,
        Reply::Status,
        Reply::Velocity,
        Reply::Binary,
    ];

    /// The length of a refusal in bytes.
    pub const REFUSAL: usize = PATTERN.len();

    /// The length of the answer in bytes (table 3, column "Länge"; for `W` that column omits the position).
    #[must_use]
    pub const fn len(self) -> usize {
        match self {
            Reply::None => 0,
            Reply::Done => 2,
            Reply::Count | Reply::Flags => 4,
            Reply::Binary => 5,
            Reply::Status | Reply::Velocity => 6,
            Reply::Short => 7,
            Reply::Text | Reply::Long => 10,
            Reply::Letters => 12,
        }
    }

    /// Whether the command has no answer.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        matches!(self, Reply::None)
    }

    /// Reads `bytes` as an answer of this form.
    #[must_use]
    pub fn read(self, bytes: &[u8]) -> Reading {
        if let Some(number) = refusal(bytes) {
            return if bytes.len() == Self::REFUSAL {
                Reading::Whole(Answer::Refused(number))
            } else {
                Reading::Foreign
            };
        }
        let fits = bytes.len() <= self.len() && bytes.iter().enumerate().all(|(at, byte)| self.fits(at, *byte));
        if fits && bytes.len() == self.len() {
            return self.read_whole(bytes);
        }
        // Whether the bytes begin a refusal; a complete one has been handled above.
        let refuses = bytes.iter().zip(PATTERN).all(|(byte, like)| match like {
            b'0' => byte.is_ascii_digit(),
            _ => byte == like,
        });
        if fits || refuses { Reading::Begun } else { Reading::Foreign }
    }

    /// Whether the byte is possible at a place of the answer.
    fn fits(self, at: usize, byte: u8) -> bool {
        match (self, self.len() - at) {
            (Reply::Binary, 1) => byte == b'>',
            (Reply::Binary, _) => true,
            (_, 1) => byte == b'\r',
            (_, 2) => byte == b'>',
            (Reply::Long | Reply::Velocity, _) if at == 0 => matches!(byte, b'+' | b'-'),
            (Reply::Long | Reply::Velocity | Reply::Short | Reply::Count, _) => byte.is_ascii_digit(),
            (Reply::Flags | Reply::Status, _) => byte.is_ascii_hexdigit(),
            (Reply::Text | Reply::Letters, _) => is_printable(byte),
            (Reply::None | Reply::Done, _) => false,
        }
    }

    fn read_whole(self, bytes: &[u8]) -> Reading {
        let payload = bytes.strip_suffix(if self == Reply::Binary { &b">"[..] } else { b">\r" });
        let answer = payload.and_then(|payload| self.answer(payload));
        answer.map_or(Reading::Foreign, Reading::Whole)
    }

    fn answer(self, payload: &[u8]) -> Option<Answer> {
        let printable = payload.iter().all(|byte| is_printable(*byte));
        match self {
            Reply::None => None,
            Reply::Done => payload.is_empty().then_some(Answer::Done),
            Reply::Text => payload.try_into().ok().filter(|_| printable).map(Answer::Text),
            Reply::Letters => payload.try_into().ok().filter(|_| printable).map(Answer::Letters),
            Reply::Long => telegram::signed(payload).map(Answer::Long),
            Reply::Short => telegram::decimal(payload).map(Answer::Short),
            Reply::Count => telegram::decimal(payload)?.try_into().ok().map(Answer::Count),
            Reply::Flags => telegram::hexadecimal(payload)?.try_into().ok().map(|bits| Answer::Flags(Flags(bits))),
            Reply::Status => telegram::hexadecimal(payload).map(Answer::Status),
            Reply::Velocity => telegram::signed(payload)?.try_into().ok().map(Answer::Velocity),
            Reply::Binary => payload.try_into().ok().map(i32::from_be_bytes).map(Answer::Binary),
        }
    }
}

/// A refusal, with any two digits.
const PATTERN: &[u8; 4] = b"?00\r";

/// The refusal at the beginning of the bytes. A position of `W` that looks like one would be about a thousand million,
/// which no drive has.
fn refusal(bytes: &[u8]) -> Option<ErrorNumber> {
    let &[b'?', ref digits @ .., b'\r'] = bytes.get(..Reply::REFUSAL)? else { return None };
    ErrorNumber::new(telegram::decimal(digits)?.try_into().ok()?)
}

fn is_printable(byte: u8) -> bool {
    (b' '..=b'~').contains(&byte)
}
