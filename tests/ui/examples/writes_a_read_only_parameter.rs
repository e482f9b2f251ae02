// error: the EDS does not allow writing this object
// error: this object is read-only (`ro` or `const`)
fn main() {
    ui::write_profibus(ui::doors::profibus::NUMBER_OF_FAULTS, 0);
}
