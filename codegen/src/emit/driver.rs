//! The driver's side: the data sheet of a CiA 402 drive as a description for `lexican-driver`.

use lexican_eds::cia402::Modes;
use lexican_eds::drive::{Code, Drive, Homing, Number, Pdo};

use super::context::Context;
use super::docs;
use super::layout::line;
use crate::plan::Shape;

/// The option codes, and the reaction that each configures.
const REACTIONS: &[(u16, &str)] =
    &[(0x605A, "QuickStop"), (0x605B, "Shutdown"), (0x605C, "DisableOperation"), (0x605D, "Halt"), (0x605E, "Fault")];

/// 60BAh, the first of the positions that touch probes latch.
const LATCHED: u16 = 0x60BA;

/// The longest line.
const WIDTH: usize = 120;

/// Writes a separate module, so that its names and imports do not collide with those of the data sheet.
pub(super) fn driver(context: &Context<'_>, drive: &Drive, code: &mut String) {
    let name = docs::escape(&drive.name);
    *code += &format!(
        "
/// The driver: what the data sheet says of the drive, for `lexican_driver`.
pub mod driver {{
    use ::lexican_driver::description::*;
    use {}::profile::cia402::{{Mode, Modes}};

    /// {name}, as its data sheet describes it. What the data sheet does not say is as CiA 402 has it.
    ///
    /// What the drive does otherwise is written by hand, in a description that begins with this one:
    /// `Description {{ release: Release::WhenOver, ..DESCRIPTION }}`, and a `Kind` that has it.
    pub const DESCRIPTION: Description = Description {{
",
        line(&context.runtime),
    );
    fields(context, drive).iter().for_each(|field| *code += &format!("        {field},\n"));
    *code += "        ..Description::CIA_402
    };

    /// The kind of this drive. On tokio, its driver is `lexican_driver::tokio::Drive<Kind>`.
    #[derive(Clone, Copy, Debug)]
    pub enum Kind {}

    impl ::lexican_driver::Kind for Kind {
        const DESCRIPTION: &'static Description = &DESCRIPTION;
    }

    /// The drive at the other end of a link. Every method blocks until its operation is over.
    pub type Drive<L> = ::lexican_driver::Drive<L, Kind>;
}
";
}

/// The fields that differ from plain CiA 402, in the order of the description.
fn fields(context: &Context<'_>, drive: &Drive) -> Vec<String> {
    let number = |number: &Number| self::number(context, number);
    let optional = |field: &Option<Number>| option(field.as_ref().map(number));
    let identity = &drive.identity;
    let names = option(identity.name.as_ref().map(|name| format!("&[{name:?}]")));
    let mut fields = vec![format!("name: {:?}", docs::one_line(&drive.name))];
    let vendor_ids: Vec<String> = identity.vendor_ids.iter().map(|id| format!("0x{id:X}")).collect();
    let identity = vec![
        format!("vendor_ids: &[{}]", vendor_ids.join(", ")),
        format!("profile: {}", identity.profile),
        format!("names: {names}"),
    ];
    fields.push(record("identity: Identity", identity, Some("Description::CIA_402.identity")));
    let mut objects = vec![
        format!("control_word: {}", number(&drive.control_word)),
        format!("status_word: {}", number(&drive.status_word)),
        format!("actual_velocity: {}", optional(&drive.actual_velocity)),
        format!("position_window: {}", optional(&drive.position_window)),
    ];
    let whole = [
        ("actual_position", drive.actual_position),
        ("target_position", drive.target_position),
        ("latest_fault", drive.latest_fault),
    ];
    objects.extend(whole.iter().filter_map(|(name, of)| Some(format!("{name}: {}", number(of.as_ref()?)))));
    objects.push(match &drive.position_limits {
        Some(limits) => list("position_limits: Some([", limits.iter().map(number).collect(), "])", "            "),
        None => "position_limits: None".to_owned(),
    });
    fields.push(record("objects: Objects", objects, Some("Objects::CIA_402")));
    let outputs = &drive.outputs;
    let outputs = [("control", &outputs.control), ("position", &outputs.position), ("velocity", &outputs.velocity)];
    fields.push(match outputs.iter().any(|(_, output)| output.is_some()) {
        true => {
            let outputs = outputs.iter().map(|(name, of)| format!("{name}: {}", option(of.as_ref().map(pdo))));
            record("outputs: Outputs", outputs.collect(), None)
        }
        false => "outputs: Outputs::BY_SDO".to_owned(),
    });
    fields.push(list("inputs: &[", drive.inputs.iter().map(pdo).collect(), "]", "        "));
    if drive.always_four_bytes {
        fields.push("always_four_bytes: true".to_owned());
    }
    if let Some(unit) = drive.velocity_unit() {
        let status = vec![format!("velocity_unit: {:?}", docs::one_line(unit))];
        fields.push(record("status: StatusBits", status, Some("Description::CIA_402.status")));
    }
    let modes = Modes::CIA_402.0.iter().filter(|(number, _)| drive.modes.contains(number));
    let modes = modes.map(|(number, mode)| format!("({number}, Mode::{mode:?})")).collect();
    let modes = vec![
        format!("chosen: {}", number(&drive.mode)),
        format!("shown: {}", optional(&drive.mode_display)),
        list("codes: Modes(&[", modes, "])", "            "),
    ];
    fields.push(record("modes: ModeObjects", modes, None));
    if !drive.codes.is_empty() {
        let faults = list("faults: &[", drive.codes.iter().map(self::code).collect(), "]", "            ");
        fields.push(record("codes: ::lexican_driver::Codes", vec![faults], Some("Description::CIA_402.codes")));
    }
    let profile = drive.profile.map(|profile| {
        let fields = vec![
            format!("velocity: {}", number(&profile.velocity)),
            format!("acceleration: {}", optional(&profile.acceleration)),
            format!("deceleration: {}", optional(&profile.deceleration)),
        ];
        record("Profile", fields, None)
    });
    fields.push(format!("profile: {}", option(profile)));
    let velocity = drive
        .target_velocity
        .as_ref()
        .map(|target| format!("Velocities {{ target: {}, ..Velocities::CIA_402 }}", number(target)));
    fields.push(format!("velocity: {}", option(velocity)));
    let torques = drive
        .torque
        .as_ref()
        .map(|torque| format!("Torques {{ target: {}, actual: {} }}", number(&torque.target), number(&torque.actual)));
    fields.push(format!("torque: {}", option(torques)));
    fields.push(format!("interpolated_position: {}", optional(&drive.interpolated_position)));
    let latched = drive.latched.iter().map(|position| format!("Latches::CIA_402.rows[{}]", position.index - LATCHED));
    let rows = list("rows: &[", latched.collect(), "]", "            ");
    fields.push(match drive.latched.as_slice() {
        [] => "latches: None".to_owned(),
        _ => record("latches: Some(Latches", vec![rows], Some("Latches::CIA_402")) + ")",
    });
    let reactions = drive.option_codes.iter().map(|code| {
        let (_, name) = REACTIONS.iter().find(|(index, _)| *index == code.index)?;
        Some(format!("(Reaction::{name}, {})", number(code)))
    });
    fields.push(list("reactions: &[", reactions.flatten().collect(), "]", "        "));
    fields.push(match &drive.homing {
        None => "homing: None".to_owned(),
        Some(homing) => {
            let mut fields =
                vec![format!("method: {}", number(&homing.method)), format!("offset: {}", number(&homing.offset))];
            if !homing.methods.is_empty() {
                let methods: Vec<String> = homing.methods.iter().map(i8::to_string).collect();
                fields.push(list("methods: &[", methods, "]", "            "));
            }
            record("homing: Some(Homing", fields, Some("Homing::CIA_402")) + ")"
        }
    });
    let on_the_spot = drive.homing.as_ref().and_then(Homing::on_the_spot);
    fields.push(format!("calibration: {}", option(on_the_spot.map(|method| format!("Calibration::Homing({method})")))));
    let capabilities = [
        ("store", drive.store, "Store { all: ", ", ..Store::CIA_301 }"),
        ("restore", drive.restore, "Restore { all: ", ", ..Restore::CIA_301 }"),
        ("emergencies", drive.emergencies, "EmergencySwitch { object: ", ", ..EmergencySwitch::CIA_301 }"),
    ];
    let capabilities = capabilities.iter().filter_map(|(field, object, before, after)| {
        Some(format!("{field}: Some({before}{}{after})", number(object.as_ref()?)))
    });
    fields.extend(capabilities);
    fields
}

/// The handle of an object, with its limits if they are narrower than the data type.
fn number(context: &Context<'_>, number: &Number) -> String {
    let item = context.plan.items.iter().find(|item| item.object.index == number.index);
    let member = item.map_or_else(String::new, |item| match &item.shape {
        Shape::Variable(_) => item.ident.clone(),
        Shape::Array { .. } => format!("{}.at({}).unwrap()", item.ident, number.sub),
        Shape::Record { members, .. } => {
            let member = members.iter().find(|member| member.entry.sub == number.sub);
            format!("{}.{}()", item.ident, member.map_or("", |member| &member.ident))
        }
    });
    let within = number.limits.map(|(low, high)| format!(".within({low}, {high})"));
    format!("Number::of(super::{member}){}", within.unwrap_or_default())
}

fn pdo(pdo: &Pdo) -> String {
    let signals: Vec<String> = pdo.signals.iter().map(|signal| format!("Signal::{signal:?}")).collect();
    format!("Pdo {{ base: 0x{:X}, signals: &[{}] }}", pdo.base, signals.join(", "))
}

fn code(code: &Code) -> String {
    let text = docs::one_line(&code.text);
    format!("::lexican_driver::Code {{ number: 0x{:04X}, label: \"\", text: {text:?} }}", code.number)
}

fn option(value: Option<String>) -> String {
    value.map_or_else(|| "None".to_owned(), |value| format!("Some({value})"))
}

/// A struct literal with these fields, and `..others` if not all are given; on one line if there are few.
fn record(head: &str, fields: Vec<String>, others: Option<&str>) -> String {
    let others = others.map(|others| format!("..{others}"));
    if let ([only], Some(others)) = (fields.as_slice(), &others)
        && !only.contains('\n')
    {
        let flat = format!("{head} {{ {only}, {others} }}");
        if flat.len() + 9 <= WIDTH {
            return flat;
        }
    }
    let fields: String = fields.iter().map(|field| format!("            {field},\n")).collect();
    let others = others.map(|others| format!("            {others}\n"));
    format!("{head} {{\n{fields}{}        }}", others.unwrap_or_default())
}

/// Rows between `before` and `after`, on one line if they fit.
fn list(before: &str, rows: Vec<String>, after: &str, indent: &str) -> String {
    let flat = format!("{before}{}{after}", rows.join(", "));
    if indent.len() + flat.len() < WIDTH {
        return flat;
    }
    let rows: String = rows.iter().map(|row| format!("{indent}    {row},\n")).collect();
    format!("{before}\n{rows}{indent}{after}")
}
