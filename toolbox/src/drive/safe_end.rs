//! The safe end of an order: the drive stands still, or the user is told that it may not.

use lexican_driver::sequence::Recovery;
use lexican_driver::{Any, Capability, Drive, Error, Protection, Step};
use lexican_runtime::Duration;
use lexican_runtime::host::Link;

use super::ending::Ending;
use super::order::has_ended;
use super::verb::Order;

/// How long to try to stop a drive after the bus is lost.
pub const RESCUE: Duration = Duration::from_secs(5);

/// How an order has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SafeEnd {
    /// One word, for programs.
    pub word: &'static str,
    /// Whether the order has been carried out.
    pub is_success: bool,
    /// Whether the drive answers, so that this describes its present state.
    pub is_known: bool,
    /// Whether it may be moving and could not be stopped.
    pub may_be_moving: bool,
    /// A sentence.
    pub text: String,
    /// What to do about it.
    pub remedy: Option<String>,
    /// Orders that may be given next, each by itself.
    pub steps: &'static [Step],
}

impl SafeEnd {
    fn new(word: &'static str, text: String, remedy: Option<&str>) -> Self {
        let remedy = remedy.map(str::to_owned);
        SafeEnd { word, is_success: false, is_known: true, may_be_moving: false, text, remedy, steps: &[] }
    }

    fn of_error(word: &'static str, error: &Error) -> Self {
        let remedy = error.remedy();
        SafeEnd { steps: remedy.steps, ..SafeEnd::new(word, error.to_string(), Some(remedy.text)) }
    }
}

/// Ends an order: stops the drive once more if the order moves or stops it, even if the drive was silent for a while. A
/// drive that was not to move or stop is left alone.
pub fn end_safely<L: Link>(drive: &mut Drive<L, Any>, order: Order, result: Result<Ending, Error>) -> SafeEnd {
    let error = match result {
        Ok(ending) => {
            let end = SafeEnd::new(ending.word(), order.sentence(ending), ending.remedy());
            return SafeEnd { is_success: ending.is_success(), ..end };
        }
        Err(Error::Cancelled { stopped, .. }) => {
            let text = if stopped { "interrupted: it has been stopped" } else { "interrupted" };
            return SafeEnd::new("cancelled", text.to_owned(), None);
        }
        Err(error) => error,
    };
    if let Error::Restarted = error {
        return SafeEnd { text: "it has restarted".to_owned(), ..SafeEnd::of_error("restarted", &error) };
    }
    if has_ended(&error) {
        let end = SafeEnd::of_error("refused", &error);
        let is_method = matches!(error, Error::Unsupported { what: Capability::HomingMethod(_), .. });
        return match drive.run(async |drive| Ok(drive.description().homing)) {
            Ok(Some(homing)) if is_method => {
                let methods = homing.methods.iter().map(i8::to_string).collect::<Vec<_>>().join(", ");
                SafeEnd { remedy: Some(format!("its methods are {methods} (6098h)")), ..end }
            }
            _ => end,
        };
    }
    if !order.verb().is_stop() && !matches!(error, Error::MayBeMoving { .. }) {
        return SafeEnd { is_known: false, ..SafeEnd::of_error("failed", &error) };
    }
    let why = error.into_cause();
    // Read this before recovering the drive, which arms the protection again.
    let protection = drive.protection();
    match drive.recover(&Recovery::within(RESCUE)) {
        Ok(_) | Err(Error::Cancelled { stopped: true, .. }) => {
            let text = format!("{why}; it has been stopped since");
            SafeEnd { is_known: false, ..SafeEnd::new("stopped", text, None) }
        }
        Err(last) => {
            let (why, last) = (why.to_string(), last.into_cause().to_string());
            let before = if why == last { String::new() } else { format!(", after this: {why}") };
            SafeEnd { is_known: false, ..unstoppable(&format_args!("{last}{before}"), protection) }
        }
    }
}

/// The end of an order to a drive that could not be stopped.
#[must_use]
pub fn unstoppable(why: &dyn std::fmt::Display, protection: Protection) -> SafeEnd {
    let notices = match protection {
        Protection::None => "it does not notice that by itself".to_owned(),
        protection => format!("it notices that by itself: {protection}"),
    };
    let remedy = format!("stop it by its emergency stop or its supply; {notices}");
    let text = format!("MAY STILL BE MOVING: it could not be told to stop: {why}");
    SafeEnd { may_be_moving: true, is_known: false, ..SafeEnd::new("may-be-moving", text, Some(&remedy)) }
}
