//! lexican's part in the interoperability runs: a device, or the manager of one.
//!
//! `interop-peer device URL [NODE]` serves the dictionary of `peer.eds` until its standard input ends;
//! without a node-ID it waits for LSS to give it one. `interop-peer manager URL NODE` tries every service
//! on such a device, and prints a line per service: name, verdict, remark, between tabs. `interop-peer reads URL
//! NODE SECONDS` reads one object over and over.

mod device;
mod manager;
mod od;

use std::process::ExitCode;

use device::Outcome;
use lexican_runtime::NodeId;
use lexican_runtime::host::{BusUrl, Link};

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let outcome = match words[..] {
        ["device", url] => open(url).and_then(|link| device::run(link, None)),
        ["device", url, node] => open(url).and_then(|link| device::run(link, Some(number(node)?))),
        ["manager", url, node] => open(url).and_then(|link| manager::run(link, number(node)?)),
        ["reads", url, node, seconds] => {
            open(url).and_then(|link| manager::read_on(link, number(node)?, seconds.parse()?))
        }
        _ => Err("usage: interop-peer device URL [NODE] | manager URL NODE | reads URL NODE SECONDS".into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("interop-peer: {error}");
            ExitCode::FAILURE
        }
    }
}

fn open(url: &str) -> Outcome<Box<dyn Link + Send>> {
    Ok(url.parse::<BusUrl>()?.open()?)
}

fn number(node: &str) -> Outcome<NodeId> {
    Ok(NodeId::try_from(node.parse::<u8>()?)?)
}
