//! `lexican eds set`, `add` and `remove`: change a data sheet, comments and order kept.

use std::io::Write;
use std::path::PathBuf;

use lexican_eds::edit::{self, EditError, Place};
use lexican_eds::model::{AccessType, Entry, Object, ObjectKind, ObjectList, Value};
use lexican_eds::patch::Patch;
use lexican_eds::types::DataType;
use lexican_eds::{Diagnostic, Input, Severity, Source, Span, diff, standard};
use lexican_runtime::object::Address;
use lexican_toolbox::values::DeviceValues;
use lexican_toolbox::values::lookup::{resolve, same_name};
use serde_json::json;

use super::file;
use crate::output::{self, Failure, Outcome, plural, print_result, warn};
use lexican_toolbox::data_sheet::{DataSheet, with_overlays};

#[derive(clap::Args, Debug)]
struct EditArgs {
    /// The data sheet; XML can be `set` only
    file: String,

    /// Corrections and meanings that go with the data sheet; may be given several times
    #[arg(long, value_name = "FILE")]
    overlay: Vec<PathBuf>,

    /// Print the change, and leave the file as it is
    #[arg(long)]
    dry_run: bool,

    /// Make a change that brings up findings of `lexican eds lint`
    #[arg(long)]
    force: bool,

    /// Print a JSON object: file, written, diff, changes and new findings
    #[arg(long)]
    json: bool,
}

/// Change keys of an object, or of the file, in a data sheet
///
/// Only the lines of these keys change; comments, order, line ends and encoding stay. A value is what the data sheet holds,
/// or with an overlay a value with its unit or a name of its enumeration. Data types and object types may be given by
/// name. KEY= removes a key. In XML, parameter and object both say it, if both did. A change that brings up new warnings or errors of `lexican eds lint` is refused (exit code 1).
#[derive(clap::Args, Debug)]
#[command(after_help = SET_EXAMPLES)]
pub(crate) struct SetArgs {
    #[command(flatten)]
    edit: EditArgs,

    /// What to change: 6064, 2410:05, "Position actual value", FileInfo, DeviceInfo, DeviceComissioning
    #[arg(value_name = "OBJECT|SECTION")]
    place: String,

    /// The keys of CiA 306 with their values
    #[arg(required = true, value_name = "KEY=VALUE", value_parser = key_and_value)]
    keys: Vec<(String, String)>,
}

const SET_EXAMPLES: &str = "\
Examples:
    lexican eds set drive.eds 2410:05 DefaultValue=20 LowLimit=1 HighLimit=0x64
    lexican eds set drive.eds DeviceInfo VendorNumber=0x195 BaudRate_800=
    lexican eds set drive.dcf \"Producer heartbeat time\" ParameterValue=500
    lexican eds set drive.xdd 2005 AccessType=ro --dry-run";

/// Add an object, or a sub-index of an array or record, to a data sheet
///
/// It comes behind the object with the next smaller index, and to the end of the list that its index belongs to; counts
/// follow. What CiA 301 or the device profile says of it need not be given. An array or record begins with sub-index 0.
#[derive(clap::Args, Debug)]
#[command(after_help = ADD_EXAMPLES)]
pub(crate) struct AddArgs {
    #[command(flatten)]
    edit: EditArgs,

    /// Its address: 2005, 2005:03
    #[arg(value_name = "ADDRESS")]
    address: String,

    /// Its name
    #[arg(long)]
    name: String,

    /// Its data type: UNSIGNED16, VISIBLE_STRING
    #[arg(long = "type", value_name = "TYPE", value_parser = crate::access::data_type)]
    data_type: Option<DataType>,

    /// Whether it can be read and written: ro, wo, rw, rwr, rww or const
    #[arg(long, value_name = "ACCESS", value_parser = access_type, default_value = "rw")]
    access: AccessType,

    /// Whether it is a single value or has sub-indices; a single value unless the standard says otherwise
    #[arg(long, value_enum)]
    kind: Option<Kind>,

    /// How many elements of the data type an array begins with
    #[arg(long, value_name = "NUMBER", default_value_t = 0)]
    elements: u8,

    /// Its default
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true)]
    default: Option<String>,

    /// Its smallest value
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true)]
    low: Option<String>,

    /// Its largest value
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true)]
    high: Option<String>,

    /// PDOs may map it
    #[arg(long)]
    pdo: bool,
}

