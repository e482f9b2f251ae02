//! Writes a device as EDS or DCF (CiA 306-1). Reading the text gives the same device, except for overlays, which these
//! formats cannot express.

use std::collections::BTreeMap;
use std::fmt::{Display, Write as _};

use crate::dump::value_text;
use crate::model::types::{Class, DataType};
use crate::model::{Commissioning, Device, DeviceInfo, Entry, FileInfo, Module, Object, ObjectKind, ObjectList, Value};
use crate::parse::syntax::Line;

/// The device as EDS, without configured values. Lines end with CR LF.
#[must_use]
pub fn eds(device: &Device) -> String {
    Writer { out: String::new(), configured: false }.device(device)
}

/// The device as DCF, with `[DeviceComissioning]`, `ParameterValue` and `Denotation`. Lines end with CR LF.
#[must_use]
pub fn dcf(device: &Device) -> String {
    Writer { out: String::new(), configured: true }.device(device)
}

/// The sections of an object, line by line.
pub(crate) fn object_lines(object: &Object) -> Vec<String> {
    let mut writer = Writer { out: String::new(), configured: true };
    writer.object("", object);
    writer.lines()
}

/// The section of a sub-index, line by line.
pub(crate) fn entry_lines(entry: &Entry) -> Vec<String> {
    let mut writer = Writer { out: String::new(), configured: true };
    writer.sub(&format!("{:04X}", entry.index), entry);
    writer.lines()
}

/// A value of a data type, in one line.
pub(crate) fn value(value: &Value, data_type: DataType) -> String {
    match value {
        Value::Integer(number) if data_type.class() == Class::Unsigned && *number > 0xFFFF => format!("0x{number:X}"),
        // Uses an exponent for long numbers.
        Value::Real(number) => format!("{number:?}"),
        other => one_line(&value_text(other)),
    }
}

/// A key of a data sheet; without a value, it is to be removed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Said {
    pub(crate) section: String,
    pub(crate) key: String,
    pub(crate) value: Option<String>,
}

/// All keys of a text written by this module.
pub(crate) fn said(text: &str) -> Vec<Said> {
    let mut section = String::new();
    let mut said = Vec::new();
    for line in text.lines() {
        match Line::of(line) {
            Line::Section { name, .. } => section = name.to_owned(),
            Line::Pair { key, value, .. } => {
                said.push(Said { section: section.clone(), key: key.to_owned(), value: Some(value.to_owned()) });
            }
            _ => {}
        }
    }
    said
}

/// The changes of keys that turn the first text into the second, by section.
pub(crate) fn difference(from: &str, to: &str) -> Vec<Said> {
    type Keys = BTreeMap<(String, String), Option<String>>;
    let keys = |text: &str| said(text).into_iter().map(|it| ((it.section, it.key), it.value)).collect::<Keys>();
    let (mut from, mut changes) = (keys(from), keys(to));
    changes.retain(|key, value| from.remove(key).as_ref() != Some(value));
    changes.extend(from.into_keys().map(|key| (key, None)));
    changes.into_iter().map(|((section, key), value)| Said { section, key, value }).collect()
}

/// The name of a list's section.
pub(crate) fn list_name(list: ObjectList) -> &'static str {
    match list {
        ObjectList::Mandatory => "MandatoryObjects",
        ObjectList::Optional => "OptionalObjects",
        ObjectList::Manufacturer => "ManufacturerObjects",
    }
}

struct Writer {
    out: String,
    /// Whether a DCF is written.
    configured: bool,
}

impl Writer {
    fn device(mut self, device: &Device) -> String {
        self.file_info(&device.file);
        self.device_info(&device.info);
        if let Some(commissioning) = device.commissioning.as_ref().filter(|_| self.configured) {
            self.commissioning(commissioning);
        }
        self.dummies(&device.dummies);
        if !device.comments.is_empty() {
            self.comments("Comments", &device.comments);
        }
        self.tools(device);
        self.channels(device);
        self.modules(device);
        for list in [ObjectList::Mandatory, ObjectList::Optional, ObjectList::Manufacturer] {
            let objects = device.objects.iter().filter(|object| object.list == list);
            self.numbered(list_name(list), "SupportedObjects", objects.map(|object| hex4(object.index)));
            for object in device.objects.iter().filter(|object| object.list == list) {
                self.object("", object);
            }
        }
        self.out
    }

