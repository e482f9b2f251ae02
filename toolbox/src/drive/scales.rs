//! Positions and velocities of a drive in the units of its data sheet.

use lexican_driver::Description;
use lexican_eds::model::{Device, Value};
use lexican_runtime::object::Address;

use crate::values::DeviceValues;

/// Turns positions and velocities into text and back, by the units of a data sheet and its overlays. Without a unit they are
/// plain numbers.
pub struct Scales<'a> {
    values: DeviceValues<'a>,
    position: Address,
    target: Address,
    /// `None` if the drive has none, and the driver measures it.
    velocity: Option<Address>,
    target_velocity: Option<Address>,
}

impl<'a> Scales<'a> {
    /// The scales of a drive that is described so.
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

    /// The values of the data sheet. Those on which a unit depends are to be set in it
    /// ([`DeviceValues::conditions`]), as far as they are read from the drive.
    pub fn values(&mut self) -> &mut DeviceValues<'a> {
        &mut self.values
    }

    /// The objects that have the units.
    pub fn objects(&self) -> impl Iterator<Item = Address> + use<> {
        [Some(self.position), Some(self.target), self.velocity, self.target_velocity].into_iter().flatten()
    }

    /// A target, or a distance, from `5000`, `5 mm` or `raw:5000`.
    ///
    /// # Errors
    ///
    /// Why the text is no position.
    pub fn parse_position(&self, text: &str) -> Result<i32, String> {
        self.parse(self.target, text)
    }

    /// A velocity from `60 rpm`.
    ///
    /// # Errors
    ///
    /// Why the text is no velocity, and that the drive has none.
    pub fn parse_velocity(&self, text: &str) -> Result<i32, String> {
        self.parse(self.target_velocity.ok_or("the drive has no velocity mode")?, text)
    }

    fn parse(&self, address: Address, text: &str) -> Result<i32, String> {
        i32::try_from(self.parse_value(address, text)?).map_err(|_| format!("{text:?} is no number of 32 bits"))
    }

    /// The value of any entry, from a text with or without its unit.
    ///
    /// # Errors
    ///
    /// Why the text is no value of it.
    pub fn parse_value(&self, address: Address, text: &str) -> Result<i64, String> {
        let number = match self.values.entry(address) {
            Some(entry) => self.values.parse(entry, text)?.as_integer(),
            // It is described by hand.
            None => text.trim().strip_prefix("raw:").unwrap_or(text).trim().parse().ok(),
        };
        number.and_then(|number| i64::try_from(number).ok()).ok_or_else(|| format!("{text:?} is no number"))
    }

    /// `+5.00 mm`.
    #[must_use]
    pub fn position(&self, position: i32) -> String {
        self.describe(self.position, position)
    }

    /// A target, or a distance.
    #[must_use]
    pub fn target(&self, target: i32) -> String {
        self.describe(self.target, target)
    }

    /// A velocity that is ordered.
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
