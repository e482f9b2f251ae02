//! Applies every remedy as printed: the finding is gone, there is no new one, and only what the remedy names has
//! changed in the device.

use crate::cases::cases;
use crate::remedy::{changes, count, remedies};
use lexican_eds::fix::fix;
use lexican_eds::{Diagnostic, Input, Source, load};

#[test]
fn remedies_of_the_golden_cases_mend_what_was_found_and_nothing_else() {
    let mut applied = 0;
    for case in cases() {
        applied += all_remedies_help(&case.input);
    }
    assert!(applied > 90, "{applied} remedies");
}

/// Everything on which the remedies of the rules depend, each in a few lines: with and without the key, in tables and
/// sections, for variables and entries.
#[test]
fn remedies_fit_the_finding_at_hand() {
    let object = |keys: &str| format!("[2000]\nParameterName=x\nObjectType=7\nDataType=6\nAccessType=rw\n{keys}\n");
    let record = |index: &str, keys: &str| {
        format!(
            "[{index}]\nParameterName=x\nObjectType=9\nSubNumber=2\n\
             [{index}sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
             [{index}sub1]\nParameterName=y\n{keys}\n"
        )
    };
    let texts = [
        object("DefaultValue=010"),
        object("DefaultValue=089"),
        object("DefaultValue=$NODEID+010"),
        object("DefaultValue=0x10 ; ten"),
        object("LowLimit=1F80h"),
        object("DefaultValue=NULL"),
        object("DefaultValue=1F"),
        object("DefaultValue=12 V"),
        object("HighLimit=70000"),
        object("LowLimit=-1"),
        object("LowLimit=9\nHighLimit=1\nDefaultValue=20"),
        object("LowLimit=9\nHighLimit=1\nDefaultValue=5"),
        object("LowLimit=9\nDefaultValue=5"),
        object("HighLimit=9\nDefaultValue=$NODEID"),
        object("LowLimit=7\nHighLimit=7"),
        object("LowLimit=6144\nHighLimit=49152\nDefaultValue=70000"),
        "[2000]\nParameterName=x\nObjectType=7\nDataType=4\nAccessType=rw\nLowLimit=0xEC78\nHighLimit=0x1388\n"
            .to_owned(),
        "[2000]\nParameterName=x\nObjectType=7\nDataType=3\nAccessType=rw\nLowLimit=0\nHighLimit=0xFFFF\n".to_owned(),
        "[2000]\nParameterName=x\nObjectType=7\nDataType=8\nAccessType=rw\nHighLimit=0xFFFF\n".to_owned(),
        "[ManufacturerObjects]\nSupportedObjects=3\n1=0x2000\n1=0x2001\n3=0x2002\n".to_owned()
            + &["2000", "2001", "2002"]
                .map(|index| format!("[{index}]\nParameterName=x{index}\nDataType=6\nAccessType=rw\n"))
                .concat(),
        object("DefaultValue=70000"),
        object("ParameterValue=70000\nHighLimit=3"),
        object("PDOMapping=2"),
        "[2000]\nParameterName=x\nObjectType=7\nDataType=UNSIGNED16\nAccessType=readonly\n".to_owned(),
        "[2000]\nParameterName=x\nObjectType=7\nDataType=8\nAccessType=rw\nDefaultValue=2,5\nLowLimit=1.0f\n"
            .to_owned(),
        "[2000]\nParameterName=x\nObjectType=7\nDataType=10\nAccessType=rw\nDefaultValue=text\n".to_owned(),
        "[2000]\nParameterName=x\nObjectType=7\nDataType=6\nAccessType=ro\nParameterValue=3\n".to_owned(),
        "[2000]\nParameterName=x\nObjectType=7\nDataType=6\nAccessType=rwr\n".to_owned(),
        "[2000]\nObjectType=7\nDataType=9\nPDOMapping=1\n".to_owned(),
        "[1005]\nParameterName=x\nObjectType=7\nAccessType=rw\nPDOMapping=1\nDefaultValue=0x601\n".to_owned(),
        "[1017]\nParameterName=x\nObjectType=7\nDataType=7\nAccessType=rw\nDefaultValue=70000\n".to_owned(),
        "[1017]\nParameterName=x\nObjectType=7\nDataType=7\nAccessType=rw\nDefaultValue=70\n".to_owned(),
        record("2000", "DataType=6\nAccessType=const"),
        record("2000", "DataType=6\nObjectType=9"),
        record("1018", "DataType=5\nAccessType=rw\nDefaultValue=0x10"),
        record("2000", "DataType=6\nAccessType=ro\n[2000Value]\nNrOfEntries=1\n1=5"),
        "[2000]\nParameterName=x\nObjectType=8\nSubNumber=3\n\
         [2000sub0]\nParameterName=n\nDataType=6\nAccessType=const\n\
         [2000sub1]\nParameterName=a\nDataType=4\nAccessType=rw\nDefaultValue=-1\n\
         [2000sub2]\nParameterName=b\nDataType=3\nAccessType=rw\nDefaultValue=-2\n"
            .to_owned(),
        "[2000]\nParameterName=x\nObjectType=8\nSubNumber=3\n\
         [2000sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=5\n\
         [2000sub1]\nParameterName=a\nDataType=5\nAccessType=rw\nDefaultValue=1\n\
         [2000sub2]\nParameterName=a\nDataType=3\nAccessType=rw\nDefaultValue=-2\n"
            .to_owned(),
        "[2000]\nParameterName=x\nSubNumber=1\n[2000sub1]\nParameterName=a\nDataType=5\nAccessType=rw\n".to_owned(),
        "[DeviceInfo]\nVendorNumber=x\nOrderCode=1\nRevisionNumber=1 kg\nCompactPDO=0x80\n".to_owned(),
        "[DeviceInfo]\nCompactPDO=1\nNrOfTXPDO=1\nGranularity=8\nVendorNumber=07\nProductNumber=019\n".to_owned(),
        "[DeviceInfo]\nDynamicChannelsSupported=1\nNrOfRXPDO=3\n[FileInfo]\nCreationDate=2011-3-7\n\
         CreationTime=14:05\nModificationDate=7.3.2011\nModificationTime=noon\n"
            .to_owned(),
        "[DynamicChannels]\nNrOfSeg=0\n[DeviceInfo]\nVendorName=x\n".to_owned(),
        "lost=1\nmore=2\n[FileInfo]\nFileName x\nCreatedBy: me\n[DeviceInfo\n[2000] x\n".to_owned(),
        "[FileInfo]\n[]\na=1\n".to_owned(),
        format!("; {}\n[2000]\nParameterName={}\n", "long ".repeat(120), "name ".repeat(60)),
        "[1A00]\nParameterName=m\nObjectType=9\nSubNumber=2\n\
         [1A00sub0]\nParameterName=n\nDataType=5\nAccessType=rw\nDefaultValue=2\n\
         [1A00sub1]\nParameterName=a\nDataType=7\nAccessType=rw\nDefaultValue=0x00050008\n\
         [2000]\nParameterName=x\nObjectType=7\nDataType=6\nAccessType=wo\n"
            .to_owned(),
        "[1A00]\nParameterName=m\nObjectType=9\nSubNumber=2\n\
         [1A00sub0]\nParameterName=n\nDataType=5\nAccessType=rw\nDefaultValue=1\n\
         [1A00sub1]\nParameterName=a\nDataType=7\nAccessType=rw\nDefaultValue=0x20000008\n\
         [1800]\nParameterName=c\nObjectType=9\nSubNumber=2\n\
         [1800sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n\
         [1800sub1]\nParameterName=i\nDataType=7\nAccessType=rw\nDefaultValue=0x180\n\
         [2000]\nParameterName=x\nObjectType=7\nDataType=6\nAccessType=wo\nPDOMapping=1\n"
            .to_owned(),
    ];
    let mut applied = 0;
    for text in texts {
        applied += all_remedies_help(&Input::new(Source::new("input.eds", text)));
    }
    assert!(applied > 100, "{applied} remedies");
}

