//! Uses the runtime through `bus` alone.

/// The valve.
pub mod valve {
    bus::canopen::include_od!("valve");
}

#[cfg(test)]
mod tests {
    use super::*;
    use bus::canopen::NodeId;
    use bus::canopen::object::Name;

    #[test]
    fn the_dictionary_works_through_the_other_path() {
        let od = valve::storage(NodeId::literal(3));
        assert_eq!(od.get(valve::VALVE_SET_POINT), 500);
        let name = Name::find(valve::NAMES, valve::VALVE_SET_POINT.address());
        assert_eq!(name.map(|name| name.name), Some("Valve set point"));
    }
}
