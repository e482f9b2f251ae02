//! What the control and status words of a drive say together (CiA 402-2): commands and states.

/// The bits of the status word that make the state.
pub(crate) const STATE_BITS: u16 = 0b0110_1111;
/// The bits of the control word that make the command.
pub(crate) const COMMAND_BITS: u16 = 0b1000_1111;

/// The state that a status word tells; `None` for bits that mean no state.
pub(crate) fn state(status: u16) -> Option<&'static str> {
    Some(match (status & 0b0100_1111, status & 0b0010_0000 != 0) {
        (0b0000_0000, _) => "NOT READY TO SWITCH ON",
        (0b0100_0000, _) => "SWITCH ON DISABLED",
        (0b0000_0001, true) => "READY TO SWITCH ON",
        (0b0000_0011, true) => "SWITCHED ON",
        (0b0000_0111, true) => "OPERATION ENABLED",
        (0b0000_0111, false) => "QUICK STOP ACTIVE",
        (0b0000_1111, _) => "FAULT REACTION ACTIVE",
        (0b0000_1000, _) => "FAULT",
        _ => return None,
    })
}

/// Whether a status word tells OPERATION ENABLED.
pub(crate) fn is_enabled(status: u16) -> bool {
    state(status) == Some("OPERATION ENABLED")
}

/// The command that a control word gives. "Switch on" and "disable operation" are the same bits; which
/// is meant depends on the state.
pub(crate) fn command(control: u16, enabled: bool) -> &'static str {
    match control & COMMAND_BITS {
        bits if bits & 0x80 != 0 => "fault reset",
        bits if bits & 0b0010 == 0 => "disable voltage",
        bits if bits & 0b0100 == 0 => "quick stop",
        bits if bits & 0b0001 == 0 => "shutdown",
        bits if bits & 0b1000 != 0 => "enable operation",
        _ if enabled => "disable operation",
        _ => "switch on",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_are_those_of_the_table() {
        for (status, name) in [
            (0x0250, "SWITCH ON DISABLED"),
            (0x0231, "READY TO SWITCH ON"),
            (0x0233, "SWITCHED ON"),
            (0x0337, "OPERATION ENABLED"),
            (0x0217, "QUICK STOP ACTIVE"),
            (0x0218, "FAULT"),
            (0x0238, "FAULT"),
        ] {
            assert_eq!(state(status), Some(name), "{status:04X}");
        }
        assert_eq!(state(0x0002), None);
    }

    #[test]
    fn commands_are_those_of_the_table() {
        for (control, enabled, name) in [
            (0x0106, false, "shutdown"),
            (0x0107, false, "switch on"),
            (0x0107, true, "disable operation"),
            (0x010F, false, "enable operation"),
            (0x001F, true, "enable operation"),
            (0x0100, true, "disable voltage"),
            (0x0002, true, "quick stop"),
            (0x0080, false, "fault reset"),
        ] {
            assert_eq!(command(control, enabled), name, "{control:04X}");
        }
    }
}
