//! Documents devices: a data sheet as one HTML or Markdown page.

mod page;
mod sheet;

pub use page::{Format, Markup, Page};
pub use sheet::{Chapters, page};
