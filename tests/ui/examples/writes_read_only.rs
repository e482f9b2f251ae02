// error: the EDS does not allow writing this object
// error: this object is read-only (`ro` or `const`)
// error: access = "rw"

fn main() {
    ui::write(ui::od::RO_UNMAPPED, 1);
}