const ADD_EXAMPLES: &str = "\
Examples:
    lexican eds add valve.eds 2005 --name \"Set point\" --type UNSIGNED16 --default 100 --high 1000 --access rww --pdo
    lexican eds add valve.eds 2010 --name \"Temperatures\" --kind array --type INTEGER16 --elements 4 --access ro
    lexican eds add valve.eds 2010:05 --name \"Temperature of the coil\" --type INTEGER16 --access ro
    lexican eds add servo.eds 6065 --name \"Following error window\"";

/// Remove objects or sub-indices from a data sheet
///
/// Their sections go, and their lines in the lists, which are numbered anew; counts follow. What PDOs still map is not
/// removed without --force.
#[derive(clap::Args, Debug)]
#[command(after_help = REMOVE_EXAMPLES)]
pub(crate) struct RemoveArgs {
    #[command(flatten)]
    edit: EditArgs,

    /// What to remove: 2005, 2410:05, "Set point"
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
}

const REMOVE_EXAMPLES: &str = "\
Examples:
    lexican eds remove valve.eds 2005 2010:05
    lexican eds remove valve.eds 1403 1603";

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Kind {
    /// A single value
    Var,
    /// Values of one data type
    Array,
    /// Values of several data types
    Record,
}

pub(crate) fn set(args: &SetArgs) -> Result<Outcome, Failure> {
    let mut edited = Edited::open(&args.edit)?;
    let place = edited.place(&args.place)?;
    for (key, value) in &args.keys {
        edited.set(place, key, value)?;
    }
    edited.finish()
}

pub(crate) fn add(args: &AddArgs) -> Result<Outcome, Failure> {
    let mut edited = Edited::open(&args.edit)?;
    file::must_be_ini(&edited.sheet.input.eds)?;
    let address = resolve(None, &args.address).map_err(|error| {
        Failure::new(&error).help("an address has four hexadecimal digits, from 1000 on, and two after the colon")
    })?;
    let (index, sub) = (address.index(), address.sub());
    let standard = standard::object(index, edited.sheet.device.profile);
    let of_sub = args.address.contains(':');
    let kind = match args.kind {
        Some(Kind::Var) => ObjectKind::Variable,
        Some(Kind::Array) => ObjectKind::Array,
        Some(Kind::Record) => ObjectKind::Record,
        None => standard.map_or(ObjectKind::Variable, |standard| standard.kind),
    };
    let data_type = |sub: u8| {
        let found = args.data_type.or_else(|| standard?.data_type(sub));
        found.ok_or_else(|| {
            Failure::new(format_args!("what is the data type of {address}?")).help("name it with --type UNSIGNED16")
        })
    };
    let entry = |sub: u8, name: String| -> Result<Entry, Failure> {
        let mut entry = Entry::new(index, sub, Span::default());
        (entry.name, entry.access, entry.pdo_mapping) = (name, args.access, args.pdo);
        entry.data_type = data_type(sub)?;
        Ok(entry)
    };
    let place = if of_sub {
        edited.apply(|sheet| Ok(edit::add_entry(sheet, &entry(sub, args.name.clone())?)?))?;
        vec![Place::Sub(index, sub)]
    } else if kind.has_subs() {
        let mut count = Entry::new(index, 0, Span::default());
        (count.name, count.data_type) = ("Highest sub-index supported".to_owned(), DataType::Unsigned8);
        (count.access, count.default) = (AccessType::Const, Some(Value::Integer(args.elements.into())));
        let elements = (1..=args.elements).map(|sub| entry(sub, format!("{} {sub}", args.name)));
        let entries = [Ok(count)].into_iter().chain(elements).collect::<Result<_, _>>()?;
        edited.add_object(index, kind, &args.name, entries)?;
        (1..=args.elements).map(|sub| Place::Sub(index, sub)).collect()
    } else {
        edited.add_object(index, kind, &args.name, vec![entry(0, args.name.clone())?])?;
        vec![Place::Object(index)]
    };
    let keys = [("DefaultValue", &args.default), ("LowLimit", &args.low), ("HighLimit", &args.high)];
    for (key, value) in keys.into_iter().filter_map(|(key, value)| Some((key, value.as_ref()?))) {
        if place.is_empty() {
            return Err(Failure::new("an array without --elements has no value yet"));
        }
        place.iter().try_for_each(|&place| edited.set(place, key, value))?;
    }
    edited.finish()
}