    fn file_info(&mut self, file: &FileInfo) {
        self.section("FileInfo");
        self.text("FileName", &file.name);
        self.number("FileVersion", file.version);
        self.number("FileRevision", file.revision);
        self.text("EDSVersion", &file.eds_version);
        self.text("Description", &file.description);
        self.text("CreationTime", &file.creation_time);
        self.text("CreationDate", &file.creation_date);
        self.text("CreatedBy", &file.created_by);
        self.text("ModificationTime", &file.modification_time);
        self.text("ModificationDate", &file.modification_date);
        self.text("ModifiedBy", &file.modified_by);
        self.text("LastEDS", &file.last_eds);
    }

    fn device_info(&mut self, info: &DeviceInfo) {
        self.section("DeviceInfo");
        self.text("VendorName", &info.vendor_name);
        self.number("VendorNumber", info.vendor_number.map(hex));
        self.text("ProductName", &info.product_name);
        self.number("ProductNumber", info.product_number.map(hex));
        self.number("RevisionNumber", info.revision_number.map(hex));
        self.text("OrderCode", &info.order_code);
        for bit_rate in [10, 20, 50, 100, 125, 250, 500, 800, 1000] {
            self.flag(&format!("BaudRate_{bit_rate}"), info.bit_rates_kbit.contains(&bit_rate));
        }
        self.flag("SimpleBootUpMaster", info.simple_boot_up_master);
        self.flag("SimpleBootUpSlave", info.simple_boot_up_slave);
        self.number("Granularity", info.granularity);
        self.flag("DynamicChannelsSupported", info.dynamic_channels);
        self.flag("GroupMessaging", info.group_messaging);
        self.number("NrOfRXPDO", info.receive_pdos);
        self.number("NrOfTXPDO", info.transmit_pdos);
        self.flag("LSS_Supported", info.lss);
        if info.compact_pdo != 0 {
            self.pair("CompactPDO", hex(info.compact_pdo));
        }
        if info.safety {
            self.flag("CANopenSafetySupported", true);
        }
        for (key, value) in &info.reserved {
            self.pair(key, one_line(value));
        }
    }

    fn commissioning(&mut self, commissioning: &Commissioning) {
        // The standard spells it with one m.
        self.section("DeviceComissioning");
        self.number("NodeID", commissioning.node_id);
        self.text("NodeName", &commissioning.node_name);
        self.text("NodeRefd", &commissioning.node_designator);
        self.number("Baudrate", commissioning.bit_rate_kbit);
        self.number("NetNumber", commissioning.net_number);
        self.text("NetworkName", &commissioning.network_name);
        self.text("NetRefd", &commissioning.network_designator);
        self.number("CANopenManager", commissioning.manager.map(u8::from));
        self.number("LSS_SerialNumber", commissioning.serial_number);
    }

    fn dummies(&mut self, dummies: &[DataType]) {
        if dummies.is_empty() {
            return;
        }
        self.section("DummyUsage");
        for &data_type in DataType::ALL {
            let usable = dummies.contains(&data_type);
            if usable || data_type.code() <= 7 {
                self.flag(&format!("Dummy{:04X}", data_type.code()), usable);
            }
        }
        for data_type in dummies.iter().filter(|data_type| matches!(data_type, DataType::Other(_))) {
            self.flag(&format!("Dummy{:04X}", data_type.code()), true);
        }
    }

    fn comments(&mut self, section: &str, lines: &[String]) {
        self.section(section);
        self.pair("Lines", lines.len());
        for (line, number) in lines.iter().zip(1..) {
            self.pair(&format!("Line{number}"), one_line(line));
        }
    }

