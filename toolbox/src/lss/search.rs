//! The search for devices without node-ID, bit by bit (LSS fastscan, CiA 305).

use lexican_runtime::host::Link;
use lexican_runtime::service::lss_manager::{Event, LssError, LssManager};
use lexican_runtime::wire::lss::{Identity, LssRequest, LssResponse, Part};

use super::session::{Session, response};
use super::trouble::Trouble;

/// The steps of a fastscan: one for any device, then 32 bits and a confirmation for each of four numbers.
pub const SCAN_STEPS: u64 = 1 + 4 * 33;

/// A bit number with a special meaning: all devices without node-ID restart the search and respond (CiA 305).
const RESTART: u8 = 0x80;

impl<L: Link> Session<L> {
    /// Finds and selects the next device without node-ID. Devices that were found before do not respond.
    pub fn fastscan(&mut self) -> Result<Option<Identity>, Trouble> {
        match self.operate(self.times.response, LssManager::fastscan)? {
            Event::Found(identity) => Ok(Some(identity)),
            Event::Failed(LssError::NoAnswer) => Ok(None),
            Event::Failed(error) => Err(self.lost_answer(error)),
            other => Err(Trouble::Unexpected(other)),
        }
    }

    /// Finds all devices without node-ID. `found` is called for each and returns whether to go on; `repeated` is called
    /// for the first one that keeps responding after it was found.
    pub fn find_all<E: From<Trouble>>(
        &mut self,
        mut found: impl FnMut(Identity) -> Result<bool, E>,
        repeated: impl FnOnce(Identity),
    ) -> Result<Vec<Identity>, E> {
        let (mut known, mut repeated) = (Vec::new(), Some(repeated));
        while let Some(identity) = if repeated.is_some() { self.fastscan()? } else { self.fastscan_beside(&known)? } {
            let is_new = !known.contains(&identity);
            if is_new {
                known.push(identity);
                if !found(identity)? {
                    break;
                }
            }
            if (!is_new || self.is_anything_confirmed()?)
                && let Some(repeated) = repeated.take()
            {
                repeated(identity);
            }
        }
        Ok(known)
    }

    /// Finds and selects the next device without node-ID, when some of the `known` ones respond to every search.
    ///
    /// An unknown identity differs from each known one in some bit. So this probes each branch that leaves a known
    /// identity and leads to no known one. It leaves known devices unselected meanwhile: some confirm anything once
    /// they are selected.
    pub fn fastscan_beside(&mut self, known: &[Identity]) -> Result<Option<Identity>, Trouble> {
        self.deselect()?;
        self.is_fenced = self.has_unconfigured()?;
        for identity in known {
            for part in Part::ALL {
                if !self.begin_search(*identity, part)? {
                    return Ok(None);
                }
                for bit in (0..32).rev() {
                    // The other bit, with zeros below.
                    let value = (identity.part(part) ^ 1 << bit) >> bit << bit;
                    let branch = identity.with(part, value);
                    if !known.iter().any(|known| leads_to(branch, part, bit, *known))
                        && self.probe(branch, part, bit)?
                    {
                        return self.search_on(branch, part, bit).map(Some);
                    }
                }
            }
        }
        Ok(None)
    }

    /// Whether a selected device confirms any number, as CANopenNode does. After a restart, devices in search respond
    /// to the first number only, so a response to another one is such a device's.
    fn is_anything_confirmed(&mut self) -> Result<bool, Trouble> {
        Ok(self.probe(Identity::default(), Part::Vendor, RESTART)?
            && self.probe(Identity::default(), Part::Serial, 31)?)
    }

    /// Restarts the search and confirms the numbers before `part`; returns whether any device responds.
    fn begin_search(&mut self, identity: Identity, part: Part) -> Result<bool, Trouble> {
        let before = Part::ALL.into_iter().filter(|before| before.number() < part.number());
        let mut is_there = self.probe(identity, Part::Vendor, RESTART)?;
        for before in before {
            is_there = is_there && self.confirm(identity, before)?;
        }
        Ok(is_there)
    }

    /// Continues from a branch that leads to no known device.
    fn search_on(&mut self, mut found: Identity, mut part: Part, mut bit: u8) -> Result<Identity, Trouble> {
        loop {
            while bit > 0 {
                bit -= 1;
                if !self.probe(found, part, bit)? {
                    found = found.with(part, found.part(part) | 1 << bit);
                }
            }
            if !self.confirm(found, part)? {
                return Err(self.lost_answer(LssError::ScanFailed { part, value: found.part(part) }));
            }
            if part == Part::Serial {
                return self.read_back(found);
            }
            (part, bit) = (part.next(), 32);
            found = found.with(part, 0);
        }
    }

    /// Reads the identity of the device found: a late response may have counted for another step.
    fn read_back(&mut self, found: Identity) -> Result<Identity, Trouble> {
        for part in Part::ALL {
            let value = found.part(part);
            self.send(&LssRequest::Inquire(part).frame())?;
            let until = self.link.now() + self.times.response;
            if !self.wait_for(until, |frame| response(frame) == Some(LssResponse::Inquired(part, value)))? {
                return Err(self.lost_answer(LssError::ScanFailed { part, value }));
            }
        }
        Ok(found)
    }

    /// Whether a device has these bits of a number, from bit `bits_left` on.
    fn probe(&mut self, identity: Identity, part: Part, bits_left: u8) -> Result<bool, Trouble> {
        self.is_identified(LssRequest::Fastscan { value: identity.part(part), bits_left, part, next: part })
    }

    /// Whether a device has the whole number, and so goes on to the next.
    fn confirm(&mut self, identity: Identity, part: Part) -> Result<bool, Trouble> {
        let (value, next) = (identity.part(part), part.next());
        self.is_identified(LssRequest::Fastscan { value, bits_left: 0, part, next })
    }

    /// Whether any device responds to the step in time, or before the devices respond to the request that follows it.
    fn is_identified(&mut self, step: LssRequest) -> Result<bool, Trouble> {
        self.send(&step.frame())?;
        let until = self.link.now() + self.times.step;
        let mut answered = false;
        self.wait_for(until, |frame| {
            answered |= response(frame) == Some(LssResponse::Identified);
            false
        })?;
        if answered || !self.is_fenced {
            return Ok(answered);
        }
        self.send(&LssRequest::IdentifyUnconfigured.frame())?;
        let until = self.link.now() + self.times.response;
        let is_over = self.wait_for(until, |frame| {
            answered |= response(frame) == Some(LssResponse::Identified);
            response(frame) == Some(LssResponse::Unconfigured)
        })?;
        if is_over { Ok(answered) } else { Err(self.lost_answer(LssError::NoAnswer)) }
    }

    fn lost_answer(&self, error: LssError) -> Trouble {
        Trouble::LostAnswer { error, times: self.times }
    }
}

/// Whether the device `known` responds to a probe of `branch`, `part` and `bit`.
fn leads_to(branch: Identity, part: Part, bit: u8, known: Identity) -> bool {
    let before = Part::ALL.into_iter().filter(|before| before.number() < part.number());
    before.into_iter().all(|before| branch.part(before) == known.part(before))
        && branch.part(part) >> bit == known.part(part) >> bit
}
