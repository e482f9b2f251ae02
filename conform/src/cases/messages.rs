//! 5 and 6: emergencies, and SYNC.

use lexican_runtime::CobId;
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};

use super::error_control::has_emergency;
use super::nmt::{received, values};
use super::pdo::{configure, tpdos, transmission};
use super::storing::{self, BOTH, SAVE, STORED};
use super::sync::{PRODUCED, consumes, counts, produce, without_period};
use crate::answers;
use crate::case::{Case, case};
use crate::tester::{Heard, Tester, Write, text};
use crate::verdict::{Outcome, Verdict, ensure, failed, not_applicable};

const SYNC_PERIOD: &str = "A producer sends SYNC with the period of 1006h.";

pub(crate) const CASES: &[Case] = &[
    case("301/7.5.2.17/1", "5.1", "1014h is 80h + node-ID", |t| {
        t.has(&[0x1014])?;
        t.reads(0x1014, 0, 0x80 + u64::from(t.node.get()))
    })
    .requires("1014h has 80h + node-ID by default."),
    case("301/7.5.2.2/1", "5.2", "1001h shows no error", |t| t.reads(0x1001, 0, 0))
    .requires("1001h is 0 while the device has no error."),
    case("301/7.5.2.4/1", "5.3", "1003h:01 has no error", |t| {
        t.has(&[0x1003])?;
        t.reads(0x1003, 0, 0)?;
        match t.upload(0x1003, 1)? {
            Ok(bytes) => {
                ensure(bytes.iter().all(|&byte| byte == 0), || format!("1003:01 is {}", t.shown((0x1003, 1), &bytes)))
            }
            Err(code) if answers::NO_ERROR.takes(code) => Ok(()),
            Err(code) => Err(failed(format!("1003:01: {code}"))),
        }
    })
    .requires("1003h:00 is 0 while no error has been recorded, and the fields behind it have no data."),
    case("301/7.2.7/1", "5.4", "an emergency is sent, once", |t| emergency(t).map(|_| ()))
    .requires("An emergency is sent once for each error, with its code and the error register."),
    case("301/7.5.2.2/2", "5.5", "1001h shows the error that was sent", |t| {
        let [_, _, register, ..] = emergency(t)?;
        ensure(register & 1 != 0, || format!("error register {register:02X}h without the generic bit"))?;
        t.reads(0x1001, 0, u64::from(register))
    })
    .requires("The error register of an emergency is that of 1001h."),
    case("301/7.5.2.4/2", "5.6", "1003h:01 has what was sent", |t| {
        t.has(&[0x1003])?;
        let [low, high, ..] = emergency(t)?;
        t.reads(0x1003, 0, 1)?;
        is_kept(t, 1, u16::from_le_bytes([low, high]))
    })
    .requires("1003h records the errors that were sent, the newest at sub-index 1."),
    case("301/7.5.2.4/3", "", "1003h keeps errors until it is cleared by 0, and takes nothing else", |t| {
        t.has(&[0x1003])?;
        let mut errors = vec![emergency(t)?];
        match emergency(t) {
            // A persisting error need not be sent again.
            Err(Verdict::NotApplicable(_)) => {}
            error => errors.push(error?),
        }
        // As many as fit are kept, the newest first.
        let room = t.entries(|entry| entry.index == 0x1003).len() - 1;
        let kept = room.min(errors.len());
        t.reads(0x1003, 0, kept as u64)?;
        for (sub, error) in (1..).zip(errors.iter().rev().take(kept)) {
            is_kept(t, sub, u16::from_le_bytes([error[0], error[1]]))?;
        }
        t.refuses(0x1003, 0, 0xFF, &answers::ERROR_HISTORY)?;
        t.write(0x1003, 0, 0)?;
        t.reads(0x1003, 0, 0)
    })
    .requires("Writing 0 to 1003h:00 clears the history; no other value is taken."),
    case("301/7.5.2.17/2", "", "no emergency is sent while 1014h has none", |t| {
        if !t.entry(0x1014, 0)?.access.writable() {
            return Err(not_applicable("1014h cannot be written"));
        }
        emergency(t)?;
        let trouble = trouble(t)?;
        // A persisting error is not sent again, but may be once it has ended.
        trouble.ends(t)?;
        t.hear_ms(20)?;
        let cob_id = t.read(0x1014, 0)? as u32;
        t.write(0x1014, 0, cob_id | 1 << 31)?;
        trouble.makes(t)?;
        let heard = t.hear_id(CobId::from_parameter(cob_id), 100)?;
        ensure(heard.is_empty(), || format!("{} come", text(&heard)))
    })
    .requires("No emergency is sent while bit 31 of 1014h is set."),
    case("301/7.5.2.18/1", "", "the inhibit time keeps emergencies away from each other", |t| {
        const INHIBIT_MS: u64 = 300;
        t.has(&[0x1014, 0x1015])?;
        t.write(0x1015, 0, INHIBIT_MS as u32 * 10)?;
        let (trouble, id) = (trouble(t)?, t.emergency_id());
        let mut heard = Vec::new();
        // Waits in between: a device that polls its RPDOs has to see each of them.
        for step in [Trouble::makes, Trouble::ends] {
            step(&trouble, t)?;
            heard.extend(t.hear_id(id, 50)?);
        }
        trouble.makes(t)?;
        heard.extend(t.hear_id(id, 3 * INHIBIT_MS)?);
        if heard.len() < 2 && matches!(trouble, Trouble::ShortRpdo(..)) {
            return Err(not_applicable("a short RPDO and its end bring no two emergencies"));
        }
        let come = ensure(heard.len() >= 2, || format!("two emergencies were expected, {} came", text(&heard)));
        t.needs("301/7.2.7/1", come)?;
        t.are_apart(id, &heard, INHIBIT_MS)
    })
    .requires("Emergencies are at least the inhibit time of 1015h apart (multiples of 100 µs)."),
    case("301/7.5.2.5/1", "6.1", "SYNC has 080h", |t| {
        t.has(&[0x1005])?;
        let cob_id = t.read(0x1005, 0)?;
        ensure(cob_id & 0x3FFF_FFFF == 0x80, || format!("1005h is {cob_id:08X}h"))
    })
    .requires("1005h has the identifier 080h by default."),
    case("301/7.2.5/1", "6.2", "SYNC is produced in its period", |t| {
        produce(t)?;
        t.hears_every(CobId::SYNC, 10, 20).map(|_| ())
    })
    .requires(SYNC_PERIOD),
    case("301/7.2.5/2", "", "SYNC is right in the mean", |t| {
        produce(t)?;
        let heard = t.hears_in_the_mean(CobId::SYNC, 10, 100);
        t.needs(PRODUCED, heard)
    })
    .requires(SYNC_PERIOD)
    .recommended(),
    case("301/7.2.2.2/3", "6.3", "a TPDO comes with every second SYNC that the device produces", |t| {
        let pdo = tpdos(t)?.remove(0);
        let tpdo = configure(t, &pdo, transmission(2))?;
        produce(t)?;
        t.enter(NmtState::Operational)?;
        let heard = t.hear_ms(205)?;
        let count = |id| heard.iter().filter(|(_, frame)| frame.id() == id).count();
        let (syncs, tpdos) = (count(CobId::SYNC), count(tpdo.id));
        let are_produced = (19..=21).contains(&syncs);
        t.needs(PRODUCED, ensure(are_produced, || format!("{tpdos} TPDOs with {syncs} SYNCs")))?;
        ensure(tpdos.abs_diff(syncs / 2) <= 1, || format!("{tpdos} TPDOs with {syncs} SYNCs"))
    })
    .requires("The producer of SYNC sends its own synchronous TPDOs by it."),
    case("301/7.5.2.6/1", "6.4", "a consumer needs no period, and produces nothing", |t| {
        consumes(t)?;
        let pdo = tpdos(t)?.remove(0);
        let tpdo = configure(t, &pdo, transmission(1))?;
        t.write(0x1006, 0, 0)?;
        t.write(0x1005, 0, 0x80)?;
        t.enter(NmtState::Operational)?;
        let produced = t.hear_id(CobId::SYNC, 100)?;
        ensure(produced.is_empty(), || "a consumer produces SYNC")?;
        for _ in 0..3 {
            t.sync(None)?;
            let heard = t.hear_id(tpdo.id, 20)?;
            ensure(heard.len() == 1, || format!("{} came after SYNC", text(&heard)))?;
        }
        Ok(())
    })
    .requires("A device that does not produce SYNC sends none, whatever 1006h has."),
    case("301/7.5.2.22/1", "6.5", "the counter overflow has a range", |t| {
        without_period(t)?;
        for bad in [1, 241, 255] {
            t.refuses(0x1019, 0, bad, &answers::COUNTER_OVERFLOW)?;
        }
        for good in [2, 240, 0] {
            t.write(0x1019, 0, good)?;
        }
        Ok(())
    })
    .requires("1019h takes 0 and 2 to 240, and nothing else."),
    case("301/7.5.2.22/2", "6.6", "with overflow 0, SYNC has no counter", |t| {
        counts(t, 0)?;
        let syncs = t.hears_every(CobId::SYNC, 10, 4)?;
        ensure(syncs.iter().all(|(_, frame)| frame.dlc() == 0), || text(&syncs))
    })
    .requires("With 0 in 1019h, SYNC has no data."),
    case("301/7.5.2.22/3", "6.7", "the counter counts to its overflow", |t| {
        counts(t, 3)?;
        let syncs = t.hears_every(CobId::SYNC, 10, 7);
        let syncs = t.needs(PRODUCED, syncs)?;
        // The first counter value heard may be any.
        let counts = |two: &[Heard]| matches!([two[0].1.data(), two[1].1.data()], [&[one @ 1..=3], &[next]] if next == one % 3 + 1);
        ensure(syncs.windows(2).all(counts), || text(&syncs))
    })
    .requires("With another value in 1019h, SYNC has a counter from 1 to that value."),
    case("301/7.5.2.22/4", "6.8", "the counter overflow is stored", |t| {
        t.entry(0x1010, 1)?;
        without_period(t)?;
        t.write(0x1019, 0, 10)?;
        t.write(0x1010, 1, SAVE)?;
        t.reset(NmtCommand::ResetNode)?;
        let stored = t.reads(0x1019, 0, 10);
        t.needs(STORED, stored)?;
        storing::forget(t)
    })
    .requires("The value of 1019h is among those that 1010h stores.")
    .needs(BOTH),
    case("301/7.5.2.22/5", "6.9", "the counter overflow stays while there is a period", |t| {
        t.entry(0x1019, 0)?;
        consumes(t)?;
        t.write(0x1006, 0, 10_000)?;
        t.refuses(0x1019, 0, 10, &answers::COUNTER_OVERFLOW_IN_USE)
    })
    .requires("1019h is not changed while 1006h is not 0."),
    case("301/7.5.2.5/2", "6.10", "SYNC is stored, and produced after a reset", |t| {
        t.entry(0x1010, 1)?;
        produce(t)?;
        t.write(0x1010, 1, SAVE)?;
        t.reset(NmtCommand::ResetNode)?;
        let heard = t.hears_every(CobId::SYNC, 10, 10);
        t.needs(PRODUCED, heard)?;
        t.write(0x1005, 0, 0x80)?;
        storing::forget(t)
    })
    .requires("A producer of SYNC that was stored produces it after a reset.")
    .needs(BOTH),
];

