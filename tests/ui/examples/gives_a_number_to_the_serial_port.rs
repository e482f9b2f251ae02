// error: mismatched types
// error: expected `Parameter<_, _, &str>`, found `Parameter<OperatingMode, Ro, u16>`
fn main() {
    let _ = ui::read_serial(ui::doors::profibus::OPERATING_MODE);
}
