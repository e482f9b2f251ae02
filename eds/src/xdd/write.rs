//! Writes a device as XDD or XDC: its objects with all that they say themselves, and a parameter each that says it again, since
//! tools read either the one or the other.

use super::xml::Xml;
use super::{BITSTRING, COMMISSIONING, FEATURES, FILE, IDENTITY, TYPES, access_word, pdo_mapping};
use crate::model::types::DataType;
use crate::model::{AccessType, Device, Entry, Enumeration, Meaning, Object, ObjectList, Properties, Unit};
use crate::write::{self, Said, difference, said};
use crate::{Input, Source};

/// The device as XDD, without the values of a configured device.
#[must_use]
pub fn xdd(device: &Device) -> String {
    written(device, false)
}

/// The device as XDC, with `deviceCommissioning`, `actualValue` and `denotation`.
#[must_use]
pub fn xdc(device: &Device) -> String {
    written(device, true)
}

/// What XML has no word for is seen by reading what was written: it is written again with the keys that were missing then.
fn written(device: &Device, configured: bool) -> String {
    let in_words = if configured { write::dcf } else { write::eds };
    let wanted = in_words(device);
    let write = |rest: &[Said]| Writer { device, said: said(&wanted), configured, xml: Xml::begin() }.document(rest);
    let plain = write(&[]);
    let read = crate::device(&Input::new(Source::new("", plain.as_str())));
    match difference(&in_words(&read), &wanted).as_slice() {
        [] => plain,
        rest => write(rest),
    }
}

struct Writer<'d> {
    device: &'d Device,
    /// The device in the words of CiA 306.
    said: Vec<Said>,
    configured: bool,
    xml: Xml,
}

