//! `lexican emcy`.

use lexican_runtime::wire::emcy::{CodeOrder, Emergency, ErrorCode, ErrorRegister};
use lexican_runtime::{Duration, Frame, NodeId};
use lexican_toolbox::values::text::parse_hex;

use super::schedule::Schedule;
use super::session::Session;
use crate::bus::node_id;
use crate::output::{Failure, Outcome, note};

/// Send EMCY in the name of a node, for tests of what listens
///
/// A controller that follows this node stops its machine, say. The node itself knows nothing of it.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    schedule: Schedule,

    /// The node-ID of the sender: 1 to 127, or 0x1 to 0x7F
    #[arg(value_name = "NODE", value_parser = node_id)]
    node: NodeId,

    /// The error code, in hexadecimal: 4210; 0000 for an error that is over
    #[arg(value_name = "CODE", value_parser = code)]
    code: ErrorCode,

    /// The error register (1001h), in hexadecimal; by default the generic error, and none with the code 0000
    #[arg(long, value_name = "HEX", value_parser = byte)]
    register: Option<u8>,

    /// Up to five bytes of the manufacturer: "01 A0"
    #[arg(long, value_name = "BYTES", value_parser = vendor, default_value = "")]
    data: [u8; 5],
}

const EXAMPLES: &str = "\
Examples:
    lexican emcy --bus can0 5 4210
    lexican emcy --bus can0 5 FF01 --register 81 --data \"01 A0\"
    lexican emcy --bus can0 5 0000";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let is_over = args.code == ErrorCode::NO_ERROR;
    let register = if is_over { ErrorRegister::NONE } else { ErrorRegister::GENERIC };
    let register = args.register.map_or(register, ErrorRegister);
    let emergency = Emergency { code: args.code, register, vendor: args.data };
    let frame = Frame::from_array(Emergency::cob_id(args.node), emergency.emit(CodeOrder::LowByteFirst));
    let mut session = Session::of(&args.schedule)?;
    if !args.schedule.json {
        note(format_args!("in the name of node {}: {}", args.node, args.code));
    }
    session.tick(&args.schedule, Duration::ZERO, |_, _| vec![frame], |_, _| Ok(()))
}

fn code(text: &str) -> Result<ErrorCode, String> {
    let code = parse_hex(text, 4).map(ErrorCode);
    code.ok_or_else(|| format!("{text:?} is not an error code of up to four hexadecimal digits such as 4210"))
}

fn byte(text: &str) -> Result<u8, String> {
    let byte = parse_hex(text, 2).map(|byte| byte as u8);
    byte.ok_or_else(|| format!("{text:?} is not a byte of two hexadecimal digits such as 81"))
}

fn vendor(text: &str) -> Result<[u8; 5], String> {
    let mut vendor = [0; 5];
    let bytes = text.split_whitespace().map(byte).collect::<Result<Vec<_>, _>>()?;
    let place = vendor.get_mut(..bytes.len()).ok_or_else(|| format!("{text:?} is more than five bytes"))?;
    place.copy_from_slice(&bytes);
    Ok(vendor)
}
