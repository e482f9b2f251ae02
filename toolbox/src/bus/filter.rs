//! Filters: which frames to show.

use std::fmt;
use std::str::FromStr;

use lexican_runtime::cia301::connection;
use lexican_runtime::object::Address;
use lexican_runtime::{CobId, Frame, NodeId};

use crate::bus::cob_ids::CobIds;
use crate::bus::transfers::Transfer;
use crate::decode::{Decoded, Detail, Service};
use crate::values::lookup::same_name;
use crate::values::report::ValueReport;

/// A filter for frames. A frame must meet all conditions; a condition with several values is met by any of them, one
/// without values by every frame.
#[derive(Clone, Debug, Default)]
pub struct Filter {
    /// The node that sends or receives the frame; broadcasts have none.
    pub nodes: Vec<NodeId>,
    /// The protocol.
    pub services: Vec<ServiceFilter>,
    /// Protocols to hide.
    pub without: Vec<ServiceFilter>,
    /// Objects: a frame carries the value of one, or belongs to its transfer.
    pub objects: Vec<String>,
    /// The COB-ID.
    pub ids: Option<CobIds>,
    /// Texts that the frame's text contains, in upper or lower case.
    pub texts: Vec<String>,
}

impl Filter {
    /// Whether a frame is shown.
    #[must_use]
    pub fn matches(&self, frame: &Frame, decoded: &Decoded) -> bool {
        let text = || format!("{} {}", decoded.name, decoded.text);
        let is_object = |object: &String| reports(&decoded.detail).iter().any(|it| is_object(it, object));
        self.accepts(decoded.node, decoded.service, &[frame.id()], is_object, text)
    }

    /// Whether an SDO transfer is shown.
    #[must_use]
    pub fn matches_transfer(&self, transfer: &Transfer) -> bool {
        let ids = [connection::SDO_REQUEST, connection::SDO_RESPONSE].map(|base| CobId::of_node(base, transfer.node));
        let is_object = |object: &String| transfer.report.iter().any(|it| is_object(it, object));
        self.accepts(Some(transfer.node), Service::Sdo, &ids, is_object, || transfer.to_string())
    }

    /// Whether a frame is shown of which only entries, name and text are known.
    ///
    /// Objects are compared by address, or by name in the text.
    #[must_use]
    pub fn matches_words(
        &self,
        node: Option<NodeId>,
        service: Service,
        id: CobId,
        addresses: &[Address],
        (name, text): (&str, &str),
    ) -> bool {
        let is_object = |object: &String| {
            addresses.iter().any(|address| is_address(*address, object))
                || !addresses.is_empty() && text.to_lowercase().contains(&object.to_lowercase())
        };
        self.accepts(node, service, &[id], is_object, || format!("{name} {text}"))
    }

    fn accepts(
        &self,
        node: Option<NodeId>,
        service: Service,
        ids: &[CobId],
        is_object: impl Fn(&String) -> bool,
        text: impl Fn() -> String,
    ) -> bool {
        fn any<T>(values: &[T], matches: impl Fn(&T) -> bool) -> bool {
            values.is_empty() || values.iter().any(matches)
        }
        any(&self.nodes, |wanted| node == Some(*wanted))
            && any(&self.services, |it| it.matches(service))
            && !self.without.iter().any(|it| it.matches(service))
            && self.ids.as_ref().is_none_or(|wanted| ids.iter().any(|id| wanted.contains(*id)))
            && any(&self.objects, is_object)
            && any(&self.texts, |wanted| text().to_lowercase().contains(&wanted.to_lowercase()))
    }
}

/// The entries that a frame carries or names.
fn reports(detail: &Detail) -> &[ValueReport] {
    match detail {
        Detail::Pdo(pdo) => &pdo.fields,
        Detail::Sdo(sdo) => sdo.report.as_slice(),
        _ => &[],
    }
}

/// Whether a text means this entry: by its address, the index of its object, or its name.
fn is_object(report: &ValueReport, text: &str) -> bool {
    is_address(report.address, text)
        || [&report.name, &report.entry].into_iter().flatten().any(|name| same_name(name, text))
}

/// Whether a text is the address of an entry, or the index of its object.
fn is_address(address: Address, text: &str) -> bool {
    let address = address.to_string();
    let index = address.split(':').next().unwrap_or_default();
    let wanted = text.trim_start_matches("0x").trim_end_matches(['h', 'H']);
    wanted.eq_ignore_ascii_case(&address) || wanted.eq_ignore_ascii_case(index)
}

