//! CiA 305: LSS. The clauses are those of version 3.0.0.
//!
//! Only the device under test is configured: it is selected by its identity. Cases note what they change in it, so that
//! [`put_back`] can undo that, however a case ends.

use lexican_runtime::wire::lss::{self, BIT_TIMING_TABLE, Bound, Identity, LssRequest, LssResponse, LssState, Part};
use lexican_runtime::wire::nmt::{NmtCommand, NmtState};
use lexican_runtime::{CobId, Duration, Frame, NodeId};

use crate::case::{Case, Scope, case};
use crate::hazard::Hazard;
use crate::lss::{Addressed, Changes};
use crate::tester::{PATIENCE, PATIENCE_MS, Tester};
use crate::verdict::{Outcome, ensure, failed, not_applicable};

const NODE_ID: &[Hazard] = &[Hazard::NodeId];
const STORE: &[Hazard] = &[Hazard::Store];

/// How long a device may take to store its configuration.
const STORING: Duration = Duration::from_secs(3);

/// The indices of CiA 305, table 1, except that of automatic detection.
const INDICES: std::ops::Range<u8> = 0..BIT_TIMING_TABLE.len() as u8;

const fn lss(id: &'static str, title: &'static str, run: fn(&mut Tester<'_>) -> Outcome) -> Case {
    case(id, "", title, run).about(Scope::Lss)
}

const SELECTIVE: &str =
    "Switch state selective selects the one device whose vendor, product, revision and serial number it has.";
const WAITING: &str = "In LSS waiting a device configures nothing, and does not answer inquiries.";
const IDENTIFY: &str = "A device answers to identify remote slave if its identity lies in the ranges, and only then.";
const UNCONFIGURED: &str = "Only a device without node-ID answers to identify non-configured remote slave.";
const FASTSCAN: &str = "Fastscan finds devices without node-ID bit by bit, each part of the identity in its turn.";

pub(crate) const CASES: &[Case] = &[
    lss("305/6.3.2/1", "switch state global leads to LSS configuration and back to LSS waiting", |t| {
        let lss = begin(t)?;
        is_silent(t, LssRequest::InquireNode.frame())?;
        switch(t, LssState::Configuration)?;
        answers(t, LssRequest::InquireNode, LssResponse::InquiredNode(Some(lss.node)))?;
        switch(t, LssState::Waiting)?;
        is_silent(t, LssRequest::InquireNode.frame())
    })
    .requires("All devices with LSS obey switch state global, in both directions."),
    lss("305/6.3.2/2", "LSS is there in every NMT state", |t| {
        begin(t)?;
        for state in [NmtState::Stopped, NmtState::Operational, NmtState::PreOperational] {
            t.enter(state)?;
            select(t)?;
            switch(t, LssState::Waiting)?;
        }
        Ok(())
    })
    .requires("LSS does not depend on the NMT state.")
    .recommended(),
    lss("305/6.3.3/1", "switch state selective selects the device by its identity", |t| {
        let lss = begin(t)?;
        select(t)?;
        answers(t, LssRequest::InquireNode, LssResponse::InquiredNode(Some(lss.node)))
    })
    .requires(SELECTIVE),
    lss("305/6.3.3/2", "switch state selective does not select the device by another identity", |t| {
        let lss = begin(t)?;
        for other in Part::ALL {
            for part in Part::ALL {
                let value = lss.identity.part(part) ^ u32::from(part == other);
                is_silent(t, LssRequest::SwitchSelective(part, value).frame())?;
            }
            is_silent(t, LssRequest::InquireNode.frame())?;
        }
        Ok(())
    })
    .requires(SELECTIVE),
    lss("305/6.4.2/1", "configure node-ID: the device has it after its communication is reset", |t| {
        let lss = begin(t)?;
        let other = free_node(t)?;
        select(t)?;
        configure_node(t, Some(other))?;
        switch(t, LssState::Waiting)?;
        t.nmt(NmtCommand::ResetCommunication)?;
        let boot_up = t.next(CobId::of_node(0x700, other), t.settings.boot)?;
        ensure(boot_up.is_some_and(|frame| frame.data() == [0]), || format!("it does not boot as node {other}"))?;
        ensure(is_there(t, other)?, || format!("node {other} does not answer"))?;
        ensure(!is_there(t, lss.node)?, || format!("node {} still answers", lss.node))
    })
    .requires("The node-ID that was configured is active after the communication was reset.")
    .needs(NODE_ID),
    lss("305/6.4.2/2", "configure node-ID: 0 and 128 to 254 are refused", |t| {
        begin(t)?;
        select(t)?;
        for node in [0, 128, 200, 254] {
            // If the device takes it, `put_back` restores its own.
            t.lss.node = Some(None);
            let request = Frame::from_array(lss::REQUEST, [0x11, node, 0, 0, 0, 0, 0, 0]);
            is_answered(t, request, LssResponse::ConfigureNode { error: 1, specific: 0 })?;
        }
        Ok(())
    })
    .requires("Node-IDs are 1 to 127, or 255 for none; others are refused with error code 1.")
    .needs(NODE_ID),
    lss("305/6.4.2/3", "configuring and inquiring are left unanswered in LSS waiting", |t| {
        let lss = begin(t)?;
        // These change nothing, even if the device carries them out.
        let own = LssRequest::ConfigureNode(Some(lss.node));
        let none = LssRequest::ConfigureBitTiming { table: 0, index: 255 };
        let inquiries = Part::ALL.map(LssRequest::Inquire);
        for request in [own, none, LssRequest::InquireNode].into_iter().chain(inquiries) {
            is_silent(t, request.frame())?;
        }
        Ok(())
    })
    .requires(WAITING),
    lss("305/6.4.2/4", "a device without node-ID has LSS and nothing else", |t| {
        let lss = lose_node_id(t)?;
        ensure(!is_there(t, lss.node)?, || "it answers SDO")?;
        t.nmt(NmtCommand::Start)?;
        t.send_remote(t.error_control(), 1)?;
        t.sync(None)?;
        let mut heard = t.hear_ms(PATIENCE_MS)?;
        heard.retain(|(_, frame)| frame.id().raw() & 0x7F == u32::from(lss.node.get()));
        ensure(heard.is_empty(), || format!("{} came", crate::tester::text(&heard)))?;
        select(t)?;
        answers(t, LssRequest::InquireNode, LssResponse::InquiredNode(None))
    })
    .requires("A device without a valid node-ID has LSS, and no other service.")
    .needs(NODE_ID),
    lss("305/6.4.3/1", "configure bit timing: the bit rates of the data sheet are taken", |t| {
        begin(t)?;
        own_rate(t)?;
        select(t)?;
        let supported: Vec<u8> = INDICES.filter(|&index| supports(t, index)).collect();
        supported.into_iter().try_for_each(|index| configure_bit_timing(t, index, 0))
    })
    .requires("Bit rates of table 0 that the device supports are taken by configure bit timing.")
    .needs(NODE_ID),
    lss("305/6.4.3/2", "configure bit timing: other bit rates and tables are refused", |t| {
        begin(t)?;
        own_rate(t)?;
        select(t)?;
        let others: Vec<u8> = INDICES.chain([10, 255]).filter(|&index| !supports(t, index)).collect();
        others.into_iter().try_for_each(|index| configure_bit_timing(t, index, 1))?;
        let of_reserved_table = LssRequest::ConfigureBitTiming { table: 1, index: 0 };
        answers(t, of_reserved_table, LssResponse::ConfigureBitTiming { error: 1, specific: 0 })
    })
    .requires("Bit rates and tables that the device does not support are refused with error code 1.")
    .needs(NODE_ID),
    lss("305/6.4.5/1", "store configuration succeeds, or says that it is not supported", |t| {
        // The present configuration is stored, so nothing changes.
        begin(t)?;
        select(t)?;
        match ask_within(t, LssRequest::Store.frame(), STORING)? {
            Some(answer) if answer == (LssResponse::Store { error: 0, specific: 0 }).frame() => Ok(()),
            Some(answer) if answer == (LssResponse::Store { error: 1, specific: 0 }).frame() => Ok(()),
            answer => Err(failed(format!("store configuration is answered by {}", text(answer)))),
        }
    })
    .requires("Store configuration is answered by success, or by an error code.")
    .needs(STORE),
    lss("305/6.4.5/2", "store configuration is left unanswered in LSS waiting", |t| {
        begin(t)?;
        is_silent(t, LssRequest::Store.frame())
    })
    .requires(WAITING)
    .needs(STORE),
    lss("305/6.5.2/1", "inquire identity has what 1018h has", |t| {
        let lss = begin(t)?;
        select(t)?;
        for part in Part::ALL {
            answers(t, LssRequest::Inquire(part), LssResponse::Inquired(part, lss.identity.part(part)))?;
        }
        Ok(())
    })
    .requires("Each part of the LSS address is that of 1018h."),
    lss("305/6.5.3/1", "inquire node-ID has the active node-ID, and not the one that was configured", |t| {
        let lss = begin(t)?;
        let other = free_node(t)?;
        select(t)?;
        configure_node(t, Some(other))?;
        answers(t, LssRequest::InquireNode, LssResponse::InquiredNode(Some(lss.node)))
    })
    .requires("Inquire node-ID has the node-ID that is active.")
    .needs(NODE_ID),
    lss("305/6.6.2/1", "identify remote slave: the device answers to a range that has its identity", |t| {
        let lss = begin(t)?;
        for (low, high) in [(lss.identity.serial, lss.identity.serial), (0, u32::MAX)] {
            let asked = identify(t, lss.of_major_revision(low), high)?;
            ensure(asked.is_some(), || format!("it does not answer to serial numbers {low:X}h to {high:X}h"))?;
        }
        Ok(())
    })
    .requires(IDENTIFY),
    lss("305/6.6.2/2", "identify remote slave: the device is silent if the range lacks its identity", |t| {
        let lss = begin(t)?;
        let Identity { vendor, product, revision, serial } = lss.identity;
        let own = lss.of_major_revision(0);
        let others = [
            Some((Identity { vendor: vendor ^ 1, ..own }, u32::MAX)),
            Some((Identity { product: product ^ 1, ..own }, u32::MAX)),
            (revision >> 16)
                .checked_add(1)
                .filter(|major| *major <= 0xFFFF)
                .map(|major| (Identity { revision: major << 16, ..own }, u32::MAX)),
            serial.checked_add(1).map(|low| (Identity { serial: low, ..own }, u32::MAX)),
            serial.checked_sub(1).map(|high| (own, high)),
        ];
        for (low, high) in others.into_iter().flatten() {
            let answer = identify(t, low, high)?;
            ensure(answer.is_none(), || format!("it answers to {low:X?}, serial numbers up to {high:X}h"))?;
        }
        Ok(())
    })
    .requires(IDENTIFY),
    lss("305/6.6.4/1", "identify non-configured remote slave: a device with node-ID is silent", |t| {
        begin(t)?;
        is_silent(t, LssRequest::IdentifyUnconfigured.frame())
    })
    .requires(UNCONFIGURED),
    lss("305/6.6.4/2", "identify non-configured remote slave: a device without node-ID answers", |t| {
        lose_node_id(t)?;
        answers(t, LssRequest::IdentifyUnconfigured, LssResponse::Unconfigured)
    })
    .requires(UNCONFIGURED)
    .needs(NODE_ID),
    lss("305/6.7/1", "fastscan: a device without node-ID is found bit by bit, and selected", |t| {
        let lss = lose_node_id(t)?;
        answers(t, RESTART, LssResponse::Identified)?;
        for part in Part::ALL {
            let number = lss.identity.part(part);
            for bit in (0..32).rev() {
                // The bits above `bit` are right; `bit` itself is 0, and so are those below.
                let value = number >> bit >> 1 << 1 << bit;
                let step = LssRequest::Fastscan { value, bits_left: bit, part, next: part };
                match number >> bit & 1 {
                    0 => answers(t, step, LssResponse::Identified)?,
                    _ => is_silent(t, step.frame())?,
                }
            }
            confirm(t, lss.identity, part)?;
        }
        answers(t, LssRequest::InquireNode, LssResponse::InquiredNode(None))
    })
    .requires(FASTSCAN)
    .needs(NODE_ID),
    lss("305/6.7/2", "fastscan: each part is answered in its turn, and 80h begins anew", |t| {
        let lss = lose_node_id(t)?;
        let step = |part| {
            let value = lss.identity.part(part);
            LssRequest::Fastscan { value, bits_left: 1, part, next: part }
        };
        answers(t, RESTART, LssResponse::Identified)?;
        is_silent(t, step(Part::Product).frame())?;
        confirm(t, lss.identity, Part::Vendor)?;
        is_silent(t, step(Part::Vendor).frame())?;
        answers(t, step(Part::Product), LssResponse::Identified)?;
        answers(t, RESTART, LssResponse::Identified)?;
        is_silent(t, step(Part::Product).frame())?;
        answers(t, step(Part::Vendor), LssResponse::Identified)
    })
    .requires(FASTSCAN)
    .needs(NODE_ID),
    lss("305/6.7/3", "fastscan: a device with node-ID is silent", |t| {
        begin(t)?;
        is_silent(t, RESTART.frame())
    })
    .requires(FASTSCAN),
];

/// Begins a fastscan anew.
const RESTART: LssRequest = LssRequest::Fastscan { value: 0, bits_left: 0x80, part: Part::Vendor, next: Part::Vendor };

/// Puts all devices into LSS waiting. The device under test is addressed by its 1018h.
fn begin(t: &mut Tester<'_>) -> Outcome<Addressed> {
    let mut identity = Identity::default();
    for part in Part::ALL {
        let sub = part.number() + 1;
        if t.entry(0x1018, sub).is_ok() {
            identity = identity.with(part, t.read(0x1018, sub)? as u32);
        }
    }
    let device = Addressed { identity, node: t.node };
    t.lss.device = Some(device);
    switch(t, LssState::Waiting)?;
    Ok(device)
}

/// Removes the node-ID of the device, if no other device is without one.
fn lose_node_id(t: &mut Tester<'_>) -> Outcome<Addressed> {
    let lss = begin(t)?;
    if ask(t, LssRequest::IdentifyUnconfigured.frame())?.is_some() {
        return Err(not_applicable("a device without node-ID answers before this one has lost its own"));
    }
    select(t)?;
    configure_node(t, None)?;
    switch(t, LssState::Waiting)?;
    t.nmt(NmtCommand::ResetCommunication)?;
    t.hear(PATIENCE)?;
    Ok(lss)
}

fn free_node(t: &mut Tester<'_>) -> Outcome<NodeId> {
    let own = t.node;
    for node in (1..=127).rev().filter_map(NodeId::new).filter(|&node| node != own) {
        if !t.is_of_others(CobId::of_node(0x700, node)) && !is_there(t, node)? {
            return Ok(node);
        }
    }
    Err(not_applicable("no node-ID is free"))
}

/// Whether a node answers SDO requests.
fn is_there(t: &mut Tester<'_>, node: NodeId) -> Outcome<bool> {
    t.send(CobId::of_node(0x600, node), &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0])?;
    Ok(t.next(CobId::of_node(0x580, node), PATIENCE)?.is_some())
}

