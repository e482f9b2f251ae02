//! `lexican eds` commands that write or change data sheets.

use std::path::Path;

use crate::common::{Run, files, folder, lexican, lexican_in};

const SHEET: &str = include_str!("../sensor.eds");

fn new(folder: &Path, args: &str) -> Run {
    let words = ["eds", "new"].into_iter().chain(args.split(' '));
    lexican_in(folder, &words.collect::<Vec<_>>())
}

#[test]
fn a_new_data_sheet_is_clean_is_served_and_compiles() {
    let folder = folder("eds-new");
    for (profile, pdos, objects) in [("301", "0+0", 8), ("401", "2+3", 8 + 5 + 10), ("402", "4+4", 8 + 25 + 16)] {
        let name = format!("p{profile}");
        let file = &*format!("{name}.eds");
        new(
            &folder,
            &format!("{name} --profile {profile} --pdos {pdos} --vendor 0x1234 --product 7 --vendor-name Nobody"),
        )
        .on_stdout(0, &format!("{file}: {objects} objects"));
        let lint = lexican_in(&folder, &["eds", "lint", "--strict", "--fail-on", "note", file]);
        assert_eq!(lint.code, Some(0), "{lint}");
        // A firmware is generated from them, too.
        lexican_in(&folder, &["gen", file, "--storage", "--names", "--force", "-o", "od.rs"]).on_stderr(0, "");
        let bus = format!("sim:{file}?node=5");
        lexican_in(&folder, &["read", "--bus", &bus, "--device", file, "Product code"]).on_stdout(0, "= 7");
        lexican_in(&folder, &["check", "--bus", &bus, "--device", file]).on_stdout(0, "");
    }
    lexican_in(&folder, &["gen", "p402.eds", "--driver"]).on_stdout(0, "pub mod driver");
    lexican_in(&folder, &["read", "--bus", "sim:p402.eds?node=5", "--device", "p402.eds", "6041"])
        .on_stdout(0, "SWITCH ON DISABLED");

    new(&folder, "p301 --vendor 1 --product 2").on_stderr(2, "cannot write p301.eds: it is there already");
    new(&folder, "p301 --vendor 1 --product 2 --force --json").on_stdout(0, "\"objects\":24");
    for (args, words) in [
        ("x --vendor 1 --product 2 --profile 406", "there are templates for 301, 401 and 402"),
        ("x --vendor 1 --product 2 --pdos 4", "is not two numbers up to 512"),
        ("x --vendor 1 --product 2 --pdos 1+513", "is not two numbers up to 512"),
        ("x --vendor CiA --product 2", "is not a number of 32 bits"),
        ("x --product 2", "--vendor"),
    ] {
        new(&folder, args).on_stderr(2, words);
    }
    assert_eq!(files(&folder), ["od.rs", "p301.eds", "p401.eds", "p402.eds"]);
}

