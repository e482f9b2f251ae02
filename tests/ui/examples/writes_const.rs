// error: the EDS does not allow writing this object
// error: this object is read-only (`ro` or `const`)

fn main() {
    ui::write(ui::od::CONST_UNMAPPED, 1);
}
