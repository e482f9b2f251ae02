//! The generated code, compiled in: every handle with what its type says, and every newtype with its tables.
//!
//! The lists are written out, so that a handle which the generator loses or renames does not compile here.

use std::any::type_name;
use std::collections::BTreeMap;

use lexican_runtime::object::{
    Address, BitField, BitName, Const, Enumeration, Mappable, Object, Quantity, Ro, Rpdo, Rw, Tpdo, Unit, Unmapped,
    Value, ValueName, Wo,
};
use siko_ag03_1::od;

use crate::bench::NODE;

/// What a typed handle says.
pub(crate) struct Handle {
    /// As a program writes it: `MOTOR_PARAMETER_SET.v_pos()`.
    pub(crate) path: String,
    pub(crate) data_type: String,
    /// The newtype, or the plain type.
    pub(crate) value_type: &'static str,
    pub(crate) access: &'static str,
    pub(crate) mapping: &'static str,
    /// For [`NODE`].
    pub(crate) default: Option<i128>,
    pub(crate) limits: Option<(i128, i128)>,
}

/// All handles, by address.
pub(crate) fn handles() -> BTreeMap<Address, Handle> {
    let mut all = BTreeMap::new();
    macro_rules! handles {
        ($($object:ident $(: $($member:ident)*)?;)*) => {
            $(handles!(@ $object $(: $($member)*)?);)*
        };
        (@ $object:ident) => { add(&mut all, stringify!($object).into(), od::$object) };
        (@ $object:ident: $($member:ident)*) => {
            $(add(&mut all, concat!(stringify!($object), ".", stringify!($member)).into(), od::$object.$member());)*
        };
    }
    handles! {
        DEVICE_TYPE;
        ERROR_REGISTER;
        MANUFACTURER_STATUS_REGISTER;
        COB_ID_SYNC_MESSAGE;
        MANUFACTURER_DEVICE_NAME;
        MANUFACTURER_SOFTWARE_VERSION;
        GUARD_TIME;
        LIFE_TIME_FACTOR;
        RESTORE_DEFAULT_PARAMETERS: number_of_sub_indexes all_parameters standard_parameters
            controller_parameters calibrate;
        COB_ID_EMERGENCY_MESSAGE;
        PRODUCER_HEARTBEAT_TIME;
        IDENTITY_OBJECT: number_of_sub_indexes vendor_id product_code revision_number serial_number;
        SERVER_SDO_PARAMETER: number_of_sub_indexes cob_id_rx cob_id_tx;
        RPDO1_PARAMETER: largest_sub_index cob_id transmission_type inhibit_time event_timer;
        RPDO2_PARAMETER: largest_sub_index cob_id transmission_type inhibit_time event_timer;
        RPDO3_PARAMETER: largest_sub_index cob_id transmission_type inhibit_time event_timer;
        RPDO4_PARAMETER: largest_sub_index cob_id transmission_type inhibit_time event_timer;
        RPDO1_MAPPING_PARAMETER: number_of_mapped_objects mapped_object_1;
        RPDO2_MAPPING_PARAMETER: number_of_mapped_objects;
        RPDO3_MAPPING_PARAMETER: number_of_mapped_objects mapped_object_1 mapped_object_2;
        RPDO4_MAPPING_PARAMETER: number_of_mapped_objects mapped_object_1 mapped_object_2;
        TPDO1_PARAMETER: largest_sub_index cob_id transmission_type inhibit_time event_timer;
        TPDO2_PARAMETER: largest_sub_index cob_id transmission_type inhibit_time event_timer;
        TPDO3_PARAMETER: largest_sub_index cob_id transmission_type inhibit_time event_timer;
        TPDO4_PARAMETER: largest_sub_index cob_id transmission_type inhibit_time event_timer;
        TPDO1_MAPPING_PARAMETER: number_of_mapped_objects mapped_object_1;
        TPDO2_MAPPING_PARAMETER: number_of_mapped_objects;
        TPDO3_MAPPING_PARAMETER: number_of_mapped_objects mapped_object_1 mapped_object_2;
        TPDO4_MAPPING_PARAMETER: number_of_mapped_objects mapped_object_1 mapped_object_2;
        CAN_BAUD_RATE;
        NODE_ID;
        GEAR_REDUCTION;
        MOTOR_PARAMETER_SET: largest_sub_index controller_parameter_p controller_parameter_i
            controller_parameter_d a_pos v_pos a_rot a_inch v_inch d_pos;
        SPINDLE_PITCH;
        POS_TYPE;
        DELTA_JOG;
        STOP_MODE_INCHING_MODE_2;
        INPOS_MODE;
        LOOP_LENGTH;
        POWER_SUPPLY_VOLTAGE: largest_sub_index output_stage control;
        OUTPUT_STAGE_TEMPERATURE;
        MOTOR_CURRENT;
        GENERIC_STATUS_REGISTER;
        TORQUE_DEACTIVATION;
        TORQUE_DEACTIVATION_STATE;
        BATTERY_VOLTAGE;
        INCHING_2_OFFSET;
        PRODUCTION_DATE;
        CONTROLWORD;
        STATUSWORD;
        MODES_OF_OPERATION;
        POSITION_ACTUAL_VALUE;
        POSITION_WINDOW;
        VELOCITY_ACTUAL_VALUE;
        TARGET_POSITION;
        CALIBRATION_VALUE;
        SOFTWARE_POSITION_LIMIT: number_of_sub_indexes limit_2 limit_1;
        POLARITY;
        GEAR_RATIO: number_of_sub_indexes numerator denominator;
        TARGET_VELOCITY;
    }
    let faults = od::PRE_DEFINED_ERROR_FIELD;
    add(&mut all, "PRE_DEFINED_ERROR_FIELD.len_object".into(), faults.len_object());
    faults.iter().for_each(|fault| add(&mut all, "PRE_DEFINED_ERROR_FIELD.at".into(), fault));
    all
}