/// A protocol, or a group of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServiceFilter(usize);

/// The words of users, and the protocols that they stand for.
const SERVICES: &[(&str, &[Service])] = &[
    ("nmt", &[Service::Nmt]),
    ("sync", &[Service::Sync]),
    ("time", &[Service::Time]),
    ("emcy", &[Service::Emcy]),
    ("pdo", &[Service::Rpdo, Service::Tpdo]),
    ("rpdo", &[Service::Rpdo]),
    ("tpdo", &[Service::Tpdo]),
    ("sdo", &[Service::Sdo]),
    ("heartbeat", &[Service::ErrorControl]),
    ("lss", &[Service::Lss]),
    ("unknown", &[Service::Unknown]),
];

impl ServiceFilter {
    fn matches(self, service: Service) -> bool {
        SERVICES[self.0].1.contains(&service)
    }
}

impl fmt::Display for ServiceFilter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(SERVICES[self.0].0)
    }
}

impl FromStr for ServiceFilter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = SERVICES.iter().position(|(name, _)| name.eq_ignore_ascii_case(text));
        found.map(ServiceFilter).ok_or_else(|| {
            let names: Vec<_> = SERVICES.iter().map(|(name, _)| *name).collect();
            format!("there is no service {text:?}; there is {}", names.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::Decoder;
    use crate::samples;
    use lexican_runtime::host::candump::Line;

    /// Checks which frames of a sample bus a filter shows.
    #[track_caller]
    fn check(filter: &Filter, expected: &str) {
        let bus = "000#0105 080# 085#2031050000000000 185#3702 185#3702000000 605#4018100100000000 \
                   585#4318100195010000 606#4018100100000000 705#05 706#05 7E5#0401000000000000 12345678#00";
        let device = samples::drive();
        let mut decoder = Decoder::new();
        decoder.introduce(NodeId::literal(5), &device);
        let shown = bus.split_ascii_whitespace().filter(|text| {
            let frame = format!("(0.000000) can0 {text}").parse::<Line>().unwrap().frame;
            let decoded = decoder.decode(&frame);
            filter.matches(&frame, &decoded)
        });
        let shown: Vec<_> = shown.map(|text| text.split('#').next().unwrap()).collect();
        assert_eq!(shown.join(" "), expected, "{filter:?}");
    }

    fn services(text: &str) -> Vec<ServiceFilter> {
        text.split(',').map(|name| name.parse().unwrap()).collect()
    }

    #[test]
    fn a_frame_fulfils_every_condition_by_one_of_its_values() {
        let all = Filter::default();
        let node = NodeId::literal;
        check(&all, "000 080 085 185 185 605 585 606 705 706 7E5 12345678");
        check(&Filter { nodes: vec![node(6), node(7)], ..all.clone() }, "606 706");
        check(&Filter { services: services("emcy,heartbeat"), ..all.clone() }, "085 705 706");
        check(&Filter { services: services("pdo"), nodes: vec![node(5)], ..all.clone() }, "185 185");
        check(&Filter { without: services("pdo,sdo,heartbeat,sync,nmt"), ..all.clone() }, "085 7E5 12345678");
        check(&Filter { ids: "180-5FF,7E5".parse().ok(), ..all.clone() }, "185 185 585 7E5");
        check(&Filter { ids: "12345678".parse().ok(), ..all.clone() }, "12345678");
        for object in ["Statusword", "6041", "6041:00", "0x6041"] {
            check(&Filter { objects: vec![object.to_owned()], ..all.clone() }, "185 185");
        }
        for object in ["1018", "1018h"] {
            check(&Filter { objects: vec![object.to_owned()], ..all.clone() }, "605 585 606");
        }
        check(&Filter { objects: vec!["vendor-id".to_owned()], ..all.clone() }, "605 585");
        check(&Filter { objects: vec!["1018:02".to_owned()], ..all.clone() }, "");
        check(&Filter { texts: vec!["VENDOR".to_owned()], ..all }, "605 585");
    }

    #[test]
    fn other_words_are_refused() {
        assert!("pdos".parse::<ServiceFilter>().unwrap_err().contains("nmt, sync, time"));
    }
}
