//! Comparisons of tables that any manual has. A drive uses those for the tables of its manual, with these columns; it
//! compares tables of its own itself.
//!
//! | module | table | columns |
//! | --- | --- | --- |
//! | `sheet` | none: the data sheet and the code generated from it | |
//! | `objects` | `objects.csv` | `index`, `subindex`, `access`, `pdo_mapping`, `data_type`, `default`, `range`; if there: `eeprom`, `restriction`, `notice` |
//! | `descriptions` | several tables about objects, `sections.csv`, `names.csv` | as `objects`; `object_code`, `float_scaling`, `unit`, `ascii` |
//! | `formats` | `formats.csv` | `address`, `bits`, `value`, `meaning` |
//! | `values` | `values.csv` | `address`, `value`, `meaning` |
//! | `homing` | `homing_methods.csv` | `method`, `switch`, `zeroing`, `count_direction`, `home_mode`, `home_dir`, `supported` |
//! | `terms` | `terms.csv`: values and bits that the overlay names | `type`, `value`, `kind`, `printed`, `overlay` |
//! | `pdo` | `pdo_mappings.csv`, `pdo_layouts.csv` | mapped objects; bytes and their significance |
//! | `transmission` | `transmission_types.csv` | `index`, `from`, `to`, `kind`, `meaning` |
//! | `network` | `nmt.csv`, `nmt_states.csv`, `sdo_commands.csv`, `sdo_aborts.csv`, `identifiers.csv`, `encodings.csv` | what the bus shows |
//! | `frames` | printed frames; `frames.csv` | `direction`, `cob_id`, `data`; `chapter`, `frame`, `cob_id`, `data`, `kind` |
//! | `cia402` | `states.csv`, `commands.csv`, `transitions.csv`, `mode_bits.csv` | patterns of bits; numbered state changes |
//! | `emcy` | `emergency.csv` | `code`, and `meaning` (if there: `byte_0`, `byte_1`) or `number`, `description` |
//! | `prose` | `statements.csv` | `statement`: clauses, each checked by behaviour |

pub(crate) mod cia402;
pub(crate) mod descriptions;
pub(crate) mod emcy;
pub(crate) mod formats;
pub(crate) mod frames;
pub(crate) mod homing;
pub(crate) mod network;
pub(crate) mod objects;
pub(crate) mod pdo;
pub(crate) mod prose;
pub(crate) mod sheet;
pub(crate) mod simulation;
pub(crate) mod terms;
pub(crate) mod transmission;
pub(crate) mod values;
