//! A machine with a drive and a valve. It only prints addresses.

mod drive {
    lexican_runtime::include_od!("siko_ag03_1");
}
mod valve {
    lexican_runtime::include_od!("valve");
}

fn main() {
    println!(
        "drive: {} by {}, target position at {}",
        drive::PRODUCT_NAME,
        drive::VENDOR_NAME,
        drive::TARGET_POSITION.address()
    );
    println!(
        "valve: {} by {}, set point at {}",
        valve::PRODUCT_NAME,
        valve::VENDOR_NAME,
        valve::VALVE_SET_POINT.address()
    );
}
