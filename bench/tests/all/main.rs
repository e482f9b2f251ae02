//! The model by frames, the engine and its faces over simulated devices.

mod live;
mod model;
mod recording;
mod stop;
mod tui;
mod web;
