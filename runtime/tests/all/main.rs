//! The runtime from outside: services, composites, shells.

mod blocking_shell;
mod common;
mod device_any_configuration;
mod device_any_frames;
mod device_any_identifiers;
mod device_defaults;
mod device_messages;
mod device_nmt;
mod device_pdo;
mod device_regressions;
mod device_selection;
mod device_services;
mod device_set;
mod embedded_can;
mod manager_and_devices;
mod manager_any_frames;
mod manager_network;
mod participant_shell;
#[cfg(feature = "std")]
mod rig;
mod sdo_any_frames;
mod sdo_client;
mod sdo_faults;
mod sdo_server;
mod sdo_support;
mod sdo_transfer;
mod sdo_wire;
mod shell_blocks;
mod shell_boot;
mod shell_bursts;
mod shell_calls;
mod shell_floods;
mod shell_load;
mod shell_nodes;
#[cfg(feature = "std")]
mod shell_support;
mod snapshot;
mod station;
mod tokio_drive;
mod tokio_shell;
mod tokio_trouble;
mod tpdo_types;
mod tracing;
mod virtual_bus;
mod virtual_bus_arbitration;