pub(crate) fn remove(args: &RemoveArgs) -> Result<Outcome, Failure> {
    let mut edited = Edited::open(&args.edit)?;
    file::must_be_ini(&edited.sheet.input.eds)?;
    for object in &args.objects {
        let place = edited.place(object)?;
        edited.apply(|sheet| match place {
            Place::Object(index) => Ok(edit::remove_object(sheet, index)?),
            Place::Sub(index, sub) => Ok(edit::remove_entry(sheet, index, sub)?),
            _ => Err(Failure::new(format_args!("{object} is no object"))),
        })?;
    }
    edited.finish()
}

/// A data sheet with edits applied, not yet written.
struct Edited<'a> {
    args: &'a EditArgs,
    before: DataSheet,
    sheet: DataSheet,
}

impl<'a> Edited<'a> {
    fn open(args: &'a EditArgs) -> Result<Self, Failure> {
        let load = |input| Ok::<_, Failure>(DataSheet::new(with_overlays(input, &args.overlay)?)?);
        let input = file::open(&args.file)?;
        Ok(Self { args, before: load(input.clone())?, sheet: load(input)? })
    }

    /// The place in the data sheet that a text names.
    fn place(&self, text: &str) -> Result<Place, Failure> {
        let sections = [
            ("FileInfo", Place::FileInfo),
            ("DeviceInfo", Place::DeviceInfo),
            ("DeviceComissioning", Place::Commissioning),
            ("DeviceCommissioning", Place::Commissioning),
        ];
        if let Some((_, place)) = sections.iter().find(|(name, _)| same_name(name, text)) {
            return Ok(*place);
        }
        let device = &self.sheet.device;
        let mut named = device.objects.iter().filter(|object| object.kind.has_subs() && same_name(&object.name, text));
        if let (Some(object), None) = (named.next(), named.next()) {
            return Ok(Place::Object(object.index));
        }
        let address = resolve(Some(device), text)?;
        let Some(object) = device.object(address.index()) else {
            return Err(Failure::new(format_args!("the data sheet has no object {:04X}", address.index()))
                .help("`lexican eds dump` lists its objects, `lexican eds add` adds one"));
        };
        let whole = !text.contains(':') && resolve(None, text).is_ok();
        Ok(match object.kind.has_subs() && !whole {
            true => Place::Sub(address.index(), address.sub()),
            false if address.sub() == 0 => Place::Object(address.index()),
            false => return Err(Failure::new(format_args!("{:04X} has no sub-indices", address.index()))),
        })
    }

    fn set(&mut self, place: Place, key: &str, value: &str) -> Result<(), Failure> {
        let value = self.written(place, key, value)?;
        self.apply(|sheet| Ok(edit::set(sheet, place, key, Some(&*value).filter(|value| !value.is_empty()))?))
    }

    fn add_object(&mut self, index: u16, kind: ObjectKind, name: &str, entries: Vec<Entry>) -> Result<(), Failure> {
        let mut object = Object::new(index, kind, Span::default());
        (object.name, object.list, object.entries) = (name.to_owned(), ObjectList::of_index(index), entries);
        self.apply(|sheet| Ok(edit::add_object(sheet, &object)?))
    }

    /// A value in the notation of data sheets.
    fn written(&self, place: Place, key: &str, value: &str) -> Result<String, Failure> {
        let is = |name: &str| same_name(name, key);
        if is("DataType")
            && let Some(data_type) = DataType::from_name(value)
        {
            return Ok(format!("0x{:04X}", data_type.code()));
        }
        let kinds = [ObjectKind::Domain, ObjectKind::Variable, ObjectKind::Array, ObjectKind::Record];
        if is("ObjectType")
            && let Some(kind) = kinds.into_iter().find(|kind| same_name(kind.name(), value))
        {
            return Ok(format!("0x{:X}", kind.code()));
        }
        let address = match place {
            Place::Object(index) => Address::new(index, 0),
            Place::Sub(index, sub) => Address::new(index, sub),
            _ => return Ok(value.to_owned()),
        };
        let is_value = ["DefaultValue", "LowLimit", "HighLimit", "ParameterValue"].into_iter().any(is);
        let Some(entry) = self.sheet.device.entry(address.index(), address.sub()).filter(|_| is_value) else {
            return Ok(value.to_owned());
        };
        // Values in the notation of data sheets are kept; units and names are converted.
        let is_number = entry.data_type.range().is_some();
        let is_plain =
            value.is_empty() || value.starts_with('$') || !value.contains(|c: char| c.is_alphabetic() && c != 'x');
        if !is_number || is_plain || value.starts_with("0x") || value.starts_with("0X") {
            return Ok(value.to_owned());
        }
        let values = DeviceValues::new(&self.sheet.device);
        match values.parse(entry, value) {
            Ok(Value::Integer(number)) => Ok(number.to_string()),
            Ok(_) => Ok(value.to_owned()),
            Err(error) => Err(Failure::new(format_args!("{address}: {error}"))),
        }
    }

