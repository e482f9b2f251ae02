//! All comparisons of a drive of SIKO's with its manual.

use std::marker::PhantomData;

use super::rig::Siko;
use crate::drive::Check;
use crate::kinds::{cia402, network, objects, pdo, prose, sheet, transmission};

/// Objects of four, two and one byte that can be written and read.
const WRITABLE: [(u8, u16); 3] = [(4, 0x607C), (2, 0x1017), (1, 0x100D)];
const READABLE: [(u8, u16); 3] = [(4, 0x1000), (2, 0x6041), (1, 0x1001)];

/// Parameters of the PDOs that map something.
const PDOS: &[u16] = &[0x1400, 0x1402, 0x1403, 0x1800, 0x1802, 0x1803];

/// The comparisons of a drive.
pub(crate) struct Checks<D>(PhantomData<D>);

impl<D: Siko> Checks<D> {
    /// All comparisons, the quick ones first, so that a mutant is found sooner.
    pub(crate) const ALL: &'static [Check] = &[
        sheet::check::<D>,
        |checker, case| super::values::file::<D>(checker, case),
        super::values::check::<D>,
        super::formats::check::<D>,
        objects::check::<D>,
        super::objects::check::<D>,
        super::parameters::check::<D>,
        |checker, _| network::commands::<D>(checker, super::network::starts_cold::<D>),
        |checker, _| network::states::<D>(checker, super::network::in_nmt_state::<D>),
        |checker, case| network::sdo_commands::<D>(checker, case, WRITABLE, READABLE),
        |checker, case| network::sdo_aborts::<D>(checker, case, super::network::refused::<D>, &[]),
        super::network::sdo_examples::<D>,
        super::network::node_address::<D>,
        super::network::bus_termination,
        super::leds::check::<D>,
        super::examples::check::<D>,
        |checker, _| cia402::states::<D>(checker, super::states::beyond::<D>),
        |checker, _| cia402::commands::<D>(checker),
        cia402::transitions::<D>,
        super::faults::check::<D>,
        super::facts::check::<D>,
        super::statements::check::<D>,
        pdo::mappings::<D>,
        |checker, case| {
            pdo::layouts::<D>(checker, case, super::network::prepare_layouts, super::network::sample);
        },
        network::identifiers::<D>,
        |checker, case| transmission::check::<D>(checker, case, PDOS),
        super::bits::check::<D>,
        |checker, _| prose::left_open::<D>(checker, &super::statements::LEFT_OPEN),
    ];
}
