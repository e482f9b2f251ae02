//! `cargo bench -p lexican-eds [-- FILE…]`: times reading, checking and building the model, and the tokeniser alone for
//! comparison. Without files it makes a data sheet of 131 kB.

use std::hint::black_box;
use std::time::{Duration, Instant};
use std::{env, fs};

use ini::{Ini, ParseOption};
use lexican_eds::{Input, Source, load};

/// The fastest of this many runs counts: disturbances only make a run slower.
const RUNS: usize = 200;

fn main() {
    let files: Vec<String> = env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    println!("{:>9}  {:>9}  {:>9}  {:>6}  file", "bytes", "rust-ini", "lexican", "ratio");
    if files.is_empty() {
        measure("made", &data_sheet(131_000));
    }
    for file in files {
        match fs::read(&file) {
            Ok(bytes) => measure(&file, &String::from_utf8_lossy(&bytes)),
            Err(error) => println!("{file}: {error}"),
        }
    }
}

fn measure(name: &str, text: &str) {
    let options = || ParseOption { enabled_quote: false, enabled_escape: false, ..ParseOption::default() };
    let tokenizing = best(|| Ini::load_from_str_opt(black_box(text), options()).is_ok());
    let reading = best(|| {
        let input = Input::new(Source::from_bytes("x.eds", black_box(text.as_bytes())));
        load(&input).0.objects.len()
    });
    let ratio = reading.as_secs_f64() / tokenizing.as_secs_f64();
    let ms = |time: Duration| format!("{:.3} ms", time.as_secs_f64() * 1000.0);
    println!("{:>9}  {:>9}  {:>9}  {ratio:>6.2}  {name}", text.len(), ms(tokenizing), ms(reading));
}

#[expect(clippy::disallowed_methods, reason = "a benchmark measures real time")]
fn best<T>(run: impl Fn() -> T) -> Duration {
    let once = || {
        let start = Instant::now();
        black_box(run());
        start.elapsed()
    };
    (0..RUNS).map(|_| once()).min().unwrap_or_default()
}

/// Records of ten entries, as editors write them.
fn data_sheet(bytes: usize) -> String {
    let mut text = String::from(
        "[FileInfo]\r\nFileName=made.eds\r\n\r\n[DeviceInfo]\r\nVendorName=Nobody\r\nBaudRate_500=1\r\n\r\n",
    );
    let mut list = String::new();
    let mut count = 0;
    for index in 0x2000..0x6000 {
        if text.len() + list.len() > bytes {
            break;
        }
        count += 1;
        list += &format!("{count}=0x{index:04X}\r\n");
        text +=
            &format!("[{index:04X}]\r\nParameterName=Parameter set {count}\r\nObjectType=0x9\r\nSubNumber=11\r\n\r\n");
        for sub in 0..=10 {
            let (name, data_type, default) = match sub {
                0 => ("Highest sub-index".to_owned(), 5, "10".to_owned()),
                _ => (format!("Parameter {sub} of set {count}"), 7, format!("0x{:X}", sub * 1000)),
            };
            text += &format!(
                "[{index:04X}sub{sub:X}]\r\nParameterName={name}\r\nObjectType=0x7\r\nDataType=0x{data_type:04X}\r\n\
                 AccessType=rw\r\nDefaultValue={default}\r\nPDOMapping=0\r\n\r\n"
            );
        }
    }
    format!("{text}[ManufacturerObjects]\r\nSupportedObjects={count}\r\n{list}")
}
