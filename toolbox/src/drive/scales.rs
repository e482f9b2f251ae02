//! Positions and velocities of a drive in units of the data sheet.

use lexican_driver::Description;
use lexican_eds::model::{Device, Entry, Meaning, Value};
use lexican_runtime::object::Address;

use crate::values::DeviceValues;

/// Converts positions and velocities to text and back, in the units of data sheet and overlays; plain numbers without a
/// unit.
pub struct Scales<'a> {
    values: DeviceValues<'a>,
    position: Address,
    target: Address,
    /// 606Ch; `None` if the drive lacks it and the driver measures the velocity.
    velocity: Option<Address>,
    target_velocity: Option<Address>,
}

impl<'a> Scales<'a> {
    /// The scales for a data sheet and a description.
    #[must_use]
    pub fn new(device: &'a Device, description: &Description) -> Self {
        let objects = &description.objects;
        Scales {
            values: DeviceValues::new(device),
            position: objects.actual_position.address(),
            target: objects.target_position.address(),
            velocity: objects.actual_velocity.map(|velocity| velocity.address()),
            target_velocity: description.velocity.map(|velocity| velocity.target.address()),
        }
    }

    /// The values seen. Values on which a unit depends ([`DeviceValues::conditions`]) have to be set here after reading
    /// them from the drive.
    pub fn values(&mut self) -> &mut DeviceValues<'a> {
        &mut self.values
    }

    /// The objects whose units are used.
    pub fn objects(&self) -> impl Iterator<Item = Address> + use<> {
        [Some(self.position), Some(self.target), self.velocity, self.target_velocity].into_iter().flatten()
    }

    /// Parses a target or a distance: `5000`, `5 mm` or `raw:5000`.
    pub fn parse_position(&self, text: &str) -> Result<i32, String> {
        self.parse(self.target, text)
    }

    /// Parses a velocity: `60 rpm`. Also an error if the drive has no velocity mode.
    pub fn parse_velocity(&self, text: &str) -> Result<i32, String> {
        self.parse(self.target_velocity.ok_or("the drive has no velocity mode")?, text)
    }

    fn parse(&self, address: Address, text: &str) -> Result<i32, String> {
        i32::try_from(self.parse_value(address, text)?).map_err(|_| format!("{text:?} is no number of 32 bits"))
    }

    /// Parses the value of any entry, with or without its unit.
    pub fn parse_value(&self, address: Address, text: &str) -> Result<i64, String> {
        let number = match self.values.entry(address) {
            Some(entry) => self
                .values
                .parse(entry, text)
                .map_err(|error| without_scale(entry, text).unwrap_or(error))?
                .as_integer(),
            // The description has it, but the data sheet does not.
            None => text.trim().strip_prefix("raw:").unwrap_or(text).trim().parse().ok(),
        };
        number.and_then(|number| i64::try_from(number).ok()).ok_or_else(|| format!("{text:?} is no number"))
    }

    /// `+5.00 mm`.
    #[must_use]
    pub fn position(&self, position: i32) -> String {
        self.describe(self.position, position)
    }

    /// A target or a distance as text.
    #[must_use]
    pub fn target(&self, target: i32) -> String {
        self.describe(self.target, target)
    }

    /// A target velocity as text.
    #[must_use]
    pub fn target_velocity(&self, velocity: i32) -> String {
        self.target_velocity.map_or_else(|| self.velocity(velocity), |target| self.describe(target, velocity))
    }

    /// `+60 rpm`.
    #[must_use]
    pub fn velocity(&self, velocity: i32) -> String {
        match self.velocity {
            Some(address) => self.describe(address, velocity),
            None => format!("{}/s", self.describe(self.position, velocity)),
        }
    }

    fn describe(&self, address: Address, number: i32) -> String {
        match self.values.entry(address) {
            Some(entry) => self.values.describe(entry, &Value::Integer(number.into())),
            None => number.to_string(),
        }
    }
}

/// What to do about a number with a unit if the data sheet has none: an overlay to copy.
fn without_scale(entry: &Entry, text: &str) -> Option<String> {
    let at = text.find(|letter: char| !matches!(letter, '0'..='9' | '.' | '-' | '+'))?;
    let (number, unit) = text.split_at_checked(at)?;
    number.parse::<f64>().ok().filter(|_| entry.meaning == Meaning::Plain)?;
    let (name, at, unit) = (&entry.name, format!("{:04X}:{:02X}", entry.index, entry.sub), unit.trim());
    Some(format!(
        "{text:?} has a unit, and the data sheet has none for {name} ({at}): write increments without a unit, or say in an overlay \
         (--overlay units.toml) what an increment is, by the drive's manual, 608Fh or 6091h; 1/100 {unit} would be\n\
         object.\"{at}\".quantity = \"Distance\"\n\
         quantity.Distance.units = [{{ symbol = \"{unit}\", method = \"of_unit\", scale = \"1/100\" }}]"
    ))
}

#[cfg(test)]
mod tests {
    use lexican_eds::{Input, Source, library};
    use lexican_runtime::object::Address;

    use super::*;

    #[test]
    fn a_unit_that_the_data_sheet_does_not_have_leads_to_an_overlay_that_works() {
        let sheet = library::find("siko/ag03-1").unwrap().input();
        let bare = Input::new(sheet.eds.clone());
        let with = |input: &Input| lexican_eds::load(input).0;
        let parse = |device: &Device, text: &str| {
            Scales::new(device, &lexican_driver::Description::CIA_402).parse_value(Address::new(0x607A, 0), text)
        };
        let error = parse(&with(&bare), "5 mm").unwrap_err();
        assert!(error.contains("--overlay") && error.contains("608Fh") && error.contains("607A:00"), "{error}");
        let overlay = error.split_once('\n').unwrap().1;
        let scaled = with(&bare.clone().overlay(Source::new("units.toml", overlay)));
        assert_eq!(parse(&scaled, "5 mm"), Ok(500));
        assert_eq!(parse(&with(&bare), "5000"), Ok(5000));
        assert!(!parse(&with(&bare), "five").unwrap_err().contains("overlay"));
    }
}