/// The enumerations, by name.
pub(crate) fn enumerations() -> BTreeMap<&'static str, &'static [ValueName]> {
    fn row<T: Enumeration>() -> (&'static str, &'static [ValueName]) {
        (short_name::<T>(), T::NAMES)
    }
    BTreeMap::from([
        row::<od::CanBitRate>(),
        row::<od::EmergencyCode>(),
        row::<od::GearReduction>(),
        row::<od::InPositionMode>(),
        row::<od::InchingStop>(),
        row::<od::OperatingMode>(),
        row::<od::PositioningType>(),
        row::<od::RestoreSignature>(),
        row::<od::SenseOfRotation>(),
    ])
}

/// The bit fields, by name.
pub(crate) fn bit_fields() -> BTreeMap<&'static str, &'static [BitName]> {
    fn row<T: BitField>() -> (&'static str, &'static [BitName]) {
        (short_name::<T>(), T::BITS)
    }
    BTreeMap::from([
        row::<od::Controlword>(),
        row::<od::ErrorRegister>(),
        row::<od::GenericStatus>(),
        row::<od::Statusword>(),
        row::<od::SystemStatus>(),
        row::<od::TorqueDeactivationFlags>(),
    ])
}

/// The quantities, by name.
pub(crate) fn quantities() -> BTreeMap<&'static str, &'static [Unit]> {
    fn row<T: Quantity>() -> (&'static str, &'static [Unit]) {
        (short_name::<T>(), T::UNITS)
    }
    BTreeMap::from([
        row::<od::Acceleration>(),
        row::<od::BatteryVoltage>(),
        row::<od::Deceleration>(),
        row::<od::InhibitTime>(),
        row::<od::Interval>(),
        row::<od::LoopLength>(),
        row::<od::MotorCurrent>(),
        row::<od::Position>(),
        row::<od::PositionWindow>(),
        row::<od::Speed>(),
        row::<od::SpeedShare>(),
        row::<od::SpindlePitch>(),
        row::<od::SupplyVoltage>(),
        row::<od::Temperature>(),
        row::<od::TorqueThreshold>(),
        row::<od::Velocity>(),
    ])
}

trait Right {
    const NAME: &'static str;
}

macro_rules! rights {
    ($($right:ident $name:literal)*) => {
        $(impl Right for $right {
            const NAME: &'static str = $name;
        })*
    };
}

rights! { Ro "ro" Wo "wo" Rw "rw" Const "const" Unmapped "no" Tpdo "tpdo" Rpdo "rpdo" Mappable "both" }

fn add<T: Value, A: Right, M: Right>(all: &mut BTreeMap<Address, Handle>, path: String, object: Object<T, A, M>) {
    let handle = Handle {
        path,
        data_type: T::DATA_TYPE.to_string(),
        value_type: short_name::<T>(),
        access: A::NAME,
        mapping: M::NAME,
        default: object.default(NODE).map(number),
        limits: object.limits().map(|limits| (number(limits.low), number(limits.high))),
    };
    let address = object.address();
    assert!(all.insert(address, handle).is_none(), "{address} has one handle");
}

/// The number of a value, with its sign.
fn number<T: Value>(value: T) -> i128 {
    signed(value.to_raw(), T::DATA_TYPE)
}

/// The number in wire form, with its sign.
pub(crate) fn signed(raw: u64, data_type: lexican_runtime::object::DataType) -> i128 {
    let unused = 64 - u32::from(data_type.bits().unwrap_or(64));
    if data_type.is_signed() { i128::from((raw << unused) as i64 >> unused) } else { i128::from(raw) }
}

fn short_name<T>() -> &'static str {
    let name = type_name::<T>();
    name.rsplit("::").next().unwrap_or(name)
}