impl Writer<'_> {
    fn document(mut self, rest: &[Said]) -> String {
        self.profile("Device", "ProfileBody_Device_CANopen");
        self.identity();
        self.rest(rest);
        self.process();
        self.xml.close();
        self.xml.close();
        self.profile("CommunicationNetwork", "ProfileBody_CommunicationNetwork_CANopen");
        self.layers();
        self.network();
        self.xml.finish()
    }

    fn of(&self, section: &str, key: &str) -> Option<&str> {
        let found = self.said.iter().find(|said| said.section == section && said.key == key)?;
        found.value.as_deref().filter(|value| !value.is_empty())
    }

    /// The header of a profile; its body stays open.
    fn profile(&mut self, class: &str, kind: &str) {
        self.xml.open("ISO15745Profile", &[]);
        self.xml.open("ProfileHeader", &[]);
        let name = self.of("DeviceInfo", "ProductName").unwrap_or_default().to_owned();
        let source = self.of("DeviceInfo", "VendorName").unwrap_or_default().to_owned();
        self.xml.text("ProfileIdentification", &[], "CANopen device profile");
        self.xml.text("ProfileRevision", &[], "1.1");
        self.xml.text("ProfileName", &[], &name);
        self.xml.text("ProfileSource", &[], &source);
        self.xml.text("ProfileClassID", &[], class);
        self.xml.open("ISO15745Reference", &[]);
        self.xml.text("ISO15745Part", &[], "1");
        self.xml.text("ISO15745Edition", &[], "1");
        self.xml.text("ProfileTechnology", &[], "CANopen");
        self.xml.close();
        self.xml.close();
        let file: Vec<(&str, String)> =
            FILE.into_iter().filter_map(|(name, key)| Some((name, self.file(key)?))).collect();
        let kind = format!("co:{kind}");
        let mut attributes = vec![("xsi:type", kind.as_str()), ("formatName", "CANopen"), ("formatVersion", "1.0")];
        attributes.extend(file.iter().map(|(name, value)| (*name, value.as_str())));
        attributes.push(("supportedLanguages", "en"));
        self.xml.open("ProfileBody", &attributes);
    }

    /// What an attribute says of the file; what the schema requires is not left out.
    fn file(&self, key: &str) -> Option<String> {
        let value = self.of("FileInfo", key);
        match key {
            "CreationDate" => value.and_then(date).or_else(|| Some("1970-01-01".to_owned())),
            "ModificationDate" => date(value?),
            "CreationTime" | "ModificationTime" => time(value?),
            "FileName" | "CreatedBy" => Some(value.unwrap_or_default().to_owned()),
            "FileVersion" => Some(value.unwrap_or("0").to_owned()),
            _ => value.map(str::to_owned),
        }
    }

    fn identity(&mut self) {
        self.xml.open("DeviceIdentity", &[]);
        for (name, key) in IDENTITY {
            // CiA 311 wants an order of its own: the text of the product comes before its order number.
            if name == "orderNumber"
                && let Some(description) = self.device.file.description.clone()
            {
                self.xml.with_words("productText", "description", &description);
            }
            let value = self.of("DeviceInfo", key).map(str::to_owned);
            if let Some(value) = value.or_else(|| (name != "orderNumber").then(String::new)) {
                self.xml.text(name, &[], &value);
            }
        }
        self.xml.close();
    }

    /// The keys that XML has no word for.
    fn rest(&mut self, rest: &[Said]) {
        if rest.is_empty() {
            return;
        }
        self.xml.open("DeviceFunction", &[]);
        self.xml.open("capabilities", &[]);
        for of_section in rest.chunk_by(|a, b| a.section == b.section) {
            self.xml.open("characteristicsList", &[]);
            self.xml.with_words("category", "label", &format!("[{}]", of_section[0].section));
            for said in of_section {
                self.xml.open("characteristic", &[]);
                self.xml.with_words("characteristicName", "label", &said.key);
                if let Some(value) = &said.value {
                    self.xml.with_words("characteristicContent", "label", value);
                }
                self.xml.close();
            }
            self.xml.close();
        }
        self.xml.close();
        self.xml.close();
    }

    fn process(&mut self) {
        let device = self.device;
        self.xml.open("ApplicationProcess", &[]);
        let structs: Vec<&Object> = device.objects.iter().filter(|object| has_parameter(object)).collect();
        if !structs.is_empty() {
            self.xml.open("dataTypeList", &[]);
            for object in &structs {
                self.xml
                    .open("struct", &[("name", &object.name), ("uniqueID", &format!("UID_REC_{:04X}", object.index))]);
                for entry in &object.entries {
                    let id = format!("UID_RECSUB_{:04X}{:02X}", entry.index, entry.sub);
                    self.xml.open("varDeclaration", &[("name", &entry.name), ("uniqueID", &id)]);
                    self.xml.empty(type_name(entry.data_type), &[]);
                    self.xml.close();
                }
                self.xml.close();
            }
            self.xml.close();
        }
        self.xml.open("parameterList", &[]);
        for object in &device.objects {
            if has_parameter(object) {
                self.xml.open("parameter", &[("uniqueID", &id_of(object, None))]);
                self.texts(&object.name, object.description.as_deref());
                self.xml.empty("dataTypeIDRef", &[("uniqueIDRef", &format!("UID_REC_{:04X}", object.index))]);
                self.properties(object.properties.as_deref());
                self.xml.close();
            }
            for entry in &object.entries {
                self.parameter(object, entry);
            }
        }
        self.xml.close();
        self.xml.close();
    }

    fn parameter(&mut self, object: &Object, entry: &Entry) {
        let id = id_of(object, Some(entry));
        let unit = single_unit(self.device, entry);
        let multiplier = unit.and_then(decimal).unwrap_or_default();
        let mut attributes = vec![("uniqueID", id.as_str()), ("access", access_word(entry.access))];
        attributes.extend(entry.persistent.then_some(("persistent", "true")));
        attributes.extend((!multiplier.is_empty() && multiplier != "1").then_some(("multiplier", multiplier.as_str())));
        self.xml.open("parameter", &attributes);
        self.texts(&entry.name, entry.description.as_deref());
        self.xml.empty(type_name(entry.data_type), &[]);
        let [default, low, high, configured, denotation] = self.values(entry);
        if let Some(denotation) = &denotation {
            self.xml.with_words("denotation", "label", denotation);
        }
        for (name, value) in [("actualValue", configured), ("defaultValue", default)] {
            if let Some(value) = value {
                self.xml.empty(name, &[("value", &value)]);
            }
        }
        let enumeration = enumeration(self.device, entry);
        let range = low.zip(high);
        if enumeration.is_some() || range.is_some() {
            self.xml.open("allowedValues", &[]);
            for named in enumeration.iter().flat_map(|enumeration| &enumeration.values) {
                self.xml.open("value", &[("value", &named.value.to_string())]);
                self.texts(&named.name, named.description.as_deref());
                self.xml.close();
            }
            if let Some((low, high)) = range {
                self.xml.open("range", &[]);
                self.xml.empty("minValue", &[("value", &low)]);
                self.xml.empty("maxValue", &[("value", &high)]);
                self.xml.close();
            }
            self.xml.close();
        }
        if let Some(unit) = unit.filter(|_| !multiplier.is_empty()) {
            self.xml.open("unit", &[("multiplier", "1")]);
            self.xml.words("label", &unit.symbol);
            self.xml.close();
        }
        self.properties(entry.properties.as_deref());
        self.xml.close();
    }

    /// `label` and `description`.
    fn texts(&mut self, label: &str, description: Option<&str>) {
        self.xml.words("label", label);
        if let Some(description) = description {
            self.xml.words("description", description);
        }
    }

    fn properties(&mut self, properties: Option<&Properties>) {
        for (name, value) in properties.map(|properties| &properties.0).into_iter().flatten() {
            self.xml.empty("property", &[("name", name), ("value", value)]);
        }
    }

    fn layers(&mut self) {
        let device = self.device;
        self.xml.open("ApplicationLayers", &[]);
        let count = |list: ObjectList| device.objects.iter().filter(|object| object.list == list).count().to_string();
        let counts = [ObjectList::Mandatory, ObjectList::Optional, ObjectList::Manufacturer].map(count);
        let names = ["mandatoryObjects", "optionalObjects", "manufacturerObjects"];
        let counts: Vec<_> = names.into_iter().zip(counts.iter().map(String::as_str)).collect();
        self.xml.open("CANopenObjectList", &counts);
        for object in &device.objects {
            self.object(object);
        }
        self.xml.close();
        self.xml.open("dummyUsage", &[]);
        for code in 1..=7 {
            let usable = device.dummies.contains(&DataType::from_code(code));
            self.xml.empty("dummy", &[("entry", &format!("Dummy{code:04X}={}", u8::from(usable)))]);
        }
        self.xml.close();
        self.xml.close();
    }

    fn object(&mut self, object: &Object) {
        let mut attributes = vec![("index", format!("{:04X}", object.index)), ("name", object.name.clone())];
        attributes.push(("objectType", object.kind.code().to_string()));
        if object.kind.has_subs() {
            if has_parameter(object) {
                attributes.push(("uniqueIDRef", id_of(object, None)));
            }
            attributes.extend(object.denotation.clone().filter(|_| self.configured).map(|text| ("denotation", text)));
        }
        if object.flags != 0 {
            attributes.push(("objFlags", format!("{:04X}", object.flags)));
        }
        if !object.kind.has_subs() {
            if let Some(entry) = object.entries.first() {
                self.attributes(object, entry, &mut attributes);
            }
            return self.xml.empty("CANopenObject", &borrowed(&attributes));
        }
        attributes.push(("subNumber", object.entries.len().to_string()));
        self.xml.open("CANopenObject", &borrowed(&attributes));
        for entry in &object.entries {
            let kind = if entry.data_type == DataType::Domain { "2" } else { "7" };
            let mut attributes = vec![("subIndex", format!("{:02X}", entry.sub)), ("name", entry.name.clone())];
            attributes.push(("objectType", kind.to_owned()));
            self.attributes(object, entry, &mut attributes);
            self.xml.empty("CANopenSubObject", &borrowed(&attributes));
        }
        self.xml.close();
    }

    /// What an object with a value says itself, for readers that do not look at its parameter.
    fn attributes(&self, object: &Object, entry: &Entry, attributes: &mut Vec<(&str, String)>) {
        if entry.data_type != DataType::Other(0) {
            attributes.push(("dataType", format!("{:04X}", entry.data_type.code())));
        }
        let is_one_way = matches!(entry.access, AccessType::Rwr | AccessType::Rww);
        let access = if is_one_way { "rw" } else { entry.access.name() };
        attributes.push(("accessType", access.to_owned()));
        let mapping = if entry.pdo_mapping { pdo_mapping(entry.access) } else { "no" };
        attributes.push(("PDOmapping", mapping.to_owned()));
        let names = ["defaultValue", "lowLimit", "highLimit", "actualValue", "denotation"];
        let named = names.into_iter().zip(self.values(entry));
        attributes.extend(named.filter_map(|(name, value)| Some((name, value?))));
        attributes.push(("uniqueIDRef", id_of(object, Some(entry))));
    }

    /// Default, limits, value and denotation of an entry as CiA 306 writes them.
    fn values(&self, entry: &Entry) -> [Option<String>; 5] {
        let text = |value: &Option<_>| value.as_ref().map(|value| write::value(value, entry.data_type));
        let [default, low, high] = [&entry.default, &entry.low, &entry.high].map(text);
        let configured = text(&entry.configured).filter(|_| self.configured);
        [default, low, high, configured, entry.denotation.clone().filter(|_| self.configured)]
    }

    fn network(&mut self) {
        self.xml.open("TransportLayers", &[]);
        self.xml.open("PhysicalLayer", &[]);
        self.xml.open("baudRate", &[]);
        for rate in &self.device.info.bit_rates_kbit {
            self.xml.empty("supportedBaudRate", &[("value", &kbps(rate))]);
        }
        (0..3).for_each(|_| self.xml.close());
        self.xml.open("NetworkManagement", &[]);
        let is_flag = |default: Option<&str>| default == Some("false");
        let features = FEATURES.map(|(name, key, default)| {
            let value = self.of("DeviceInfo", key).or(default).unwrap_or("0");
            (name, if is_flag(default) { boolean(value) } else { value }.to_owned())
        });
        self.xml.empty("CANopenGeneralFeatures", &borrowed(&features));
        let master = self.device.info.simple_boot_up_master;
        self.xml.empty("CANopenMasterFeatures", &[("bootUpMaster", if master { "true" } else { "false" })]);
        if self.device.commissioning.is_some() && self.configured {
            let said = COMMISSIONING.into_iter().filter_map(|(name, key)| {
                let value = self.of("DeviceComissioning", key)?;
                let value = match key {
                    "Baudrate" => kbps(value),
                    "CANopenManager" => boolean(value).to_owned(),
                    _ => value.to_owned(),
                };
                Some((name, value))
            });
            let said: Vec<_> = said.collect();
            self.xml.empty("deviceCommissioning", &borrowed(&said));
        }
    }
}

