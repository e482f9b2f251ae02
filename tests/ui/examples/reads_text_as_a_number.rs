// error: VisibleString` is not a value of a fixed size
// error: read or write its bytes

fn main() {
    let _ = ui::read(ui::types::VISIBLE_STRING_VALUE);
}
