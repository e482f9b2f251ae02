//! Devices on paper: what a data sheet says as one page for people, in HTML or Markdown.

mod page;
mod sheet;

pub use page::{Format, Markup, Page};
pub use sheet::{Chapters, page};
