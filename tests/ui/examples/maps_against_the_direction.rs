// error: the EDS does not allow mapping this object into a receive PDO
// error: or an access right of the other direction

fn main() {
    ui::map_rpdo(ui::od::RWR_MAPPABLE);
}
