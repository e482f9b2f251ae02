//! The filter options of `lexican monitor`.

use lexican_toolbox::bus::cob_ids::CobIds;
use lexican_toolbox::bus::filter::{Filter, ServiceFilter};

use crate::bus::NodeIds;

/// Which frames to print: those that fulfil every option. An option with several values is fulfilled by any of them.
#[derive(clap::Args, Debug)]
#[command(next_help_heading = "Which frames to print")]
pub(crate) struct FilterArgs {
    /// Only those of these nodes: 5, 3,5-9
    #[arg(long, value_name = "NODES")]
    node: Option<NodeIds>,

    /// Only these services: nmt, sync, time, emcy, pdo, rpdo, tpdo, sdo, heartbeat, lss, unknown
    #[arg(long, value_name = "SERVICE", value_delimiter = ',')]
    service: Vec<ServiceFilter>,

    /// All but these services
    #[arg(long, value_name = "SERVICE", value_delimiter = ',')]
    without: Vec<ServiceFilter>,

    /// Only those with this object, by address or name: 6041, 2410:05, "Statusword"; may be given several times
    ///
    /// Names are those of the data sheet, so the device has to be known.
    #[arg(long, value_name = "OBJECT")]
    object: Vec<String>,

    /// Only these COB-IDs, in hexadecimal: 185,280-28F; with eight digits for extended ones
    #[arg(long, value_name = "COB-IDS")]
    cob_id: Option<CobIds>,

    /// Only lines with this text, in upper or lower case; may be given several times
    #[arg(long, value_name = "TEXT")]
    text: Vec<String>,
}

impl FilterArgs {
    pub(crate) fn filter(&self) -> Filter {
        Filter {
            nodes: self.node.as_ref().map(|nodes| nodes.0.clone()).unwrap_or_default(),
            services: self.service.clone(),
            without: self.without.clone(),
            objects: self.object.clone(),
            ids: self.cob_id.clone(),
            texts: self.text.clone(),
        }
    }
}
