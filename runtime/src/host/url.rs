//! The names of buses, in all commands and configurations.
//!
//! | URL | what it is |
//! | --- | --- |
//! | `socketcan:can0`, or just `can0` | an interface of a Linux kernel |
//! | `slcan:/dev/ttyACM0?bitrate=500000` | a serial adapter; `baud=` sets the speed of the line to it |
//! | `serial:/dev/ttyUSB0?device=vendor/device` | a device behind its own serial interface, as a node of a bus of its own |
//! | `profibus:/dev/ttyUSB0?device=vendor/device&address=5` | a device on PROFIBUS-DP, as a node of a bus of its own |
//! | `sim:vendor/device?node=5` | a device that exists only in software |
//! | `log:FILE` | a log of `candump -L`; `interface=` picks one of its interfaces, `pace=real` takes its time |

use core::fmt;
use core::str::FromStr;
use std::borrow::ToOwned;
use std::path::PathBuf;
use std::string::{String, ToString};
use std::vec::Vec;

use super::Pace;
pub use super::open::OpenError;

/// The default speed of a serial line, in bit/s.
pub(super) const BAUD: u32 = 115_200;

/// The name of a bus. Parses from text, and prints as text that parses to the same.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BusUrl {
    /// `socketcan:can0`
    SocketCan {
        /// The interface's name.
        interface: String,
    },
    /// `slcan:/dev/ttyACM0?bitrate=500000`
    Slcan {
        /// The serial port.
        port: String,
        /// The bit rate of the CAN bus in bit/s; `None` leaves it to the adapter.
        bit_rate: Option<u32>,
        /// The speed of the serial line in bit/s.
        baud: u32,
    },
    /// `serial:/dev/ttyUSB0?device=vendor/device`
    Serial {
        /// The serial port.
        port: String,
        /// `key=value`, in the order of the URL. The program that knows the device defines them.
        parameters: Vec<(String, String)>,
    },
    /// `profibus:/dev/ttyUSB0?device=vendor/device&address=5`
    Profibus {
        /// The serial port.
        port: String,
        /// As those of [`BusUrl::Serial`].
        parameters: Vec<(String, String)>,
    },
    /// `sim:vendor/device?node=5`
    Simulation {
        /// The device, as the library of devices names it, or a path.
        device: String,
        /// `key=value`, in the order of the URL. The simulation defines them.
        parameters: Vec<(String, String)>,
    },
    /// `log:FILE`
    Log {
        /// The file.
        file: PathBuf,
        /// The interface whose frames are replayed; `None` for all.
        interface: Option<String>,
        /// Whether the frames come as fast as they are read, or with the times of the log.
        pace: Pace,
    },
}

impl FromStr for BusUrl {
    type Err = BusUrlError;

    fn from_str(text: &str) -> Result<Self, BusUrlError> {
        let (scheme, rest) = text.split_once(':').unwrap_or(("socketcan", text));
        match scheme {
            "socketcan" => {
                let (interface, parameters) = Parameters::split(rest)?;
                parameters.none_but(&[])?;
                socketcan(interface)
            }
            "slcan" => {
                let (port, parameters) = Parameters::split(rest)?;
                parameters.none_but(&["bitrate", "baud"])?;
                let (bit_rate, baud) = (parameters.number("bitrate")?, parameters.number("baud")?);
                let port = required(port, "slcan:/dev/ttyACM0?bitrate=500000")?;
                Ok(BusUrl::Slcan { port, bit_rate, baud: baud.unwrap_or(BAUD) })
            }
            "serial" => {
                let (port, parameters) = Parameters::split(rest)?;
                let port = required(port, "serial:/dev/ttyUSB0?device=vendor/device")?;
                Ok(BusUrl::Serial { port, parameters: parameters.0 })
            }
            "profibus" => {
                let (port, parameters) = Parameters::split(rest)?;
                let port = required(port, "profibus:/dev/ttyUSB0?device=vendor/device&address=5")?;
                Ok(BusUrl::Profibus { port, parameters: parameters.0 })
            }
            "sim" => {
                let (device, parameters) = Parameters::split(rest)?;
                Ok(BusUrl::Simulation {
                    device: required(device, "sim:vendor/device?node=5")?,
                    parameters: parameters.0,
                })
            }
            "log" => {
                let (file, parameters) = Parameters::split(rest)?;
                parameters.none_but(&["interface", "pace"])?;
                let pace = match parameters.get("pace") {
                    None | Some("virtual") => Pace::Virtual,
                    Some("real") => Pace::RealTime,
                    Some(other) => {
                        return Err(BusUrlError::Value {
                            key: "pace",
                            value: other.to_owned(),
                            wanted: "real or virtual",
                        });
                    }
                };
                Ok(BusUrl::Log {
                    file: required(file, "log:bus.log")?.into(),
                    interface: parameters.get("interface").map(ToOwned::to_owned),
                    pace,
                })
            }
            _ => Err(BusUrlError::Scheme { scheme: scheme.to_owned() }),
        }
    }
}

