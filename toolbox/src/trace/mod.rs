//! Values of a node over time: a [`sampler`] collects them, `series` keeps them; with the feature `pictures` it draws
//! them.

pub mod sampler;
#[cfg(feature = "pictures")]
pub mod series;