    fn tools(&mut self, device: &Device) {
        if device.tools.is_empty() {
            return;
        }
        self.section("Tools");
        self.pair("Items", device.tools.len());
        for (tool, number) in device.tools.iter().zip(1..) {
            self.section(&format!("Tool{number}"));
            self.pair("Name", one_line(&tool.name));
            self.pair("Command", one_line(&tool.command));
        }
    }

    fn channels(&mut self, device: &Device) {
        if device.channels.is_empty() {
            return;
        }
        self.section("DynamicChannels");
        self.pair("NrOfSeg", device.channels.len());
        for (channel, number) in device.channels.iter().zip(1..) {
            self.pair(&format!("Type{number}"), hex4(channel.data_type.code()));
            self.pair(&format!("Dir{number}"), channel.access.name());
            self.pair(&format!("Range{number}"), format!("{}-{}", hex4(channel.first), hex4(channel.last)));
            self.pair(&format!("PPOffset{number}"), channel.offset);
        }
    }

    fn modules(&mut self, device: &Device) {
        if !device.modules.is_empty() {
            self.section("SupportedModules");
            // The count stands for modules 1 to n without gaps; others are written as sections.
            let gapless = device.modules.iter().zip(1..).take_while(|(module, number)| module.number == *number);
            self.pair("NrOfEntries", gapless.count());
            for module in &device.modules {
                self.module(module);
            }
        }
        if !device.connected_modules.is_empty() {
            self.numbered("ConnectedModules", "NrOfEntries", device.connected_modules.iter());
        }
    }

    fn module(&mut self, module: &Module) {
        let prefix = format!("M{}", module.number);
        self.section(&format!("{prefix}ModuleInfo"));
        self.text("ProductName", &module.product_name);
        self.number("ProductVersion", module.product_version);
        self.number("ProductRevision", module.product_revision);
        self.text("OrderCode", &module.order_code);
        if !module.comments.is_empty() {
            self.comments(&format!("{prefix}Comments"), &module.comments);
        }
        if !module.fixed.is_empty() {
            let indices = module.fixed.iter().map(|object| hex4(object.index));
            self.numbered(&format!("{prefix}FixedObjects"), "NrOfEntries", indices);
            for object in &module.fixed {
                self.object(&format!("{prefix}Fixed"), object);
            }
        }
        if !module.extends.is_empty() {
            let indices = module.extends.iter().map(|extension| hex4(extension.entry.index));
            self.numbered(&format!("{prefix}SubExtends"), "NrOfEntries", indices);
            for extension in &module.extends {
                self.section(&format!("{prefix}SubExt{:04X}", extension.entry.index));
                let counts: Vec<String> = extension.count.iter().map(u16::to_string).collect();
                self.pair("Count", counts.join(","));
                self.flag("ObjExtend", extension.next_index);
                self.pair("ObjectType", format_args!("0x{:X}", extension.kind.code()));
                self.entry(&extension.entry);
            }
        }
    }

    fn object(&mut self, prefix: &str, object: &Object) {
        let name = format!("{prefix}{:04X}", object.index);
        self.section(&name);
        if object.kind.has_subs() {
            self.name(&object.name);
        }
        self.pair("ObjectType", format_args!("0x{:X}", object.kind.code()));
        if object.flags != 0 {
            self.pair("ObjFlags", hex(object.flags));
        }
        if object.kind.has_subs() {
            self.pair("SubNumber", object.entries.len());
            if self.configured {
                self.text("Denotation", &object.denotation);
                self.text("ParamRefd", &object.designator);
            }
        }
        for entry in &object.entries {
            if object.kind.has_subs() {
                self.sub(&name, entry);
            } else {
                self.entry(entry);
            }
        }
        if !object.links.is_empty() {
            let links = object.links.iter().map(|&link| hex4(link));
            self.numbered(&format!("{name}ObjectLinks"), "ObjectLinks", links);
        }
    }

