//! The URLs of buses, in all commands and configurations: `scheme:place?key=value&key=value`.
//!
//! A [`Scheme`] defines and opens the URLs of one kind of link. This crate has [`SCHEMES`](super::schemes::SCHEMES):
//!
//! | URL | what it is |
//! | --- | --- |
//! | `socketcan:can0`, or just `can0` | an interface of a Linux kernel |
//! | `slcan:/dev/ttyACM0?bitrate=500000` | a serial adapter; `baud=` sets the speed of the line to it |
//! | `log:FILE` | a log of `candump -L`; `interface=` picks one of its interfaces, `pace=real` takes its time |
//!
//! A program with further links, such as a simulation, parses with its own list ([`BusUrl::among`]).

use core::fmt;
use std::borrow::ToOwned;
use std::boxed::Box;
use std::error::Error;
use std::format;
use std::string::String;
use std::vec::Vec;

use super::{Link, Pace, ReplayError};

/// The scheme of a text without one.
pub(super) const INTERFACE: &str = "socketcan";

/// A kind of link: the form of its URLs, and how a bus is opened.
#[derive(Debug)]
pub struct Scheme {
    /// The word before the colon.
    pub name: &'static str,
    /// An example of a URL, for help and errors.
    pub example: &'static str,
    /// What a URL names, in a few words.
    pub what: &'static str,
    /// The parameters that may follow the `?`.
    pub parameters: &'static [Parameter],
    /// Checks the text between the colon and the `?`, which is not empty.
    pub check: fn(&str) -> Result<(), BusUrlError>,
    /// Opens a bus as a link.
    pub open: fn(&BusUrl) -> Result<Box<dyn Link + Send>, OpenError>,
}

/// A `key=value` of a URL.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// The word before the `=`.
    pub key: &'static str,
    /// What it sets, in a few words.
    pub what: &'static str,
    /// The values that it takes.
    pub takes: Takes,
}

/// The values of a [`Parameter`].
#[derive(Clone, Copy, Debug)]
pub enum Takes {
    /// Any text; the link checks it when it is opened.
    Text,
    /// A number of bit/s.
    Rate,
    /// One of these words.
    Words(&'static [&'static str]),
}

/// The parameter for the pace of a log's or a simulation's time.
pub const PACE: Parameter =
    Parameter { key: "pace", what: "as fast as possible, or in real time", takes: Takes::Words(&["virtual", "real"]) };

/// The URL of a bus. `Display` prints it so that it parses to the same.
#[derive(Clone, Debug)]
pub struct BusUrl {
    scheme: &'static Scheme,
    place: String,
    parameters: Vec<(String, String)>,
}

impl PartialEq for BusUrl {
    fn eq(&self, other: &BusUrl) -> bool {
        (self.scheme.name, &self.place, &self.parameters) == (other.scheme.name, &other.place, &other.parameters)
    }
}

impl Eq for BusUrl {}

impl BusUrl {
    /// Parses a URL of these schemes. A text without a scheme names an interface of SocketCAN.
    pub fn among(schemes: &[&'static Scheme], text: &str) -> Result<Self, BusUrlError> {
        let (name, rest) = text.split_once(':').unwrap_or((INTERFACE, text));
        let Some(&scheme) = schemes.iter().find(|scheme| scheme.name == name) else {
            return Err(BusUrlError::Scheme {
                scheme: name.to_owned(),
                examples: schemes.iter().map(|it| it.example).collect(),
            });
        };
        let (place, parameters) = rest.split_once('?').map_or((rest, None), |(place, rest)| (place, Some(rest)));
        let pairs = parameters.into_iter().flat_map(|parameters| parameters.split('&')).map(pair);
        let url = BusUrl { scheme, place: place.to_owned(), parameters: pairs.collect::<Result<_, _>>()? };
        url.check_parameters()?;
        if place.is_empty() {
            return Err(BusUrlError::Empty { example: scheme.example });
        }
        (scheme.check)(place)?;
        Ok(url)
    }

    fn check_parameters(&self) -> Result<(), BusUrlError> {
        for (at, (key, value)) in self.parameters.iter().enumerate() {
            let Some(parameter) = self.scheme.parameters.iter().find(|parameter| parameter.key == key) else {
                let known = self.scheme.parameters.iter().map(|parameter| parameter.key).collect();
                return Err(BusUrlError::Key { key: key.clone(), known });
            };
            if self.parameters.iter().skip(at + 1).any(|(other, _)| other == key) {
                return Err(BusUrlError::Twice { key: key.clone() });
            }
            let wanted = match parameter.takes {
                Takes::Rate if value.parse::<u32>().is_err() => "a number of bit/s".to_owned(),
                Takes::Words(words) if !words.contains(&value.as_str()) => list(words, " or "),
                _ => continue,
            };
            return Err(BusUrlError::Value { key: parameter.key, value: value.clone(), wanted });
        }
        Ok(())
    }

    /// The kind of link.
    #[must_use]
    pub fn scheme(&self) -> &'static Scheme {
        self.scheme
    }

