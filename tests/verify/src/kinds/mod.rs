//! Comparisons of tables that any manual has. A drive brings the tables that its manual has, with these columns; others
//! of its own it compares itself.
//!
//! | module | table | columns |
//! | --- | --- | --- |
//! | `sheet` | none: the data sheet and the code generated from it | |
//! | `objects` | `objects.csv` | `index`, `subindex`, `access`, `pdo_mapping`, `data_type`, `default`, `range`; if there: `eeprom`, `restriction`, `notice` |
//! | `terms` | `terms.csv`: values and bits that the overlay names | `type`, `value`, `kind`, `printed`, `overlay` |
//! | `pdo` | `pdo_mappings.csv`, `pdo_layouts.csv` | mapped objects; bytes and their significance |
//! | `transmission` | `transmission_types.csv` | `index`, `from`, `to`, `kind`, `meaning` |
//! | `network` | `nmt.csv`, `nmt_states.csv`, `sdo_commands.csv`, `sdo_aborts.csv`, `identifiers.csv` | what the bus shows |
//! | `frames` | printed frames | `direction`, `cob_id`, `data` |
//! | `cia402` | `states.csv`, `commands.csv`, `transitions.csv` | patterns of bits; numbered state changes |
//! | `emcy` | `emergency.csv` | `code`, `meaning`; if there: `byte_0`, `byte_1` |
//! | `prose` | `statements.csv` | `statement`: clauses, each checked by behaviour |

pub(crate) mod cia402;
pub(crate) mod emcy;
pub(crate) mod frames;
pub(crate) mod network;
pub(crate) mod objects;
pub(crate) mod pdo;
pub(crate) mod prose;
pub(crate) mod sheet;
pub(crate) mod terms;
pub(crate) mod transmission;