    fn sub(&mut self, object: &str, entry: &Entry) {
        self.section(&format!("{object}sub{:X}", entry.sub));
        let kind = if entry.data_type == DataType::Domain { ObjectKind::Domain } else { ObjectKind::Variable };
        self.name(&entry.name);
        self.pair("ObjectType", format_args!("0x{:X}", kind.code()));
        self.attributes(entry);
    }

    /// The lines without the empty ones between sections.
    fn lines(self) -> Vec<String> {
        self.out.lines().filter(|line| !line.is_empty()).map(str::to_owned).collect()
    }

    fn entry(&mut self, entry: &Entry) {
        self.name(&entry.name);
        self.attributes(entry);
    }

    fn attributes(&mut self, entry: &Entry) {
        if entry.data_type != DataType::Other(0) {
            self.pair("DataType", hex4(entry.data_type.code()));
        }
        self.pair("AccessType", entry.access.name());
        let values = [("DefaultValue", &entry.default), ("LowLimit", &entry.low), ("HighLimit", &entry.high)];
        for (key, value) in values {
            self.value(key, value, entry.data_type);
        }
        self.flag("PDOMapping", entry.pdo_mapping);
        if entry.srdo_mapping {
            self.flag("SRDOMapping", true);
        }
        if let Some((index, sub)) = entry.inverted {
            self.pair("InvertedSRAD", format_args!("0x{index:04X}{sub:02X}"));
        }
        if self.configured {
            self.value("ParameterValue", &entry.configured, entry.data_type);
            self.text("Denotation", &entry.denotation);
            self.text("ParamRefd", &entry.designator);
            self.text("UploadFile", &entry.upload_file);
            self.text("DownloadFile", &entry.download_file);
        }
    }

    fn value(&mut self, key: &str, value: &Option<Value>, data_type: DataType) {
        if let Some(value) = value {
            self.pair(key, self::value(value, data_type));
        }
    }

    /// `[name]`, the count under `key`, and `1=`, `2=` and so on.
    fn numbered(&mut self, name: &str, key: &str, values: impl Iterator<Item = impl Display> + Clone) {
        self.section(name);
        self.pair(key, values.clone().count());
        for (value, number) in values.zip(1..) {
            self.pair(&format!("{number}"), value);
        }
    }

    fn section(&mut self, name: &str) {
        let gap = if self.out.is_empty() { "" } else { "\r\n" };
        let _ = write!(self.out, "{gap}[{name}]\r\n");
    }

    fn name(&mut self, name: &str) {
        if !name.is_empty() {
            self.pair("ParameterName", one_line(name));
        }
    }

    fn text(&mut self, key: &str, text: &Option<String>) {
        if let Some(text) = text {
            self.pair(key, one_line(text));
        }
    }

    fn number(&mut self, key: &str, number: Option<impl Display>) {
        if let Some(number) = number {
            self.pair(key, number);
        }
    }

    fn flag(&mut self, key: &str, flag: bool) {
        self.pair(key, u8::from(flag));
    }

    fn pair(&mut self, key: &str, value: impl Display) {
        let _ = write!(self.out, "{key}={value}\r\n");
    }
}

fn hex(number: u32) -> String {
    format!("0x{number:X}")
}

fn hex4(number: u16) -> String {
    format!("0x{number:04X}")
}

/// Line breaks become blanks: a value is one line.
fn one_line(text: &str) -> String {
    text.replace(['\r', '\n'], " ")
}

#[cfg(test)]
mod tests {
    use proptest::collection::{btree_map, vec};
    use proptest::option;
    use proptest::prelude::*;

    use super::*;
    use crate::model::{AccessType, DynamicChannel, EntryDetails, ObjectDetails, Tool};
    use crate::text::Span;
    use crate::{Input, Source, load};

    /// A value of a data sheet: one line without blanks around it.
    fn text() -> impl Strategy<Value = String> {
        "[A-Za-z0-9°/][ -~ü°]{0,30}[A-Za-z0-9°)]"
    }