/// The index of the bit rate of the bus.
fn own_rate(t: &Tester<'_>) -> Outcome<u8> {
    let rate = t.settings.bit_rate_kbit.ok_or_else(|| {
        not_applicable("the bit rate of the bus is not given, and a device cannot be asked which one it has")
    })?;
    let index = (0..).zip(BIT_TIMING_TABLE).find(|(_, known)| *known == Some(rate)).map(|(index, _)| index);
    index.ok_or_else(|| not_applicable(format!("CiA 305 has no bit rate of {rate} kbit/s")))
}

/// Whether the data sheet lists the bit rate of an index.
fn supports(t: &Tester<'_>, index: u8) -> bool {
    let rate = BIT_TIMING_TABLE.get(usize::from(index)).copied().flatten();
    rate.is_some_and(|rate| t.sheet.device.info.bit_rates_kbit.contains(&rate))
}

fn switch(t: &mut Tester<'_>, state: LssState) -> Outcome {
    is_silent(t, LssRequest::SwitchGlobal(state).frame())
}

/// Selects the device by its identity.
fn select(t: &mut Tester<'_>) -> Outcome {
    let Some(Addressed { identity, .. }) = t.lss.device else { return Err(failed("no device was addressed")) };
    for part in [Part::Vendor, Part::Product, Part::Revision] {
        is_silent(t, LssRequest::SwitchSelective(part, identity.part(part)).frame())?;
    }
    answers(t, LssRequest::SwitchSelective(Part::Serial, identity.serial), LssResponse::Selected)
}

