//! `lexican send`.

use lexican_runtime::{Duration, Frame, NodeId};
use lexican_toolbox::decode::Decoder;
use serde_json::json;

use super::schedule::Schedule;
use super::session::Session;
use crate::output::{Failure, Outcome};
use lexican_toolbox::text::duration::period;

/// Send frames as they are
///
/// THE FRAMES ARE SENT AS THEY ARE, and nothing looks at what they do: NMT (000), SYNC (080) and PDOs (180 to 57F) move machines,
/// and SDO requests (600 + node-ID) change drives. A frame is an identifier of three hexadecimal digits (eight for 29 bits), #,
/// and up to eight bytes; R and a length for a remote frame. That is how `candump -L` and `cansend` write it.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    schedule: Schedule,

    /// The frames, sent one after another: 605#4064600000000000, 605#40.64.60.00.00.00.00.00, 705#R1
    #[arg(required = true, value_name = "FRAME", value_parser = frame)]
    frames: Vec<Frame>,

    /// Print what is heard meanwhile, and for so long after the last frame: 100ms, 2s
    #[arg(long, value_name = "TIME", value_parser = period)]
    wait: Option<Duration>,
}

const EXAMPLES: &str = "\
Examples:
    lexican send --bus can0 605#4064600000000000 --wait 100ms
    lexican send --bus can0 000#0105
    lexican send --bus can0 205#0F00 080# --every 100ms --count 10";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut session = Session::of(&args.schedule)?;
    let nodes = std::mem::take(&mut session.nodes);
    let mut decoder = Decoder::new();
    for (node, loaded) in &nodes {
        decoder.introduce(*node, &loaded.device);
    }
    for frame in &args.frames {
        // A response is decoded by its request.
        decoder.decode(frame);
    }
    let wait = args.wait.unwrap_or(Duration::ZERO);
    session.tick(
        &args.schedule,
        wait,
        |_, _| args.frames.clone(),
        |session, frame| {
            if args.wait.is_none() {
                return Ok(());
            }
            let decoded = decoder.decode(&frame);
            let fields = json!({
                "frame": frame.to_string(),
                "service": decoded.name,
                "node": decoded.node.map(NodeId::get),
            });
            let separator = if decoded.text.is_empty() { "" } else { ": " };
            session.print("heard", fields, &format!("{frame}  {}{separator}{}", decoded.name, decoded.text))
        },
    )
}

fn frame(text: &str) -> Result<Frame, String> {
    let (id, data) = text.split_once('#').unwrap_or((text, ""));
    let plain = if text.contains('#') { format!("{id}#{}", data.replace('.', "")) } else { text.to_owned() };
    plain.parse().map_err(|error| format!("{text:?}: {error}"))
}
