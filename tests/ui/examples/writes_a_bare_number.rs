// error: mismatched types
// error: expected `OperatingMode`, found integer

fn main() {
    ui::write(ui::drive::OPERATING_MODE, 1);
}
