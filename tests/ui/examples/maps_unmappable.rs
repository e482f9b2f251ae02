// error: the EDS does not allow mapping this object into a transmit PDO
// error: `PDOMapping=0`
// error: pdo_mapping = true

fn main() {
    ui::map_tpdo(ui::od::RW_UNMAPPED);
}
