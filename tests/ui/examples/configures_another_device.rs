// error: this object is not one of the node's device
// error: an object of `ui::od::Device`, and the node is a `ui::drive::Device`

use lexican_runtime::host::Settings;

fn main() {
    let _ = Settings::of(ui::drive::DEVICE).set(ui::od::RW_UNMAPPED, 1);
}