    fn apply(&mut self, change: impl FnOnce(&Source) -> Result<Patch, Failure>) -> Result<(), Failure> {
        let sheet = &self.sheet.input.eds;
        let eds = sheet.with_text(change(sheet)?.apply(sheet));
        let input = Input { eds, overlays: self.sheet.input.overlays.clone() };
        self.sheet = DataSheet::parse(input);
        Ok(())
    }

    /// Findings that are new.
    fn worse(&self) -> Vec<&Diagnostic> {
        let mut before: Vec<_> =
            self.before.diagnostics.iter().map(|finding| (finding.code, &finding.message)).collect();
        let after = self.sheet.diagnostics.iter().filter(|finding| finding.severity >= Severity::Warning);
        let is_new = |finding: &&Diagnostic| match before.iter().position(|it| *it == (finding.code, &finding.message))
        {
            Some(at) => {
                before.swap_remove(at);
                false
            }
            None => true,
        };
        after.filter(is_new).collect()
    }

    /// Writes the data sheet, unless it has new findings.
    fn finish(self) -> Result<Outcome, Failure> {
        let (before, after) = (&self.before.input.eds, &self.sheet.input.eds);
        let worse = self.worse();
        let refused = !worse.is_empty() && !self.args.force;
        let written = !refused && !self.args.dry_run && after != before;
        if written {
            file::write(after)?;
        }
        let diff = file::difference(before, after);
        if self.args.json {
            let findings: Vec<_> = worse.iter().map(|finding| finding.to_json(&self.sheet.input)).collect();
            let result = json!({
                "file": before.name(),
                "written": written,
                "diff": anstream::adapter::strip_str(&diff).to_string(),
                "changes": diff::json(&diff::diff(&self.before.device, &self.sheet.device)),
                "findings": findings,
            });
            print_result(true, result, "")?;
        } else {
            let mut stdout = output::stdout();
            stdout.write_all(diff.as_bytes())?;
            stdout.flush()?;
            for finding in &worse {
                anstream::eprintln!("{}\n", finding.render(&self.sheet.input));
            }
        }
        if refused {
            let findings = plural(worse.len(), "finding");
            warn(format_args!("nothing is written, for it would bring up {findings}; --force writes it all the same"));
        }
        Ok(if refused { Outcome::Found } else { Outcome::Clean })
    }
}

impl From<EditError> for Failure {
    fn from(error: EditError) -> Self {
        let failure = Failure::new(&error);
        match error {
            EditError::UnknownKey { known, .. } => failure.help(format_args!("its keys are {}", known.join(", "))),
            EditError::Compact(_) => failure.help("write its sub-indices out first: `lexican eds dump` shows them"),
            EditError::NotInXml { .. } => failure.help(
                "`lexican eds convert` makes an EDS, which can say it, and an XDD of that again; or another object shares the parameter",
            ),
            EditError::AmbiguousList(_) => failure.help("see `lexican eds lint`"),
            EditError::NoSubs(_) => failure.help("set its ObjectType first, or remove it and add an array or record"),
            _ => failure,
        }
    }
}

fn key_and_value(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or_else(|| format!("{text:?} is not KEY=VALUE"))?;
    Ok((key.trim().to_owned(), value.trim().to_owned()))
}

fn access_type(text: &str) -> Result<AccessType, String> {
    AccessType::from_name(text).ok_or_else(|| "there is ro, wo, rw, rwr, rww and const".to_owned())
}
