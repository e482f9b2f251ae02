//! Generated code, and the options of a build script.

mod config;
mod output;