    fn data_type() -> impl Strategy<Value = DataType> {
        prop_oneof![
            9 => proptest::sample::select(DataType::ALL),
            1 => (0x40..0x60_u16).prop_map(DataType::Other),
        ]
    }

    fn access() -> impl Strategy<Value = AccessType> {
        use AccessType as A;
        proptest::sample::select(vec![A::Ro, A::Wo, A::Rw, A::Rwr, A::Rww, A::Const])
    }

    fn value(data_type: DataType) -> BoxedStrategy<Option<Value>> {
        let value = match data_type.class() {
            Class::Text => text().prop_map(Value::Text).boxed(),
            Class::Bytes => vec(any::<u8>(), 1..9).prop_map(Value::Bytes).boxed(),
            Class::Real if data_type == DataType::Real32 => {
                proptest::num::f32::NORMAL.prop_map(|number| Value::Real(number.into())).boxed()
            }
            Class::Real => proptest::num::f64::NORMAL.prop_map(Value::Real).boxed(),
            Class::Other => any::<i32>().prop_map(|number| Value::Integer(number.into())).boxed(),
            _ => {
                let (low, high) = data_type.range().expect("integers, booleans and times have a range");
                prop_oneof![
                    3 => (low..=high).prop_map(Value::Integer),
                    1 => (0..0x700_i64).prop_map(Value::NodeIdPlus),
                ]
                .boxed()
            }
        };
        option::of(value).boxed()
    }

    prop_compose! {
        fn entry()(data_type in data_type())(
            name in text(),
            data_type in Just(data_type),
            access in access(),
            pdo_mapping in any::<bool>(),
            values in [value(data_type), value(data_type), value(data_type), value(data_type)],
            texts in [option::of(text()), option::of(text()), option::of(text()), option::of(text())],
            srdo_mapping in any::<bool>(),
            inverted in option::of(any::<(u16, u8)>()),
        ) -> Entry {
            let [default, configured, low, high] = values;
            let [denotation, designator, upload_file, download_file] = texts;
            // Two zeros would be read as no limits.
            let is_zero = |limit: &Option<Value>| matches!(limit, Some(Value::Integer(0) | Value::Real(0.0)));
            let (low, high) = if is_zero(&low) && is_zero(&high) { (None, None) } else { (low, high) };
            let entry = Entry { name, data_type, access, pdo_mapping, default, ..Entry::new(0, 0, Span::default()) };
            entry.with_details(EntryDetails {
                configured, low, high, denotation, designator, upload_file, download_file, srdo_mapping, inverted,
                ..EntryDetails::default()
            })
        }
    }

    prop_compose! {
        fn object()(
            name in text(),
            kind in proptest::sample::select(vec![
                ObjectKind::Null, ObjectKind::Domain, ObjectKind::DefType, ObjectKind::DefStruct,
                ObjectKind::Variable, ObjectKind::Array, ObjectKind::Record,
            ]),
            list in proptest::sample::select(vec![
                ObjectList::Mandatory, ObjectList::Optional, ObjectList::Manufacturer,
            ]),
            single in entry(),
            entries in btree_map(any::<u8>(), entry(), 0..5),
            flags in 0..4_u32,
            links in vec(any::<u16>(), 0..3),
            [denotation, designator] in [option::of(text()), option::of(text())],
        ) -> Object {
            let entries = if kind.has_subs() { entries } else { [(0, single)].into() };
            let entries = entries.into_iter().map(|(sub, entry)| Entry { sub, ..entry }).collect::<Vec<_>>();
            // A single value has the name and denotation of its entry.
            let name = if kind.has_subs() { name } else { entries[0].name.clone() };
            let [denotation, designator] = [denotation, designator].map(|text| text.filter(|_| kind.has_subs()));
            let object = Object { name, list, entries, flags, ..Object::new(0, kind, Span::default()) };
            object.with_details(ObjectDetails { links, denotation, designator, ..ObjectDetails::default() })
        }
    }

