// error: mismatched types
// error: expected `u16`, found `bool`

fn main() {
    ui::write(ui::od::RW_UNMAPPED, true);
}
