//! NrOfRXPDO and NrOfTXPDO are the numbers of PDOs.

use super::{Context, Rule};
use crate::diagnostics::{Diagnostics, Severity};
use crate::model::Direction;

pub(crate) const RULE: Rule = Rule {
    code: "pdo::count",
    severity: Severity::Warning,
    holds: "NrOfRXPDO and NrOfTXPDO are the numbers of PDOs.",
    explain: "Tools that trust the numbers in `[DeviceInfo]` offer fewer or more PDOs than there are parameters for.",
    help: "",
    check: Some(check),
};

fn check(context: &Context<'_>, out: &mut Diagnostics) {
    let info = &context.device.info;
    let counts =
        [(Direction::Receive, "NrOfRXPDO", info.receive_pdos), (Direction::Transmit, "NrOfTXPDO", info.transmit_pdos)];
    for (direction, key, said) in counts {
        let first = crate::pdo::communication_parameter(direction, 1);
        let parameters = context.device.objects.iter().filter(|object| (first..first + 0x200).contains(&object.index));
        let found = parameters.count();
        let Some((said, span)) = said.zip(context.device_info(key)) else { continue };
        if usize::from(said) != found {
            let finding = RULE.finding(format!("there {}, not {said}", super::are(found, "PDO")));
            out.push(finding.at(span, "says otherwise"));
        }
    }
}
