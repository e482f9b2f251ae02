//! Mutants of the drives' other interfaces that are not found, because they do the same: what they are called, and why.

pub(crate) const OF_SERIAL: &[(&str, &str)] = &[
    ("answer fits: false => true", "an answer without content has no other bytes than those at its end"),
    ("client new: false => true #2", "each command sets it before it is read"),
    (
        "connection await_status: self.line.now () >= until => self.line.now () > until",
        "to ask for the status takes time",
    ),
];

pub(crate) const OF_PROFIBUS: &[(&str, &str)] = &[("slave new: false => true #3", "Set_Prm clears it")];

pub(crate) const OF_GATEWAY: &[(&str, &str)] = &[
    (
        "gateway/face new: false => true",
        "the drive is taken for disabled when it answers for the first time, which clears it",
    ),
    ("gateway/face new: false => true #2", "the order that enables the drive clears it"),
];
