//! What is allowed: the control for all the others.

fn main() {
    let sum = ui::read(ui::od::RO_UNMAPPED) + ui::read(ui::od::RW_UNMAPPED) + ui::read(ui::od::CONST_UNMAPPED);
    ui::write(ui::od::RW_UNMAPPED, sum);
    ui::write(ui::od::WO_UNMAPPED, sum);
    ui::map_tpdo(ui::od::RO_MAPPABLE);
    ui::map_rpdo(ui::od::WO_MAPPABLE);
    ui::map_tpdo(ui::od::RW_MAPPABLE);
    ui::map_rpdo(ui::od::RW_MAPPABLE);
    ui::map_tpdo(ui::od::RWR_MAPPABLE);
    ui::map_rpdo(ui::od::RWW_MAPPABLE);
    // A position is the same type through every door.
    let position: Option<ui::doors::Position> = ui::read_serial(ui::doors::serial::UPPER_LIMIT);
    ui::write(ui::doors::LIMITS.upper(), position.unwrap_or_default());
    ui::write_serial(ui::doors::serial::UPPER_LIMIT, ui::read(ui::doors::TARGET_POSITION));
    ui::write(ui::drive::OPERATING_MODE, ui::drive::OperatingMode::POSITION);
}
