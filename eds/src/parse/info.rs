//! The sections about the file and the device (CiA 306-1, 6.3, 6.4 and 7).

use crate::edit::lists::listed;
use crate::finding::Kind;
use crate::model::keys::{BIT_RATES_KBIT, COMMISSIONING, DEVICE_INFO, FILE_INFO};
use crate::model::types::DataType;
use crate::model::{Commissioning, Device, DeviceInfo, FileInfo, ObjectList};
use crate::parse::facts::{List, Listed};
use crate::parse::object::nonempty;
use crate::parse::reader::Reader;
use crate::parse::section::SectionKind;
use crate::parse::syntax::{Pair, Section};

impl<'a, 's> Reader<'a, 's> {
    /// Reads all sections but those of objects and modules; false if the section is of another kind.
    pub(crate) fn info(&mut self, section: &'s Section<'a>, device: &mut Device) -> bool {
        match section.kind {
            SectionKind::FileInfo => device.file = self.file_info(section),
            SectionKind::DeviceInfo => device.info = self.device_info(section),
            SectionKind::DummyUsage => device.dummies = self.dummies(section),
            SectionKind::Comments => device.comments = self.comments(section),
            SectionKind::Commissioning => device.commissioning = Some(self.commissioning(section)),
            _ => return false,
        }
        true
    }

    /// The lines of `[Comments]`, in the order of their numbers.
    pub(crate) fn comments(&mut self, section: &'s Section<'a>) -> Vec<String> {
        let ([count], lines) = self.numbered(section, "Line", 10, &["Lines"]);
        self.count(count, lines.len());
        lines.into_iter().map(|line| line.pair.value.to_owned()).collect()
    }

    fn file_info(&mut self, section: &'s Section<'a>) -> FileInfo {
        let [
            name,
            version,
            revision,
            eds_version,
            description,
            creation_time,
            creation_date,
            created_by,
            modification_time,
            modification_date,
            modified_by,
            last_eds,
        ] = self.fields(section, &FILE_INFO);
        FileInfo {
            name: self.text(name),
            version: self.number(version),
            revision: self.number(revision),
            eds_version: self.text(eds_version),
            description: self.text(description),
            creation_time: self.text(creation_time),
            creation_date: self.text(creation_date),
            created_by: self.text(created_by),
            modification_time: self.text(modification_time),
            modification_date: self.text(modification_date),
            modified_by: self.text(modified_by),
            last_eds: self.text(last_eds),
        }
    }

    fn device_info(&mut self, section: &'s Section<'a>) -> DeviceInfo {
        let fields = self.fields(section, &DEVICE_INFO);
        let [vendor_name, vendor_number, product_name, product_number, revision_number, order_code, rest @ ..] = fields;
        let mut bit_rates_kbit = Vec::new();
        for (bit_rate, pair) in BIT_RATES_KBIT.into_iter().zip(rest) {
            if self.flag(pair) {
                bit_rates_kbit.push(bit_rate);
            }
        }
        let [_, _, _, _, _, _, _, _, _, master, slave, granularity, channels, group, receive, transmit, rest @ ..] =
            rest;
        let [lss, compact, safety, reserved @ ..] = rest;
        let reserved = DEVICE_INFO[DEVICE_INFO.len() - reserved.len()..].iter().zip(reserved);
        DeviceInfo {
            vendor_name: self.text(vendor_name),
            vendor_number: self.number(vendor_number),
            product_name: self.text(product_name),
            product_number: self.number(product_number),
            revision_number: self.number(revision_number),
            order_code: self.text(order_code),
            bit_rates_kbit,
            simple_boot_up_master: self.flag(master),
            simple_boot_up_slave: self.flag(slave),
            granularity: self.number(granularity),
            dynamic_channels: self.number::<u32>(channels).is_some_and(|channels| channels != 0),
            group_messaging: self.flag(group),
            receive_pdos: self.number(receive),
            transmit_pdos: self.number(transmit),
            lss: self.flag(lss),
            compact_pdo: self.number(nonempty(compact)).unwrap_or(0),
            safety: self.flag(safety),
            reserved: reserved.filter_map(|(key, pair)| Some((*key, self.text(pair)?))).collect(),
        }
    }

    fn dummies(&mut self, section: &'s Section<'a>) -> Vec<DataType> {
        let ([], lines) = self.numbered(section, "Dummy", 16, &[]);
        let mut dummies = Vec::new();
        for line in lines {
            let data_type = u16::try_from(line.number).map_or(DataType::Other(0), DataType::from_code);
            if data_type.bits().is_none() {
                self.out.push(Kind::BadDummy(line.number), self.syntax.key_span(line.pair));
            }
            if self.flag(Some(line.pair)) && !data_type.is_unknown() {
                dummies.push(data_type);
            }
        }
        dummies
    }

    fn commissioning(&mut self, section: &'s Section<'a>) -> Commissioning {
        let [
            node_id,
            node_name,
            node_designator,
            bit_rate,
            net_number,
            network_name,
            network_designator,
            manager,
            serial_number,
        ] = self.fields(section, &COMMISSIONING);
        Commissioning {
            node_id: self.number(node_id),
            node_name: self.text(node_name),
            node_designator: self.text(node_designator),
            bit_rate_kbit: self.number(bit_rate),
            net_number: self.number(net_number),
            network_name: self.text(network_name),
            network_designator: self.text(network_designator),
            manager: manager.map(|pair| self.flag(Some(pair))),
            serial_number: self.number(nonempty(serial_number)),
        }
    }

    /// Reads the section if it is a list of objects.
    pub(crate) fn list(&mut self, section: &'s Section<'a>) -> Option<List> {
        let list = match section.kind {
            SectionKind::MandatoryObjects => ObjectList::Mandatory,
            SectionKind::OptionalObjects => ObjectList::Optional,
            SectionKind::ManufacturerObjects => ObjectList::Manufacturer,
            _ => return None,
        };
        let ([said], lines) = self.numbered(section, "", 10, &["SupportedObjects"]);
        let said = said.and_then(|pair| Some((self.number(Some(pair))?, self.syntax.value_span(pair))));
        let mut entries: Vec<Listed> = Vec::with_capacity(lines.len());
        for line in lines {
            if let Some(index) = self.number(Some(line.pair)) {
                entries.push(Listed { number: line.number, index, span: self.syntax.value_span(line.pair) });
            }
        }
        let is_another = |pair: &&Pair<'_>| {
            let (number, index, _) = listed(pair)?;
            let at = entries.binary_search_by_key(&number, |kept| kept.number).ok()?;
            let span = self.syntax.value_span(pair);
            (entries[at].index != index).then_some(Listed { number, index, span })
        };
        let doubled = section.pairs.iter().filter_map(|pair| is_another(&pair)).collect();
        Some(List { list, span: self.syntax.name_span(section), said, entries, doubled })
    }
}