    prop_compose! {
        fn device()(
            objects in btree_map(any::<u16>(), object(), 0..6),
            fixed in btree_map(any::<u16>(), object(), 0..2),
            comments in vec(text(), 0..3),
            texts in [option::of(text()), option::of(text()), option::of(text())],
            numbers in [option::of(any::<u32>()), option::of(any::<u32>()), option::of(any::<u32>())],
            bytes in [option::of(any::<u8>()), option::of(any::<u8>()), option::of(any::<u8>())],
            flags in any::<[bool; 6]>(),
            bit_rates_kbit in proptest::sample::subsequence(vec![10, 20, 50, 100, 125, 250, 500, 800, 1000], 0..9),
            dummies in proptest::sample::subsequence(DataType::ALL.to_vec(), 0..9),
            commissioning in any::<bool>(),
            channel in option::of((data_type(), access(), any::<u16>(), any::<u16>(), any::<u32>())),
        ) -> Device {
            let indexed = |objects: std::collections::BTreeMap<u16, Object>| -> Vec<Object> {
                objects.into_iter().map(|(index, object)| {
                    let entries = object.entries.iter().map(|entry| Entry { index, ..entry.clone() }).collect();
                    Object { index, entries, ..object }
                }).collect()
            };
            let [vendor_name, product_name, order_code] = texts.clone();
            let [name, description, last_eds] = texts.clone();
            let [node_name, network_name, module_name] = texts;
            let [vendor_number, product_number, revision_number] = numbers;
            let [version, revision, granularity] = bytes;
            let commissioning = commissioning.then(|| Commissioning {
                node_id: version, node_name, node_designator: order_code.clone(), bit_rate_kbit: Some(500),
                net_number: vendor_number, network_name, network_designator: last_eds.clone(),
                manager: Some(flags[0]), serial_number: product_number,
            });
            // Fixed objects of a module are in no list.
            let fixed: Vec<Object> = indexed(fixed).into_iter()
                .map(|object| Object { list: ObjectList::Optional, ..object }).collect();
            let modules = match fixed.is_empty() {
                true => Vec::new(),
                false => vec![Module { number: 1, product_name: module_name, comments: comments.clone(), fixed, ..Module::default() }],
            };
            let mut device = Device {
                file: FileInfo { name, version, revision, description: description.clone(), last_eds, ..FileInfo::default() },
                info: DeviceInfo {
                    vendor_name, vendor_number, product_name, product_number, revision_number, order_code,
                    bit_rates_kbit, granularity,
                    simple_boot_up_master: flags[1], simple_boot_up_slave: flags[2], dynamic_channels: flags[3],
                    group_messaging: flags[4], lss: flags[5],
                    // A defined bit would add objects when the text is read.
                    receive_pdos: Some(1), transmit_pdos: None, compact_pdo: 0x40,
                    safety: flags[0], reserved: description.iter().map(|text| ("NG_Slave", text.clone())).collect(),
                },
                dummies,
                comments,
                commissioning,
                objects: indexed(objects),
                connected_modules: modules.iter().map(|module| module.number).collect(),
                modules,
                channels: channel.into_iter().map(|(data_type, access, first, last, offset)| DynamicChannel {
                    data_type, access, first, last, offset, span: Span::default(),
                }).collect(),
                tools: vec![Tool { name: "tool".into(), command: "tool --eds".into() }],
                ..Device::default()
            };
            device.profile = crate::overlay::profile(&device, &Default::default());
            device.pdos = crate::model::pdo::pdos(&device);
            device
        }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back(device in device()) {
            let text = dcf(&device);
            let (mut read, _) = load(&Input::new(Source::new("x.dcf", text.as_str())));
            read.clear_spans();
            prop_assert_eq!(&read, &device, "{}", text);
            prop_assert_eq!(dcf(&read), text);
        }
    }
}
