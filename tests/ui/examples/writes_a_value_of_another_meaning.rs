// error: mismatched types
// error: expected `OperatingMode`, found `ControlWord`

fn main() {
    ui::write(ui::drive::OPERATING_MODE, ui::drive::ControlWord(1));
}
