// error: a PDO maps at most 64 bits

use lexican_runtime::object::{Mapping, Tpdo};
use ui::od::{Device, RO_MAPPABLE};

type Five = (u16, u16, u16, u16, u16);

const EIGHTY_BITS: Mapping<Tpdo, Five, Device> =
    Mapping::transmit().with(RO_MAPPABLE).with(RO_MAPPABLE).with(RO_MAPPABLE).with(RO_MAPPABLE).with(RO_MAPPABLE);

fn main() {
    println!("{EIGHTY_BITS:?}");
}
