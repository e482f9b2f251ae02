//! `lexican devices`: the devices of the library.

use std::io::Write;

use lexican_eds::library;

use crate::output::{self, Failure, Outcome, styled};

/// Prints one line per device.
pub(crate) fn run() -> Result<Outcome, Failure> {
    let mut stdout = output::stdout();
    let width = library::all().iter().map(|shipped| shipped.id.len()).max().unwrap_or(0);
    for shipped in library::all() {
        let (device, _) = lexican_eds::load(&shipped.input());
        let info = [device.info.vendor_name.as_deref(), device.info.product_name.as_deref()];
        let name = info.into_iter().flatten().collect::<Vec<_>>().join(" ");
        let entries = device.entries().count();
        let id = styled(anstyle::Style::new().bold(), format_args!("{:<width$}", shipped.id));
        writeln!(stdout, "{id}  {name}: {} objects, {entries} entries ({})", device.objects.len(), shipped.file_name)?;
    }
    stdout.flush()?;
    Ok(Outcome::Clean)
}