/// A fixed finding is gone, nothing else is found, no other line changes, and nothing is left to fix.
fn fixing_is_done_once(input: &Input) {
    let (_, before) = load(input);
    let fixed = fix(input);
    let render = |found: &[Diagnostic]| found.iter().map(|it| it.render_short(input) + "\n").collect::<String>();
    let what = || format!("{}\n{}\nbecomes\n{}", render(&before), input.eds.text(), fixed.input.eds.text());
    for code in before.iter().chain(fixed.left.iter()).map(|finding| finding.code) {
        let of_code = |found: &[Diagnostic]| found.iter().filter(|finding| finding.code == code).count();
        let mended = fixed.fixed.get(code).copied().unwrap_or(0);
        assert!(of_code(&fixed.left) + mended <= of_code(&before), "{code}: {}", what());
    }
    assert!(fixed.left.iter().all(|finding| finding.fix.is_none()), "{}{}", render(&fixed.left), what());
    for other in before.iter().filter(|finding| finding.fix.is_none()) {
        let gone = count(&fixed.left, other) < count(&before, other);
        assert!(!gone || !fixed.fixed.is_empty(), "{}", what());
    }
    let again = fix(&fixed.input);
    assert_eq!((again.input.eds.text(), again.fixed.len()), (fixed.input.eds.text(), 0), "{}", what());
    if before.iter().all(|finding| finding.fix.is_none()) {
        assert_eq!(fixed.input.eds.text(), input.eds.text());
    }
}

/// Applies each remedy of each finding to the input. Returns the number of remedies.
fn all_remedies_help(input: &Input) -> usize {
    fixing_is_done_once(input);
    let (device, findings) = load(input);
    let mut applied = 0;
    for finding in findings.iter() {
        for remedy in remedies(finding.help.as_deref().unwrap_or_default()) {
            let (after, found) = load(&remedy.applied(input));
            let what = || format!("{}\nwith the remedy\n{}", finding.render(input), remedy.text);
            assert!(count(&found, finding) < count(&findings, finding), "is not gone:\n{}", what());
            for other in found.iter() {
                assert!(count(&found, other) <= count(&findings, other), "now {}:\n{}", other.message, what());
            }
            for place in changes(&device, &after) {
                assert!(remedy.may_change(&place, finding, input), "changes {place}:\n{}", what());
            }
            applied += 1;
        }
    }
    applied
}
