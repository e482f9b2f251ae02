// error: the EDS does not allow mapping this object into a receive PDO

fn main() {
    ui::map_rpdo(ui::od::RW_UNMAPPED);
}
