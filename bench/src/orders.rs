//! The orders to a drive, as clients offer them: one row each.

use lexican_driver::{Description, Mode};
use lexican_toolbox::drive::Verb;
use serde::Serialize;

/// Where an order is on the page, and what value it takes.
#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
enum Group {
    Power,
    /// Takes a position, a distance or a velocity.
    Move,
    /// Takes a homing method.
    Home,
    /// Needs no control.
    Stop,
    /// What to do with a motion that a stop has interrupted.
    After,
}

/// What an order requires of a drive.
enum Needs {
    Nothing,
    Mode(Mode),
    Homing,
}

/// An order with its texts in English and German.
#[derive(Serialize)]
pub(crate) struct Row {
    pub(crate) verb: Verb,
    group: Group,
    /// The texts of its button.
    pub(crate) titles: [&'static str; 2],
    help: [&'static str; 2],
    /// Its key in the terminal, and the question for its value.
    #[serde(skip)]
    pub(crate) key: char,
    #[serde(skip)]
    pub(crate) prompt: Option<[&'static str; 2]>,
    #[serde(skip)]
    needs: Needs,
}

impl Row {
    /// Whether a drive supports it.
    pub(crate) fn is_for(&self, description: &Description) -> bool {
        match self.needs {
            Needs::Nothing => true,
            Needs::Mode(mode) => description.code_of(mode).is_some(),
            Needs::Homing => description.homing.is_some(),
        }
    }
}

macro_rules! orders {
    ($($verb:ident, $key:literal, $group:ident, $needs:expr, $title:literal, $title_de:literal, $help:literal, $help_de:literal
       $(, $prompt:literal, $prompt_de:literal)?;)*) => {
        /// All orders, in the order of the page's buttons.
        pub(crate) const ORDERS: &[Row] = &[$(Row {
            verb: Verb::$verb,
            group: Group::$group,
            titles: [$title, $title_de],
            help: [$help, $help_de],
            key: $key,
            prompt: orders!(@$($prompt, $prompt_de)?),
            needs: $needs,
        }),*];
    };
    (@) => { None };
    (@$prompt:literal, $prompt_de:literal) => { Some([$prompt, $prompt_de]) };
}

orders! {
    Enable, 'e', Power, Needs::Nothing, "Enable", "Freigeben", "To OPERATION ENABLED", "Nach OPERATION ENABLED";
    Disable, 'd', Power, Needs::Nothing, "Disable", "Sperren", "To SWITCH ON DISABLED", "Nach SWITCH ON DISABLED";
    ResetFault, 'f', Power, Needs::Nothing, "Reset fault", "Störung quittieren", "Leave FAULT", "FAULT verlassen";
    MoveTo, 'm', Move, Needs::Mode(Mode::Positioning), "Move to", "Fahren nach", "Travel to the position", "Zur Position fahren", "to which position", "auf welche Position";
    Step, 's', Move, Needs::Mode(Mode::Positioning), "Step", "Fahren um", "Travel by the distance", "Um den Weg fahren", "how far", "wie weit";
    Run, 'v', Move, Needs::Mode(Mode::Velocity), "Run", "Drehen", "Run at the velocity until it is stopped", "Mit der Geschwindigkeit, bis zum Anhalten", "how fast", "wie schnell";
    Home, 'o', Home, Needs::Homing, "Home", "Referenzfahrt", "Look for the reference", "Sucht die Referenz", "homing method (empty: as it is set)", "Referenzmethode (leer: wie eingestellt)";
    Stop, 'k', Stop, Needs::Nothing, "Stop", "Anhalten", "With the programmed deceleration", "Mit der eingestellten Verzögerung";
    QuickStop, 'K', Stop, Needs::Nothing, "Quick stop", "Schnellhalt", "With full deceleration", "Mit voller Verzögerung";
    Resume, 'r', After, Needs::Mode(Mode::Positioning), "Resume", "Fortsetzen", "Go on with a travel that was interrupted", "Setzt eine unterbrochene Fahrt fort";
    Drop, 'x', After, Needs::Mode(Mode::Positioning), "Drop travel", "Fahrt verwerfen", "Drop the rest of a travel that was interrupted, and disable the drive", "Verwirft den Rest einer unterbrochenen Fahrt und sperrt den Antrieb";
}