fn configure_node(t: &mut Tester<'_>, node: Option<NodeId>) -> Outcome {
    t.lss.node = Some(node);
    answers(t, LssRequest::ConfigureNode(node), LssResponse::ConfigureNode { error: 0, specific: 0 })
}

fn configure_bit_timing(t: &mut Tester<'_>, index: u8, error: u8) -> Outcome {
    t.lss.bit_rate = true;
    let request = LssRequest::ConfigureBitTiming { table: 0, index };
    answers(t, request, LssResponse::ConfigureBitTiming { error, specific: 0 })
}

/// Asks whether there is a device with a serial number from `low` to `serial_high`, and the same major revision number.
fn identify(t: &mut Tester<'_>, low: Identity, serial_high: u32) -> Outcome<Option<Frame>> {
    for (bound, value) in [
        (Bound::Vendor, low.vendor),
        (Bound::Product, low.product),
        (Bound::RevisionLow, low.revision),
        (Bound::RevisionHigh, low.revision | 0xFFFF),
        (Bound::SerialLow, low.serial),
    ] {
        is_silent(t, LssRequest::Identify(bound, value).frame())?;
    }
    ask(t, LssRequest::Identify(Bound::SerialHigh, serial_high).frame())
}

/// Confirms the whole number of a part, after which the scan goes on with the next part.
fn confirm(t: &mut Tester<'_>, identity: Identity, part: Part) -> Outcome {
    let step = LssRequest::Fastscan { value: identity.part(part), bits_left: 0, part, next: part.next() };
    answers(t, step, LssResponse::Identified)
}

