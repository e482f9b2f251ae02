//! Values of a node over time: followed by a [`sampler`], kept as `series`, which draw with the feature `pictures`.

pub mod sampler;
#[cfg(feature = "pictures")]
pub mod series;
