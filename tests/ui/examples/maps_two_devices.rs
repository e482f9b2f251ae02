// error: a PDO maps objects of one device
// error: the handles come from the dictionaries of two devices

use lexican_runtime::object::Mapping;

fn main() {
    let _ = Mapping::transmit().with(ui::od::RO_MAPPABLE).with(ui::doors::TARGET_POSITION);
}
