//! `lexican lsp`: the language server.

use lexican_lsp::{Connection, serve};

use crate::output::{Failure, Outcome};

/// Serve an editor as a language server for data sheets (EDS, DCF), overlays and machine.toml
///
/// An editor starts it, and speaks with it over stdin and stdout: findings while typing and what mends them, what the object
/// under the cursor is, completion, outline, renaming of objects, formatting. docs/editors.md sets up editors.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Speak over stdin and stdout, as it always does: some editors give this to every server
    #[arg(long)]
    stdio: bool,
}

pub(crate) fn run(_: &Args) -> Result<Outcome, Failure> {
    let (connection, threads) = Connection::stdio();
    let served = serve(&connection).map_err(Failure::new);
    // Drop the connection to end the threads.
    drop(connection);
    served.and_then(|()| Ok(threads.join()?))?;
    Ok(Outcome::Clean)
}
