//! `lexican-eds` and `lexican-runtime` do not know each other, and each has tables of CiA 301: of data types, and of
//! where objects and identifiers are. The tables are the same.

use lexican_eds::types::{Class, DataType as Described};
use lexican_runtime::object::DataType as Served;

#[test]
fn both_tables_have_the_same_types_for_all_codes() {
    for code in 0..=0xFF {
        let (described, served) = (Described::from_code(code), Served::from_code(code));
        let described = (!matches!(described, Described::Other(_))).then_some(described);
        assert_eq!(described.map(Described::code), served.map(|served| served as u16), "{code:04X}");
        let Some((described, served)) = described.zip(served) else { continue };
        assert_eq!(described.code(), code);
        assert_eq!(described.name(), served.name(), "{code:04X}");
        assert_eq!(described.to_string(), served.to_string(), "{code:04X}");
        assert_eq!(described.bits(), served.bits(), "{code:04X}");
        assert_eq!(described.class() == Class::Signed, served.is_signed(), "{code:04X}");
        // Generated code names the variant of one after that of the other.
        assert_eq!(format!("{described:?}"), format!("{served:?}"), "{code:04X}");
    }
}

#[test]
fn both_tables_are_ascending_and_as_long() {
    let codes: Vec<u16> = Described::ALL.iter().map(|data_type| data_type.code()).collect();
    let served: Vec<u16> = Served::ALL.iter().map(|&data_type| data_type as u16).collect();
    assert_eq!(codes, served);
    assert!(codes.is_sorted() && codes.len() == 25, "{codes:X?}");
}

#[test]
fn an_integer_of_either_table_has_the_range_of_its_bits() {
    for data_type in Described::ALL {
        let (Some((low, high)), Some(bits)) = (data_type.range(), data_type.bits()) else { continue };
        let served = Served::from_code(data_type.code()).expect("the tables are the same");
        assert_eq!(served.size(), Some(usize::from(bits).div_ceil(8)));
        assert_eq!(high - low, (1_i128 << bits) - 1, "{data_type}");
        assert_eq!(low < 0, served.is_signed(), "{data_type}");
    }
}

/// Compares constants of the same name.
macro_rules! are_same {
    ($($name:ident),*) => {
        $(assert_eq!(lexican_eds::cia301::$name, lexican_runtime::cia301::$name, stringify!($name));)*
    };
    ($module:ident: $($name:ident),*) => {
        $(assert_eq!(lexican_eds::cia301::$module::$name, lexican_runtime::cia301::$module::$name, stringify!($name));)*
    };
}

#[test]
fn both_have_objects_and_identifiers_in_the_same_places() {
    are_same! {
        DEVICE_TYPE, ERROR_REGISTER, PREDEFINED_ERROR_FIELD, COB_ID_SYNC, COMMUNICATION_CYCLE_PERIOD,
        SYNCHRONOUS_WINDOW_LENGTH, GUARD_TIME, LIFE_TIME_FACTOR, STORE_PARAMETERS, RESTORE_DEFAULT_PARAMETERS,
        COB_ID_TIME, COB_ID_EMCY, INHIBIT_TIME_EMCY, CONSUMER_HEARTBEAT_TIME, PRODUCER_HEARTBEAT_TIME,
        IDENTITY, SYNCHRONOUS_COUNTER_OVERFLOW, VERIFY_CONFIGURATION, EMERGENCY_CONSUMER, ERROR_BEHAVIOUR,
        SDO_SERVER_1, SDO_CLIENT_1, SDO_CLIENT_128, RPDO_1, RPDO_512, RPDO_MAPPING_1, RPDO_MAPPING_512,
        TPDO_1, TPDO_512, TPDO_MAPPING_1, TPDO_MAPPING_512, TO_MAPPING
    }
    are_same!(connection: EMCY, TPDO_1, RPDO_1, SDO_RESPONSE, SDO_REQUEST);
    for id in 0..=0x7FF {
        let of_runtime = lexican_runtime::CobId::standard(id).unwrap().is_restricted();
        assert_eq!(lexican_eds::cia301::is_restricted(id.into()), of_runtime, "{id:03X}");
    }
}
