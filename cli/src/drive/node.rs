//! Finds the drive at a node: its description and its data sheet.

use std::path::PathBuf;

use lexican_driver::{Any, Description, Error};
use lexican_eds::{Input, library};
use lexican_runtime::NodeId;
use lexican_runtime::host::Pace;
use lexican_toolbox::data_sheet::DataSheet;

use lexican_toolbox::drive::describe;

use crate::bus::{BoxedLink, Bus, BusArgs, identify, network};
use crate::device::{find, load_input};
use crate::output::{Failure, NO_ANSWER};

pub(super) type Drive = lexican_driver::Drive<BoxedLink, Any>;

pub(super) struct DriveNode {
    pub(super) link: BoxedLink,
    pub(super) description: &'static Description,
    pub(super) sheet: DataSheet,
}

impl DriveNode {
    /// Opens the bus and identifies the node: by the given name, by the URL of the bus, or by its identity.
    pub(super) fn open(
        bus: &BusArgs,
        pace: Pace,
        node: NodeId,
        device: Option<&str>,
        overlays: &[PathBuf],
    ) -> Result<Self, Failure> {
        let (link, sheet) = find_sheet(bus, pace, node, device, overlays)?;
        let description = description_of(&sheet.input)?;
        Ok(DriveNode { link, description, sheet })
    }
}

/// Opens the bus, and finds the node's data sheet.
pub(super) fn find_sheet(
    bus: &BusArgs,
    pace: Pace,
    node: NodeId,
    device: Option<&str>,
    overlays: &[PathBuf],
) -> Result<(BoxedLink, DataSheet), Failure> {
    let named = device.map(find).transpose()?.map(|(input, _)| input);
    let Bus { link, nodes, .. } = bus.open(pace)?.settled()?;
    let by_url = nodes.into_iter().find(|(known, _)| *known == node).map(|(_, sheet)| sheet.input);
    let (link, input) = match named.or(by_url) {
        Some(input) => (link, input),
        None => by_identity(link, node)?,
    };
    Ok((link, load_input(input, overlays)?))
}

fn by_identity(link: BoxedLink, node: NodeId) -> Result<(BoxedLink, Input), Failure> {
    let mut network = network(link)?;
    let shipped = identify(&mut network, node)?.and_then(|known| library::find(known.id)).ok_or_else(|| {
        Failure::new(format_args!("which drive is node {node}? Its identity (1018h) is none that lexican knows"))
            .help("name its data sheet: --device FILE.eds")
    })?;
    Ok((network.into_link(), shipped.input()))
}

/// The description of a drive; if there is none, the failure says what to do.
fn description_of(input: &Input) -> Result<&'static Description, Failure> {
    describe(input).map_err(|error| {
        Failure::new(error).help(
            "only drives of CiA 402 can be moved: --explain lists what is missing; `lexican write` sets objects of other devices",
        )
    })
}

/// The failure of connecting to a drive.
pub(super) fn failed(error: Error, is_named: bool) -> Failure {
    match error {
        Error::Link(error) => error.into(),
        Error::Sdo(_) => Failure::new(&error).help(NO_ANSWER),
        Error::NotThisDrive { .. } if !is_named => {
            Failure::new(&error).help("name what it is: --device FILE.eds")
        }
        Error::NotThisDrive { .. } => Failure::new(&error).help(
            "name the data sheet of this device; or if it is the right one, correct what it has in 1000h, 1008h and 1018h by \
             an overlay: --overlay FILE.toml",
        ),
        _ => Failure::new(&error),
    }
}
