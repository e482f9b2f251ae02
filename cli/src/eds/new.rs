//! `lexican eds new`: a data sheet to begin from.

use std::path::PathBuf;

use lexican_eds::template::{Profile, Template};
use lexican_eds::write;
use serde_json::json;

use crate::lss::number;
use crate::output::{Failure, ForceArgs, Outcome, plural, print_result};

/// Write a new data sheet: what CiA 301 demands, the objects of a device profile, and its PDOs
///
/// `lexican eds lint --strict` finds nothing in it, `lexican simulate` serves it, and `lexican gen` makes code of it. Objects of
/// your own come by `lexican eds add`, other values by `lexican eds set`.
#[derive(clap::Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The file; .eds is added to a name without extension
    #[arg(value_name = "NAME")]
    file: PathBuf,

    /// The device profile: 301 for none, 401 for inputs and outputs, 402 for a servo drive
    #[arg(long, value_name = "NUMBER", value_parser = profile, default_value = "301")]
    profile: Profile,

    /// How many PDOs it receives and transmits, each up to 512
    #[arg(long, value_name = "RECEIVE+TRANSMIT", value_parser = pdos, default_value = "4+4")]
    pdos: (u16, u16),

    /// The vendor-ID that CiA has given its manufacturer: 405, 0x195 or 195h
    #[arg(long, value_name = "NUMBER", value_parser = number)]
    vendor: u32,

    /// The product code
    #[arg(long, value_name = "NUMBER", value_parser = number)]
    product: u32,

    /// The revision number: major in the upper 16 bits, minor in the lower
    #[arg(long, value_name = "NUMBER", value_parser = number, default_value = "0x10000")]
    revision: u32,

    /// The name of its manufacturer
    #[arg(long, value_name = "NAME", default_value = "")]
    vendor_name: String,

    /// The name of the device; that of the file by default
    #[arg(long, value_name = "NAME")]
    name: Option<String>,

    #[command(flatten)]
    force: ForceArgs,

    /// Print a JSON object
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
    lexican eds new valve --vendor 0x195 --product 7
    lexican eds new servo.eds --profile 402 --pdos 2+2 --vendor 405 --product 8 --vendor-name \"SIKO GmbH\" --name Servo
    lexican simulate servo.eds --node 5";

pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut path = args.file.clone();
    if path.extension().is_none() {
        path.set_extension("eds");
    }
    args.force.guard(&path, [])?;
    let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let product_name = args.name.clone().unwrap_or_else(|| part(path.file_stem()));
    let (receive_pdos, transmit_pdos) = args.pdos;
    let template = Template {
        file_name: part(path.file_name()),
        vendor_name: args.vendor_name.clone(),
        vendor_number: args.vendor,
        product_name,
        product_number: args.product,
        revision_number: args.revision,
        profile: args.profile,
        receive_pdos,
        transmit_pdos,
    };
    let device = template.device();
    args.force.write(&path, write::eds(&device).as_bytes())?;
    let file = path.display().to_string();
    let text = format!("{file}: {}", plural(device.objects.len(), "object"));
    let result = json!({ "file": file, "objects": device.objects.len(), "entries": device.entries().count() });
    print_result(args.json, result, text)?;
    Ok(Outcome::Clean)
}

fn profile(text: &str) -> Result<Profile, String> {
    match text {
        "301" => Ok(Profile::Cia301),
        "401" => Ok(Profile::Cia401),
        "402" => Ok(Profile::Cia402),
        _ => Err("there are templates for 301, 401 and 402".to_owned()),
    }
}

fn pdos(text: &str) -> Result<(u16, u16), String> {
    let count = |text: &str| text.trim().parse::<u16>().ok().filter(|&count| count <= 512);
    let counts = text.split_once('+').and_then(|(receive, transmit)| Some((count(receive)?, count(transmit)?)));
    counts.ok_or_else(|| format!("{text:?} is not two numbers up to 512 such as 4+4"))
}