/// Something that makes a device send an emergency.
enum Trouble {
    Stimulus(Write),
    /// An RPDO without bytes (8210h), which works with every device that has one; and its proper content.
    ShortRpdo(CobId, Vec<u8>),
}

impl Trouble {
    fn makes(&self, t: &mut Tester<'_>) -> Outcome {
        match self {
            Trouble::Stimulus(write) => t.send_write(*write),
            Trouble::ShortRpdo(id, _) => t.send(*id, &[]),
        }
    }

    /// Ends the error, if it is known how.
    fn ends(&self, t: &mut Tester<'_>) -> Outcome {
        match self {
            Trouble::Stimulus(_) => Ok(()),
            Trouble::ShortRpdo(id, whole) => t.send(*id, whole),
        }
    }
}

fn trouble(t: &mut Tester<'_>) -> Outcome<Trouble> {
    has_emergency(t)?;
    if let Some(write) = t.settings.stimuli.emergency {
        return Ok(Trouble::Stimulus(write));
    }
    let (id, pdo) = received(t)?;
    let whole = values(t, &pdo)?;
    t.enter(NmtState::Operational)?;
    Ok(Trouble::ShortRpdo(id, whole))
}

/// Checks the error code in a field of 1003h. The rest of the field is the manufacturer's, and need not be that of the
/// emergency.
fn is_kept(t: &mut Tester<'_>, sub: u8, code: u16) -> Outcome {
    let is = t.read(0x1003, sub)? & 0xFFFF;
    ensure(is == u64::from(code), || format!("1003:{sub:02X} has {is:04X}h, {code:04X}h was sent"))
}

/// Makes the device send an emergency, and returns its eight bytes.
fn emergency(t: &mut Tester<'_>) -> Outcome<[u8; 8]> {
    let trouble = trouble(t)?;
    trouble.makes(t)?;
    let heard = t.hear_id(t.emergency_id(), 100)?;
    if heard.is_empty() && matches!(trouble, Trouble::ShortRpdo(..)) {
        return Err(not_applicable("nothing is known that lets the device send an emergency: a short RPDO does not"));
    }
    let bytes = match &heard[..] {
        [(_, frame)] => <[u8; 8]>::try_from(frame.data()).ok(),
        _ => None,
    };
    let bytes =
        bytes.ok_or_else(|| failed(format!("one emergency of eight bytes was expected, {} came", text(&heard))));
    let bytes = t.needs("301/7.2.7/1", bytes)?;
    ensure(bytes[..2] != [0, 0], || "the emergency has no error code")?;
    Ok(bytes)
}