    /// The text between the colon and the `?`: an interface, a port, a file.
    #[must_use]
    pub fn place(&self) -> &str {
        &self.place
    }

    /// The value of a parameter, if given.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&str> {
        self.parameters.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }

    /// The number of a parameter in bit/s, if given.
    #[must_use]
    pub fn rate(&self, key: &str) -> Option<u32> {
        self.get(key)?.parse().ok()
    }

    /// The pace of its time ([`PACE`]), if given.
    #[must_use]
    pub fn pace(&self) -> Option<Pace> {
        self.get(PACE.key).map(|pace| if pace == "real" { Pace::RealTime } else { Pace::Virtual })
    }

    /// Opens the bus.
    pub fn open(&self) -> Result<Box<dyn Link + Send>, OpenError> {
        (self.scheme.open)(self)
    }
}

fn pair(text: &str) -> Result<(String, String), BusUrlError> {
    match text.split_once('=') {
        Some((key, value)) if !key.is_empty() => Ok((key.to_owned(), value.to_owned())),
        _ => Err(BusUrlError::Pair { pair: text.to_owned() }),
    }
}

impl fmt::Display for BusUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.scheme.name, self.place)?;
        for (number, (key, value)) in self.parameters.iter().enumerate() {
            write!(f, "{}{key}={value}", if number == 0 { '?' } else { '&' })?;
        }
        Ok(())
    }
}

