// error: the EDS does not allow reading this object
// error: this object is write-only (`wo`)

fn main() {
    let _: u16 = ui::read(ui::od::WO_UNMAPPED);
}
