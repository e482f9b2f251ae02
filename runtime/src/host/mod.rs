//! Links that carry frames, and shells that run the state machines over them. All I/O and all clocks are in here, but
//! no protocol logic.

mod access;
pub mod blocking;
mod boot;
mod bytes;
pub mod candump;
mod clock;
#[cfg(feature = "embedded-can")]
mod embedded_can;
mod filter;
pub mod kept;
mod link;
mod main_error;
mod mapped;
mod named;
mod node;
mod participant;
mod pump;
mod remote_node;
mod replay;
pub mod schemes;
mod settings;
#[cfg(feature = "slcan")]
pub mod slcan;
#[cfg(all(feature = "socketcan", target_os = "linux"))]
pub mod socketcan;
mod station;
#[cfg(feature = "tokio")]
pub mod tokio;
mod trace;
pub mod url;
mod virtual_bus;
mod wire_bits;

pub use access::AccessError;
pub use boot::{BootNetworkError, NotReady, Plan};
pub use bytes::Bytes;
#[cfg(feature = "embedded-can")]
pub use embedded_can::EmbeddedCan;
#[cfg(unix)]
pub use link::Descriptor;
pub use link::{BusState, Incoming, Link, LinkError};
pub use main_error::MainError;
pub use mapped::{MappedPdo, PdoOptions};
pub use named::{Reading, UnknownName};
pub use node::Node;
pub use participant::{Notice, Participant};
pub use pump::{Listener, Pump, StateMachine, Turn};
pub use replay::{Replay, ReplayError};
pub use settings::Settings;
pub use station::Station;
pub use url::{BusUrl, BusUrlError};
pub use virtual_bus::{Attachment, Fate, Pace, VirtualBus, VirtualLink};
pub use wire_bits::wire_bits;
