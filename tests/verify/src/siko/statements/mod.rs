//! What chapters 2 to 7 say in running text, clause by clause.

mod network;
mod travelling;
mod trouble;

use crate::kinds::prose::Statement;

/// All statements.
pub(crate) const STATEMENTS: [&[Statement]; 3] = [travelling::STATEMENTS, trouble::STATEMENTS, network::STATEMENTS];