#[test]
fn keys_are_set_in_place_and_nothing_else_changes() {
    let folder = folder("eds-set");
    // In code page 1252, with a comment and Windows line ends.
    let text = SHEET.replace('\n', "\r\n").replace("[2000]", "; ge\u{e4}ndert\r\n[2000]");
    let bytes = |text: &str| text.chars().map(|letter| letter as u8).collect::<Vec<_>>();
    std::fs::write(folder.join("x.eds"), bytes(&text)).unwrap();
    let set = |args: &[&str]| lexican_in(&folder, &[&["eds", "set", "x.eds"], args].concat());
    let read = || std::fs::read(folder.join("x.eds")).unwrap();

    set(&["DeviceInfo", "VendorName=Somebody", "--dry-run"])
        .on_stdout(0, "-VendorName=Nobody\r\n+VendorName=Somebody\r\n");
    assert_eq!(read(), bytes(&text));
    set(&["DeviceInfo", "VendorName=Somebody"]).on_stdout(0, "+VendorName=Somebody");
    let text = text.replace("VendorName=Nobody", "VendorName=Somebody");
    assert_eq!(read(), bytes(&text));
    // By name, with a data type by name, and with a key that is removed again.
    set(&["producer heartbeat time", "datatype=UNSIGNED16", "HighLimit=5000"]).on_stdout(0, "+HighLimit=5000");
    let json = set(&["Producer heartbeat time", "HighLimit=", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!((&json["written"], &json["changes"][0]["place"]), (&true.into(), &"1017:00".into()), "{json:#}");
    assert_eq!(read(), bytes(&text));

    for (args, code, words) in [
        (&["2FFF", "DefaultValue=1"][..], 2, "the data sheet has no object 2FFF"),
        (&["Product heartbeat tim", "DefaultValue=1"], 2, "did you mean 1017:00"),
        (&["1017", "Default=1"], 2, "its keys are ParameterName, ObjectType, DataType"),
        (&["1017:01", "DefaultValue=1"], 2, "1017 has no sub-indices"),
        (&["1018:0F", "DefaultValue=1"], 2, "there is no section [1018subF]"),
        (&["1017", "DefaultValue"], 2, "is not KEY=VALUE"),
        (&["1017", "DefaultValue=70000"], 1, "`DefaultValue` does not fit into UNSIGNED16"),
        (&["1017", "DefaultValue=9", "HighLimit=8"], 1, "`DefaultValue` is above the high limit"),
        (&["1017", "AccessType=often"], 1, "there is no access type `often`"),
        (&["1017", "ParameterName=\u{3a9}"], 2, "x.eds is in code page 1252, which has no \"\u{3a9}\""),
    ] {
        set(args).on_stderr(code, words);
        assert_eq!(read(), bytes(&text), "{args:?}");
    }
    set(&["1017", "DefaultValue=70000"]).on_stderr(1, "nothing is written, for it would bring up 1 finding");
    set(&["1017", "DefaultValue=70000", "--force"]).on_stderr(0, "does not fit into UNSIGNED16");
    assert!(String::from_utf8_lossy(&read()).contains("=70000\r\n"));
    lexican(&["eds", "set", "siko/ag03-1", "1017", "DefaultValue=1"])
        .on_stderr(2, "is not a file that could be written");
}

#[test]
fn a_value_with_its_unit_or_name_is_set_by_an_overlay() {
    let folder = folder("eds-set-unit");
    std::fs::write(folder.join("x.eds"), SHEET).unwrap();
    let overlay = "[overlay]\nformat = 1\n[quantity.time]\nunits = [{ symbol = \"s\", method = \"seconds\", scale = \"1/1000\" }]\n\
                   [object.\"1017\"]\nreason = \"as CiA 301 says\"\nquantity = \"time\"\n";
    std::fs::write(folder.join("x.toml"), overlay).unwrap();
    let set =
        |value: &str| lexican_in(&folder, &["eds", "set", "x.eds", "1017", value, "--overlay", "x.toml", "--dry-run"]);
    set("DefaultValue=0.5 s").on_stdout(0, "+DefaultValue=500\n");
    set("DefaultValue=5").on_stdout(0, "+DefaultValue=5\n");
    set("DefaultValue=5 kg").on_stderr(2, "1017:00: ");
}

#[test]
fn objects_and_sub_indices_come_and_go() {
    let folder = folder("eds-add");
    new(&folder, "x --profile 402 --pdos 1+1 --vendor 1 --product 2").on_stdout(0, "x.eds");
    let read = || std::fs::read_to_string(folder.join("x.eds")).unwrap();
    let eds = |args: &[&str]| lexican_in(&folder, &[&["eds", args[0], "x.eds"], &args[1..]].concat());
    let before = read();

    let limits = ["--default", "100", "--high", "1000"];
    let set_point = ["add", "2005", "--name", "Set point", "--type", "UNSIGNED16", "--access", "rww", "--pdo"];
    eds(&[&set_point[..], &limits].concat()).on_stdout(0, "+SupportedObjects=1\r\n+1=0x2005\r\n");
    eds(&[
        "add",
        "2010",
        "--name",
        "Coil",
        "--kind",
        "array",
        "--type",
        "INTEGER16",
        "--elements",
        "2",
        "--default",
        "-5",
    ])
    .on_stdout(0, "+[2010sub2]");
    eds(&["add", "2010:03", "--name", "Coil 3", "--type", "INTEGER16"]).on_stdout(0, "+SubNumber=4");
    // The data type comes from the standard.
    eds(&["add", "6065", "--name", "Following error window"]).on_stdout(0, "+DataType=0x0007");
    let lint = lexican_in(&folder, &["eds", "lint", "x.eds", "--fail-on", "note"]);
    assert_eq!(lint.code, Some(0), "{lint}");
    let dump = lexican_in(&folder, &["eds", "dump", "x.eds"]);
    for row in
        ["2005,00,Set point,VAR,UNSIGNED16,rww,1,100,,1000", "2010,02,Coil 2,ARRAY,INTEGER16,rw,0,-5", "2010,03,Coil 3"]
    {
        assert!(dump.stdout.contains(row), "{row}: {dump}");
    }

    for (args, code, words) in [
        (&["add", "2005", "--name", "x", "--type", "UNSIGNED8"][..], 2, "[2005] is there already"),
        (&["add", "2005:01", "--name", "x", "--type", "UNSIGNED8"], 2, "2005 has no sub-indices"),
        (&["add", "2006", "--name", "x"], 2, "what is the data type of 2006:00?"),
        (&["add", "Set point", "--name", "x"], 2, "is not an address"),
        (&["add", "2006", "--name", "x", "--type", "UNSIGNED8", "--default", "256"], 1, "does not fit into UNSIGNED8"),
        (&["add", "2006", "--name", "Set-Point", "--type", "UNSIGNED8", "--access", "rwx"], 2, "there is ro, wo, rw"),
        (&["remove", "6040"], 1, "there is no 6040:00 for RPDO 1 to map"),
        (&["remove", "1000"], 1, "the device type (1000) is missing"),
        (&["remove", "2007"], 2, "the data sheet has no object 2007"),
        (&["remove", "DeviceInfo"], 2, "DeviceInfo is no object"),
    ] {
        eds(args).on_stderr(code, words);
    }
    eds(&["remove", "2010:03", "Set point", "2010"]).on_stdout(0, "-[2010sub3]");
    eds(&["remove", "Following error window"]).on_stdout(0, "-[6065]");
    let tidy = |text: &str| text.replace("\r\n\r\n", "\r\n");
    assert_eq!(tidy(&read()), tidy(&before));
}

#[test]
fn a_database_has_the_messages_of_a_data_sheet() {
    let folder = folder("eds-to-dbc");
    let run = lexican_in(&folder, &["eds", "to-dbc", "siko/ag03-1", "--node", "5,7"]);
    run.on_stdout(0, "BO_ 389 Node5_TPDO1: ");
    for line in ["BU_: Manager Node5 Node7\n", "BO_ 0 NMT: 2 Manager\n", "BO_ 1799 Node7_Heartbeat: 1 Node7\n"] {
        assert!(run.stdout.contains(line), "{line:?}: {run}");
    }
    lexican_in(&folder, &["eds", "to-dbc", "siko/ag03-1", "--node", "0x05", "-o", "x.dbc"]).on_stdout(0, "");
    assert_eq!(files(&folder), ["x.dbc"]);
    lexican(&["eds", "to-dbc", "siko/ag03-1"]).on_stderr(2, "which node-ID has it?");
    lexican(&["eds", "to-dbc", "siko/ag03-1", "--node", "128"]).on_stderr(2, "128");
    // A DCF states its node-ID.
    let dcf = SHEET.replace("[1000]", "[DeviceComissioning]\nNodeID=9\n\n[1000]");
    std::fs::write(folder.join("x.dcf"), dcf).unwrap();
    lexican_in(&folder, &["eds", "to-dbc", "x.dcf"]).on_stdout(0, "BO_ 1801 Node9_Heartbeat: 1 Node9\n");
}