/// An interface of the kernel: at most 15 bytes, without `/` and white space.
fn socketcan(name: &str) -> Result<BusUrl, BusUrlError> {
    let name = required(name, "can0")?;
    let is_port = name.contains('/') || name.strip_prefix("COM").is_some_and(|n| n.parse::<u16>().is_ok());
    if is_port {
        return Err(BusUrlError::Port { name });
    }
    if name.len() > 15 || name.contains(|c: char| c.is_whitespace() || c.is_control()) {
        return Err(BusUrlError::Interface { name });
    }
    Ok(BusUrl::SocketCan { interface: name })
}

fn required(text: &str, example: &'static str) -> Result<String, BusUrlError> {
    if text.is_empty() { Err(BusUrlError::Empty { example }) } else { Ok(text.to_owned()) }
}

/// The part after the `?`: `key=value`, joined by `&`.
struct Parameters(Vec<(String, String)>);

impl Parameters {
    fn split(text: &str) -> Result<(&str, Parameters), BusUrlError> {
        let Some((head, tail)) = text.split_once('?') else { return Ok((text, Parameters(Vec::new()))) };
        let pairs = tail.split('&').map(|pair| match pair.split_once('=') {
            Some((key, value)) if !key.is_empty() => Ok((key.to_owned(), value.to_owned())),
            _ => Err(BusUrlError::Pair { pair: pair.to_owned() }),
        });
        Ok((head, Parameters(pairs.collect::<Result<_, _>>()?)))
    }

    /// Refuses parameters that are not known, or given twice.
    fn none_but(&self, known: &'static [&'static str]) -> Result<(), BusUrlError> {
        for (at, (key, _)) in self.0.iter().enumerate() {
            if !known.contains(&key.as_str()) {
                return Err(BusUrlError::Key { key: key.clone(), known });
            }
            if self.0.iter().skip(at + 1).any(|(other, _)| other == key) {
                return Err(BusUrlError::Twice { key: key.clone() });
            }
        }
        Ok(())
    }

    fn get(&self, wanted: &str) -> Option<&str> {
        self.0.iter().find(|(key, _)| key == wanted).map(|(_, value)| value.as_str())
    }

    fn number(&self, key: &'static str) -> Result<Option<u32>, BusUrlError> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let number = value.parse();
        number.map(Some).map_err(|_| BusUrlError::Value { key, value: value.to_owned(), wanted: "a number of bit/s" })
    }
}

impl fmt::Display for BusUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parameters: Vec<(&str, String)> = Vec::new();
        match self {
            BusUrl::SocketCan { interface } => write!(f, "socketcan:{interface}")?,
            BusUrl::Slcan { port, bit_rate, baud } => {
                write!(f, "slcan:{port}")?;
                parameters.extend(bit_rate.map(|rate| ("bitrate", rate.to_string())));
                parameters.extend((*baud != BAUD).then(|| ("baud", baud.to_string())));
            }
            BusUrl::Serial { port, parameters: given } => {
                write!(f, "serial:{port}")?;
                parameters.extend(given.iter().map(|(key, value)| (key.as_str(), value.clone())));
            }
            BusUrl::Profibus { port, parameters: given } => {
                write!(f, "profibus:{port}")?;
                parameters.extend(given.iter().map(|(key, value)| (key.as_str(), value.clone())));
            }
            BusUrl::Simulation { device, parameters: given } => {
                write!(f, "sim:{device}")?;
                parameters.extend(given.iter().map(|(key, value)| (key.as_str(), value.clone())));
            }
            BusUrl::Log { file, interface, pace } => {
                write!(f, "log:{}", file.display())?;
                parameters.extend(interface.clone().map(|interface| ("interface", interface)));
                parameters.extend((*pace == Pace::RealTime).then(|| ("pace", "real".to_owned())));
            }
        }
        for (number, (key, value)) in parameters.iter().enumerate() {
            write!(f, "{}{key}={value}", if number == 0 { '?' } else { '&' })?;
        }
        Ok(())
    }
}

