//! The texts of the terminal in English and German.

/// The language of the terminal; messages about the bus are in English.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Language {
    /// English.
    #[default]
    English,
    /// German.
    German,
}

impl Language {
    /// The language for a value of `LANG`: `de_DE.UTF-8`.
    #[must_use]
    pub fn of_locale(locale: &str) -> Self {
        if locale.to_ascii_lowercase().starts_with("de") { Language::German } else { Language::English }
    }
}

macro_rules! texts {
    ($($name:ident, $english:literal, $german:literal;)*) => {
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(super) enum Text {
            $($name,)*
        }

        impl Text {
            pub(super) const fn of(self, language: Language) -> &'static str {
                match (self, language) {
                    $((Text::$name, Language::English) => $english,
                    (Text::$name, Language::German) => $german,)*
                }
            }
        }
    };
}

texts! {
    Nodes, "Nodes", "Knoten";
    Objects, "Objects", "Objekte";
    Pdos, "PDOs", "PDOs";
    Trace, "Trace", "Trace";
    Plots, "Plots", "Kurven";
    Drives, "Drives", "Antriebe";
    Bus, "Bus", "Bus";
    Devices, "Devices", "Geräte";
    Id, "ID", "ID";
    Name, "name", "Name";
    State, "state", "Zustand";
    Heartbeat, "heartbeat", "Heartbeat";
    Sheet, "data sheet", "Datenblatt";
    Faults, "faults", "Störungen";
    NoFaults, "no fault", "keine Störung";
    History, "history", "Verlauf";
    Identity, "identity", "Identität";
    Lacks, "what its data sheet lacks for moving it", "was seinem Datenblatt zum Fahren fehlt";
    Changes, "changed since the bench was opened", "seit dem Öffnen geändert";
    Address, "entry", "Eintrag";
    Value, "value", "Wert";
    Default, "default", "Vorgabe";
    Limits, "limits", "Grenzen";
    Access, "access", "Zugriff";
    Choices, "takes", "erlaubt";
    Watched, "watched", "beobachtet";
    Lowest, "lowest", "kleinster";
    Highest, "highest", "größter";
    Carries, "maps", "Abbildung";
    Follows, "follows", "läuft mit";
    Stands, "stands", "steht";
    Filter, "filter", "Filter";
    Rows, "rows", "Zeilen";
    Position, "position", "Position";
    Velocity, "velocity", "Geschwindigkeit";
    Target, "target", "Ziel";
    Mode, "mode", "Betriebsart";
    Obstacles, "it would not move:", "er würde nicht fahren:";
    Ready, "it would move", "er würde fahren";
    Ended, "last order:", "letzter Auftrag:";
    Load, "load", "Buslast";
    Peak, "peak", "Spitze";
    Troubles, "troubles", "Auffälligkeiten";
    NoTroubles, "nothing is wrong", "nichts auffällig";
    Frame, "frame", "Rahmen";
    PerSecond, "per s", "pro s";
    Jitter, "jitter [ms]", "Jitter [ms]";
    Share, "share", "Anteil";
    Inputs, "inputs", "Eingänge";
    Power, "power", "Versorgung";
    On, "on", "ein";
    Off, "off", "aus";
    NoSheet, "no data sheet: d gives one", "kein Datenblatt: d gibt eines";
    StoresSheet, "its data sheet is in it: e fetches it", "sein Datenblatt ist in ihm: e holt es";
    NoNode, "no node was heard: f looks for nodes", "kein Knoten gehört: f sucht Knoten";
    NoDrive, "no node is a drive", "kein Knoten ist ein Antrieb";
    NoDevice, "the devices of this bus are real", "die Geräte an diesem Bus sind echt";
    NoCurve, "no curve: a adds one", "keine Kurve: a fügt eine hinzu";
    ControlFree, "nobody has control: h takes it", "niemand bedient: h übernimmt";
    ControlHere, "YOU HAVE CONTROL", "BEDIENUNG HIER";
    ControlThere, "another client has control", "eine andere Ansicht bedient";
    Stop, "SPACE = STOP ALL", "LEERTASTE = ALLES HALT";
    StopTyping, "F12 = STOP ALL", "F12 = ALLES HALT";
    Help, "? help  q leave", "? Hilfe  q Ende";
    Stopping, "stopping all drives...", "alle Antriebe halten...";
    Stopped, "every drive has stopped", "alle Antriebe stehen";
    LastSeen, "last seen before", "zuletzt gesehen vor";
    Unconfirmed, "STOP NOT CONFIRMED for", "HALT NICHT BESTÄTIGT seit";
    StopFailed, "NOT STOPPED", "NICHT ANGEHALTEN";
    Done, "done", "erledigt";
    JobDone, "has ended", "ist beendet";
    JobFailed, "HAS FAILED", "IST GESCHEITERT";
    Dismiss, "(Esc: seen)", "(Esc: gesehen)";
    Forgotten, "is no longer kept", "ist nicht mehr da";
    Waits, "waits for", "wartet auf";
    AskTrigger, "trigger: > 100 rising, < 100 falling (empty: none)", "Trigger: > 100 steigend, < 100 fallend (leer: keiner)";
    Written, "written", "geschrieben";
    Fits, "it can be written: Enter writes it", "schreibbar: Eingabe schreibt";
    AskValue, "new value", "neuer Wert";
    AskSearch, "search", "Suche";
    AskFilter, "text", "Text";
    AskServices, "services (nmt, sync, emcy, pdo, sdo, heartbeat, lss)", "Dienste (nmt, sync, emcy, pdo, sdo, heartbeat, lss)";
    AskNodes, "nodes (3,5-9)", "Knoten (3,5-9)";
    AskFile, "file", "Datei";
    AskSequence, "sequence to play", "Ablauf, der abgespielt wird";
    AskFormat, "format", "Format";
    AskObject, "object to map", "Objekt, das abgebildet wird";
    AskTiming, "when (event, sync, sync:4, every:10ms)", "wann (event, sync, sync:4, every:10ms)";
    AskSignal, "object or PDO (6064, tpdo1)", "Objekt oder PDO (6064, tpdo1)";
    AskSheet, "data sheet (siko/ag03-1, FILE.eds)", "Datenblatt (siko/ag03-1, DATEI.eds)";
    AskId, "node-ID for a device without one", "Knotennummer für ein Gerät ohne";
    AskInput, "set to", "setzen auf";
    HelpNodes, "o operational  p pre-operational  x stopped  r reset  c reset communication  f find nodes  a LSS  d data sheet  e its own  g to the fault  Enter objects", "o operational  p pre-operational  x stopped  r Reset  c Reset der Kommunikation  f Knoten suchen  a LSS  d Datenblatt  e sein eigenes  g zur Störung  Eingabe Objekte";
    HelpObjects, "[ ] node  / search  Enter write  r read  R read the object  w watch  g plot  d differences  b backup  u restore", "[ ] Knoten  / suchen  Eingabe schreiben  r lesen  R Objekt lesen  w beobachten  g Kurve  d Unterschiede  b sichern  u zurückspielen";
    HelpPdos, "[ ] node  r read the mapping  a add an object  Del remove the last  t when  c check  Enter write", "[ ] Knoten  r Abbildung lesen  a Objekt dazu  Entf letztes weg  t wann  c prüfen  Eingabe schreiben";
    HelpTrace, "f follow  t transfers as one row  ! errors only  / text  s services  n nodes  0 all  x export  click: mark a row", "f mitlaufen  t Transfers als eine Zeile  ! nur Fehler  / Text  s Dienste  n Knoten  0 alles  x speichern  Klick: Zeile markieren";
    HelpPlots, "[ ] node  a add  c clear  + - span  f follow  i j cursors  , . < > move one  0 no cursors  t trigger on the selected curve  x CSV  v SVG", "[ ] Knoten  a dazu  c leeren  + - Zeitraum  f mitlaufen  i j Cursor  , . < > verschieben  0 keine Cursor  t Trigger auf die gewählte Kurve  x CSV  v SVG";
    HelpBus, "up, down: troubles, COB-IDs  Enter to the row of a trouble  a acknowledge what is over", "auf, ab: Auffälligkeiten, COB-IDs  Eingabe zur Zeile einer Auffälligkeit  a Vergangenes quittieren";
    HelpDevices, "Enter set an input  p power", "Eingabe Eingang setzen  p Versorgung";
    HelpAll, "1 to 8 or Tab: tabs  arrows, PgUp, PgDn, Home, End  h control (H takes it from another)  l play a log, left and right in it  mouse: click selects, wheel scrolls  Esc back, and what is said was seen  F5 record a sequence, F5 save it  F6 play one  F12 stops all too, also while something is typed", "1 bis 8 oder Tab Ansichten  Pfeile, Bild auf, Bild ab, Pos1, Ende  h Bedienung (H nimmt sie einer anderen)  l Log abspielen, links und rechts darin  Maus: Klick wählt, Rad rollt  Esc zurück, und Gesagtes ist gesehen  F5 Ablauf aufzeichnen, F5 speichern  F6 abspielen  F12 hält auch alles an, auch während einer Eingabe";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_language_is_that_of_the_locale() {
        assert_eq!(Language::of_locale("de_AT.UTF-8"), Language::German);
        assert_eq!(Language::of_locale("C.UTF-8"), Language::English);
    }
}