fn borrowed<'a>(attributes: &'a [(&'a str, String)]) -> Vec<(&'a str, &'a str)> {
    attributes.iter().map(|(name, value)| (*name, value.as_str())).collect()
}

/// An object with sub-indices needs a parameter only for what has no other place.
fn has_parameter(object: &Object) -> bool {
    object.kind.has_subs() && (object.description.is_some() || object.properties.is_some())
}

/// As CANopenEditor makes them.
fn id_of(object: &Object, entry: Option<&Entry>) -> String {
    match entry.filter(|_| object.kind.has_subs()) {
        Some(entry) => format!("UID_SUB_{:04X}{:02X}", entry.index, entry.sub),
        None => format!("UID_OBJ_{:04X}", object.index),
    }
}

pub(super) fn type_name(data_type: DataType) -> &'static str {
    TYPES.iter().find(|(_, known)| *known == data_type).map_or(BITSTRING, |(name, _)| name)
}

/// The unit that a number always has.
fn single_unit<'d>(device: &'d Device, entry: &Entry) -> Option<&'d Unit> {
    let Meaning::Quantity(name) = &entry.meaning else { return None };
    match device.quantities.get(name)?.units.as_slice() {
        [unit] if unit.when.is_none() => Some(unit),
        _ => None,
    }
}

