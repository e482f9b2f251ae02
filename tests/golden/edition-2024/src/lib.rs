//! All golden cases, in edition 2024.
#![no_std]

/// `golden/access_and_mapping`.
#[path = "../../access_and_mapping/expected.rs"]
pub mod access_and_mapping;

/// `golden/arrays`.
#[path = "../../arrays/expected.rs"]
pub mod arrays;

/// `golden/compact_pdo`.
#[path = "../../compact_pdo/expected.rs"]
pub mod compact_pdo;

/// `golden/configured`.
#[path = "../../configured/expected.rs"]
pub mod configured;

/// `golden/data_types`.
#[path = "../../data_types/expected.rs"]
pub mod data_types;

/// `golden/defined_types`.
#[path = "../../defined_types/expected.rs"]
pub mod defined_types;

/// `golden/documentation`.
#[path = "../../documentation/expected.rs"]
pub mod documentation;

/// `golden/limits`.
#[path = "../../limits/expected.rs"]
pub mod limits;

/// `golden/names`.
#[path = "../../names/expected.rs"]
pub mod names;

/// `golden/node_id`.
#[path = "../../node_id/expected.rs"]
pub mod node_id;

/// `golden/overlay`.
#[path = "../../overlay/expected.rs"]
pub mod overlay;

/// `golden/pdos`.
#[path = "../../pdos/expected.rs"]
pub mod pdos;

/// `golden/records`.
#[path = "../../records/expected.rs"]
pub mod records;

/// `golden/standards`.
#[path = "../../standards/expected.rs"]
pub mod standards;