fn answers(t: &mut Tester<'_>, request: LssRequest, response: LssResponse) -> Outcome {
    is_answered(t, request.frame(), response)
}

fn is_answered(t: &mut Tester<'_>, request: Frame, response: LssResponse) -> Outcome {
    let (answer, expected) = (ask(t, request)?, response.frame());
    ensure(answer == Some(expected), || {
        format!("{request} is answered by {}, and should be by {expected}", text(answer))
    })
}

fn is_silent(t: &mut Tester<'_>, request: Frame) -> Outcome {
    let answer = ask(t, request)?;
    ensure(answer.is_none(), || format!("{request} is answered by {}, and should not be", text(answer)))
}

/// Sends a request; returns the response, if one comes in time.
fn ask(t: &mut Tester<'_>, request: Frame) -> Outcome<Option<Frame>> {
    ask_within(t, request, PATIENCE)
}

fn ask_within(t: &mut Tester<'_>, request: Frame, patience: Duration) -> Outcome<Option<Frame>> {
    t.send(request.id(), request.data())?;
    t.next(lss::RESPONSE, patience)
}

fn text(answer: Option<Frame>) -> String {
    answer.map_or_else(|| "nothing".to_owned(), |frame| frame.to_string())
}

/// Gives the device what it had before the case; returns a sentence if that failed.
pub(crate) fn put_back(t: &mut Tester<'_>) -> Option<String> {
    let changes = t.lss;
    let device = changes.device?;
    let Err(verdict) = give_back(t, device, changes) else {
        t.lss = Changes::default();
        return None;
    };
    let why = verdict.reason();
    let what = match changes {
        Changes { node: Some(_), .. } => format!("node-ID {} could not be put back", device.node),
        Changes { bit_rate: true, .. } => "the bit rate could not be put back".to_owned(),
        _ => "the device could not be left in LSS waiting".to_owned(),
    };
    Some(format!("{what}: {why}"))
}

fn give_back(t: &mut Tester<'_>, device: Addressed, changes: Changes) -> Outcome {
    switch(t, LssState::Waiting)?;
    if changes.node.is_none() && !changes.bit_rate {
        return Ok(());
    }
    select(t)?;
    if changes.bit_rate {
        let index = own_rate(t)?;
        configure_bit_timing(t, index, 0)?;
    }
    if changes.node.is_some() {
        let own = LssRequest::ConfigureNode(Some(device.node));
        answers(t, own, LssResponse::ConfigureNode { error: 0, specific: 0 })?;
    }
    // A device without node-ID boots with its new one at once; one with a node-ID takes the new one at a reset.
    switch(t, LssState::Waiting)?;
    if let Some(other) = changes.node.flatten() {
        t.nmt_to(NmtCommand::ResetCommunication, other.get())?;
    }
    t.hear(PATIENCE)?;
    if !is_there(t, device.node)? {
        // Some devices take a new node-ID only by a reset of their own communication.
        t.nmt(NmtCommand::ResetCommunication)?;
    }
    let end = t.now() + t.settings.boot;
    while !is_there(t, device.node)? {
        ensure(t.now() < end, || format!("node {} does not answer", device.node))?;
    }
    Ok(())
}