/// Why a text is not the URL of a bus, with a remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what it is")]
pub enum BusUrlError {
    #[error("there is no kind of bus `{scheme}`; write {}", list(examples, " or "))]
    Scheme { scheme: String, examples: Vec<&'static str> },
    #[error("the bus has no name; write for example {example}")]
    Empty { example: &'static str },
    #[error("{name} is a serial port; write slcan:{name}?bitrate=500000")]
    Port { name: String },
    #[error("`{name}` cannot be an interface: a name has at most 15 bytes and no spaces")]
    Interface { name: String },
    #[error("`{pair}` is not a parameter; write key=value, joined by &")]
    Pair { pair: String },
    #[error("there is no parameter `{key}` here{}", there_is(known))]
    Key { key: String, known: Vec<&'static str> },
    #[error("there are two of the parameter `{key}`")]
    Twice { key: String },
    #[error("{key}={value} is not {wanted}")]
    Value { key: &'static str, value: String, wanted: String },
}

fn there_is(known: &[&str]) -> String {
    if known.is_empty() { String::new() } else { format!("; there is {}", known.join(", ")) }
}

/// `a, b or c`.
fn list(words: &[&str], last: &str) -> String {
    match words {
        [first @ .., end] if !first.is_empty() => format!("{}{last}{end}", first.join(", ")),
        words => words.concat(),
    }
}

/// Why a bus cannot be opened, with a remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names say what it is")]
pub enum OpenError {
    /// A CAN interface.
    #[cfg(all(feature = "socketcan", target_os = "linux"))]
    #[error(transparent)]
    SocketCan(#[from] super::socketcan::SocketCanError),
    /// A serial adapter.
    #[cfg(feature = "slcan")]
    #[error(transparent)]
    Slcan(#[from] super::slcan::SlcanError),
    #[error(transparent)]
    Log(#[from] ReplayError),
    /// The feature for this link is off.
    #[error("{bus} cannot be opened: this program was built without the feature `{feature}` of lexican-runtime")]
    NotBuilt { bus: String, feature: &'static str },
    /// Only Linux has SocketCAN.
    #[error("{bus} cannot be opened: only Linux has SocketCAN; use a serial adapter: slcan:COM3?bitrate=500000")]
    NotLinux { bus: String },
    /// A bus that is more than a link.
    #[error("{bus} cannot be opened as a link: it is opened by the program that knows what is there")]
    Elsewhere { bus: String },
    /// A link of another crate.
    #[error(transparent)]
    Other(Box<dyn Error + Send + Sync>),
}

#[cfg(test)]
mod tests {
    use super::super::schemes::{LOG, SCHEMES};
    use super::*;
    use std::string::ToString;

    #[test]
    fn urls_read_and_print() {
        for (text, printed) in [
            ("can0", "socketcan:can0"),
            ("slcan:/dev/ttyACM0", "slcan:/dev/ttyACM0"),
            ("slcan:COM3?baud=0&bitrate=500000", "slcan:COM3?baud=0&bitrate=500000"),
            ("log:a.log", "log:a.log"),
            ("log:C:\\a.log?pace=real", "log:C:\\a.log?pace=real"),
            ("log:a?interface=can1", "log:a?interface=can1"),
        ] {
            let url = text.parse::<BusUrl>().unwrap();
            assert_eq!(url.to_string(), printed);
            assert_eq!(printed.parse(), Ok(url));
        }
        let url = "slcan:COM3?bitrate=500000".parse::<BusUrl>().unwrap();
        assert_eq!((url.scheme().name, url.place()), ("slcan", "COM3"));
        assert_eq!((url.rate("bitrate"), url.rate("baud"), url.pace()), (Some(500_000), None, None));
        assert_eq!("log:a?pace=real".parse::<BusUrl>().unwrap().pace(), Some(Pace::RealTime));
    }

    #[test]
    fn every_example_is_a_url_of_its_scheme() {
        for scheme in SCHEMES {
            assert_eq!(scheme.example.parse::<BusUrl>().unwrap().scheme().name, scheme.name);
        }
    }

    #[track_caller]
    fn refused(text: &str, message: &str) {
        assert_eq!(text.parse::<BusUrl>().map_err(|error| error.to_string()), Err(message.to_owned()));
    }

    #[test]
    fn other_texts_are_refused_with_a_remedy() {
        refused("", "the bus has no name; write for example can0");
        refused("slcan:", "the bus has no name; write for example slcan:/dev/ttyACM0?bitrate=500000");
        refused("/dev/ttyACM0", "/dev/ttyACM0 is a serial port; write slcan:/dev/ttyACM0?bitrate=500000");
        refused("COM3", "COM3 is a serial port; write slcan:COM3?bitrate=500000");
        refused(
            "a name too long for it",
            "`a name too long for it` cannot be an interface: a name has at most 15 bytes and no spaces",
        );
        refused(
            "kvaser:0",
            "there is no kind of bus `kvaser`; write can0, slcan:/dev/ttyACM0?bitrate=500000 or log:FILE",
        );
        refused("slcan:COM3?speed=1", "there is no parameter `speed` here; there is bitrate, baud");
        refused("socketcan:can0?bitrate=1", "there is no parameter `bitrate` here");
        refused("can0?bitrate=1", "there is no parameter `bitrate` here");
        refused("slcan:COM3?baud=1&baud=2", "there are two of the parameter `baud`");
        refused("slcan:COM3?bitrate=fast", "bitrate=fast is not a number of bit/s");
        refused("slcan:COM3?bitrate", "`bitrate` is not a parameter; write key=value, joined by &");
        refused("log:a?pace=slow", "pace=slow is not virtual or real");
    }

    #[test]
    fn errors_of_open_have_a_remedy() {
        let error = |url: BusUrl| url.open().err().unwrap().to_string();
        assert!(error("log:/no/such.log".parse().unwrap()).starts_with("/no/such.log: "));
        static OTHER: Scheme = Scheme { name: "sim", example: "sim:a", open: super::super::schemes::elsewhere, ..LOG };
        let other = BusUrl::among(&[&OTHER], "sim:vendor/device").unwrap();
        assert!(error(other).contains("opened by the program that knows what is there"));
    }
}