/// Why a text does not name a bus, with a remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BusUrlError {
    /// The scheme before the colon is unknown.
    #[error(
        "there is no kind of bus `{scheme}`; write socketcan:can0 (or just can0), \
         slcan:/dev/ttyACM0?bitrate=500000, serial:/dev/ttyUSB0?device=vendor/device, \
         profibus:/dev/ttyUSB0?device=vendor/device&address=5, sim:vendor/device?node=5 or log:FILE"
    )]
    Scheme {
        /// The word.
        scheme: String,
    },
    /// The text is empty, or nothing follows the colon.
    #[error("the bus has no name; write for example {example}")]
    Empty {
        /// A text that names a bus.
        example: &'static str,
    },
    /// A serial port without its scheme.
    #[error("{name} is a serial port; write slcan:{name}?bitrate=500000")]
    Port {
        /// The port.
        name: String,
    },
    /// The name is too long for an interface, or has spaces.
    #[error("`{name}` cannot be an interface: a name has at most 15 bytes and no spaces")]
    Interface {
        /// The name.
        name: String,
    },
    /// A parameter without `=`.
    #[error("`{pair}` is not a parameter; write key=value, joined by &")]
    Pair {
        /// The parameter.
        pair: String,
    },
    /// A parameter that this kind of bus does not have.
    #[error("there is no parameter `{key}` here{}", list(known))]
    Key {
        /// The parameter's name.
        key: String,
        /// The parameters of this kind of bus.
        known: &'static [&'static str],
    },
    /// A parameter that is given twice.
    #[error("there are two of the parameter `{key}`")]
    Twice {
        /// The parameter's name.
        key: String,
    },
    /// A parameter with a value out of its range.
    #[error("{key}={value} is not {wanted}")]
    Value {
        /// The parameter's name.
        key: &'static str,
        /// Its value.
        value: String,
        /// The expected values.
        wanted: &'static str,
    },
}

fn list(known: &[&str]) -> String {
    if known.is_empty() { String::new() } else { std::format!("; there is {}", known.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    #[track_caller]
    fn check(text: &str, url: BusUrl, canonical: &str) {
        assert_eq!(text.parse(), Ok(url.clone()));
        assert_eq!(url.to_string(), canonical);
        assert_eq!(canonical.parse(), Ok(url));
    }

    #[test]
    fn urls_read_and_print() {
        let can0 = BusUrl::SocketCan { interface: "can0".to_owned() };
        check("can0", can0.clone(), "socketcan:can0");
        check("socketcan:can0", can0, "socketcan:can0");
        let adapter = |port: &str, bit_rate, baud| BusUrl::Slcan { port: port.to_owned(), bit_rate, baud };
        check("slcan:/dev/ttyACM0", adapter("/dev/ttyACM0", None, BAUD), "slcan:/dev/ttyACM0");
        check(
            "slcan:COM3?baud=0&bitrate=500000",
            adapter("COM3", Some(500_000), 0),
            "slcan:COM3?bitrate=500000&baud=0",
        );
        let serial = BusUrl::Serial {
            port: "COM3".to_owned(),
            parameters: vec![("device".to_owned(), "vendor/device".to_owned()), ("baud".to_owned(), "9600".to_owned())],
        };
        check("serial:COM3?device=vendor/device&baud=9600", serial, "serial:COM3?device=vendor/device&baud=9600");
        let profibus =
            BusUrl::Profibus { port: "COM3".to_owned(), parameters: vec![("address".to_owned(), "5".to_owned())] };
        check("profibus:COM3?address=5", profibus, "profibus:COM3?address=5");
        let simulation = BusUrl::Simulation {
            device: "vendor/device".to_owned(),
            parameters: vec![("node".to_owned(), "5".to_owned()), ("pace".to_owned(), "real".to_owned())],
        };
        check("sim:vendor/device?node=5&pace=real", simulation, "sim:vendor/device?node=5&pace=real");
        let log = |file: &str, interface: Option<&str>, pace| BusUrl::Log {
            file: file.into(),
            interface: interface.map(ToOwned::to_owned),
            pace,
        };
        check("log:a.log", log("a.log", None, Pace::Virtual), "log:a.log");
        check("log:C:\\a.log?pace=real", log("C:\\a.log", None, Pace::RealTime), "log:C:\\a.log?pace=real");
        check("log:a?interface=can1", log("a", Some("can1"), Pace::Virtual), "log:a?interface=can1");
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
            "there is no kind of bus `kvaser`; write socketcan:can0 (or just can0), \
             slcan:/dev/ttyACM0?bitrate=500000, serial:/dev/ttyUSB0?device=vendor/device, \
             profibus:/dev/ttyUSB0?device=vendor/device&address=5, sim:vendor/device?node=5 or log:FILE",
        );
        refused("slcan:COM3?speed=1", "there is no parameter `speed` here; there is bitrate, baud");
        refused("socketcan:can0?bitrate=1", "there is no parameter `bitrate` here");
        refused("can0?bitrate=1", "there is no parameter `bitrate` here");
        refused("slcan:COM3?baud=1&baud=2", "there are two of the parameter `baud`");
        refused("slcan:COM3?bitrate=fast", "bitrate=fast is not a number of bit/s");
        refused("slcan:COM3?bitrate", "`bitrate` is not a parameter; write key=value, joined by &");
        refused("log:a?pace=slow", "pace=slow is not real or virtual");
    }

    #[test]
    fn errors_of_open_have_a_remedy() {
        let error = |text: &str| text.parse::<BusUrl>().unwrap().open().err().unwrap().to_string();
        assert!(error("log:/no/such.log").starts_with("/no/such.log: "));
        assert!(error("sim:vendor/device").contains("started by the program that has the simulators"));
    }
}