fn enumeration<'d>(device: &'d Device, entry: &Entry) -> Option<&'d Enumeration> {
    let Meaning::Enumeration(name) = &entry.meaning else { return None };
    device.enumerations.get(name)
}

/// What one count is worth as a decimal number, if it is one.
fn decimal(unit: &Unit) -> Option<String> {
    let (digits, power) =
        (0..10).map(|digits| (digits, 10_i64.pow(digits))).find(|(_, power)| power % unit.den == 0)?;
    let number = unit.num.checked_mul(power / unit.den)?;
    let (whole, rest) = (number.unsigned_abs() / power as u64, number.unsigned_abs() % power as u64);
    let sign = if number < 0 { "-" } else { "" };
    Some(if digits == 0 {
        format!("{sign}{whole}")
    } else {
        format!("{sign}{whole}.{rest:0digits$}", digits = digits as usize)
    })
}

pub(super) fn boolean(flag: &str) -> &str {
    match flag {
        "1" => "true",
        "0" => "false",
        other => other,
    }
}

pub(super) fn kbps(rate: impl std::fmt::Display) -> String {
    format!("{rate} Kbps")
}

/// `11-28-2020`, as XML writes it.
pub(super) fn date(text: &str) -> Option<String> {
    let parts: Vec<&str> = text.split('-').collect();
    let [month, day, year] = parts.as_slice() else { return None };
    Some(format!("{year}-{month}-{day}"))
}

/// `04:49PM`, as XML writes it.
pub(super) fn time(text: &str) -> Option<String> {
    let upper = text.to_ascii_uppercase();
    let half = if upper.ends_with("PM") { 12 } else { 0 };
    let (hours, minutes) = upper.strip_suffix(if half > 0 { "PM" } else { "AM" })?.split_once(':')?;
    let hours = hours.parse::<u8>().ok().filter(|hours| *hours <= 12)?;
    Some(format!("{:02}:{minutes}:00", hours % 12 + half))
}
