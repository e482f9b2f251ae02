//! The cases that are more than a line or two.

use lexican_runtime::AbortCode;
use lexican_runtime::object::{Access, Address, ObjectDictionary};
use lexican_runtime::wire::nmt::NmtState;

use crate::STATES;
use crate::dut::{Dut, le};
use crate::sheet;

pub fn read_back(dut: &mut Dut) {
    for (index, sub, data) in [
        (0x1006, 0, &[0x10, 0x27, 0, 0][..]),
        (0x1007, 0, &[1, 0, 0, 0]),
        (0x1015, 0, &[100, 0]),
        (0x1017, 0, &[0xE8, 3]),
        (0x1400, 2, &[254]),
        (0x1800, 2, &[1]),
        (0x1800, 5, &[50, 0]),
    ] {
        dut.write(index, sub, data).unwrap();
        assert_eq!(dut.upload(index, sub).as_deref(), Ok(data));
    }
}

pub fn read_all(dut: &mut Dut) {
    for entry in dut.entries(|entry| entry.access != Access::Wo) {
        let (index, sub) = (entry.address.index(), entry.address.sub());
        let empty = index == 0x1003 && sub > 0;
        let expected = if empty { Err(AbortCode::NO_DATA) } else { Ok(()) };
        assert_eq!(dut.read(index, sub).map(|_| ()), expected, "{}", entry.address);
    }
}

pub fn compare_defaults(dut: &mut Dut) {
    let device = sheet::device();
    for entry in dut.entries(|entry| entry.access != Access::Wo && entry.data_type.size().is_some()) {
        let (index, sub) = (entry.address.index(), entry.address.sub());
        // 1003h is empty, and 1010h and 1011h tell what they can do.
        if !matches!(index, 0x1003 | 0x1010 | 0x1011) {
            let default = sheet::default(&device, entry.address);
            assert_eq!(dut.upload(index, sub).map(|bytes| le(&bytes)), Ok(default), "{}", entry.address);
        }
    }
}

pub fn write_read_only(dut: &mut Dut) {
    for entry in dut.entries(|entry| matches!(entry.access, Access::Ro | Access::Const)) {
        let data = &[0; 4][..entry.data_type.size().unwrap_or(4).min(4)];
        assert_eq!(dut.write(entry.address.index(), entry.address.sub(), data), Err(AbortCode::READ_ONLY));
    }
}

pub fn write_back(dut: &mut Dut) {
    for entry in dut.entries(|entry| entry.access == Access::Rw) {
        let (index, sub) = (entry.address.index(), entry.address.sub());
        // 1010h and 1011h want a signature.
        if !matches!(index, 0x1010 | 0x1011) && entry.data_type.size().is_some_and(|size| size <= 4) {
            let bytes = dut.upload(index, sub).unwrap();
            assert_eq!(dut.write(index, sub, &bytes), Ok(()), "{}", entry.address);
        }
    }
}

pub fn mapped_exists(dut: &mut Dut) {
    for index in [0x1600, 0x1601, 0x1602, 0x1A00, 0x1A02] {
        for sub in 1..=dut.read(index, 0).unwrap() as u8 {
            let mapped = dut.read(index, sub).unwrap();
            let entry = dut.od.entry(Address::new((mapped >> 16) as u16, (mapped >> 8) as u8)).unwrap();
            assert_eq!(entry.data_type.bits(), Some(mapped as u8));
        }
    }
}

/// TPDO 1 with a transmission type, in a state; what it sends when entering it is not of interest.
pub fn tpdo(dut: &mut Dut, transmission: u8, state: NmtState) -> bool {
    dut.write(0x1800, 2, &[transmission]).unwrap();
    dut.enter(state);
    dut.take_sent();
    state == NmtState::Operational
}

pub fn remote(dut: &mut Dut, state: NmtState) {
    let sends = tpdo(dut, 253, state);
    assert_eq!(dut.send("185#R2").len(), usize::from(sends));
}

pub fn event(dut: &mut Dut, state: NmtState) {
    for transmission in [254, 255] {
        dut.enter(NmtState::PreOperational);
        let sends = tpdo(dut, transmission, state);
        dut.device.changed(Address::new(0x6041, 0));
        dut.pull();
        assert_eq!(dut.take_sent().len(), usize::from(sends));
    }
}

pub fn timer(dut: &mut Dut, state: NmtState) {
    dut.write(0x1800, 5, &[100, 0]).unwrap();
    let sends = tpdo(dut, 254, state);
    assert_eq!(dut.pass_ms(1000).len(), if sends { 10 } else { 0 });
}

pub fn cyclic(dut: &mut Dut, state: NmtState) {
    let sends = tpdo(dut, 3, state);
    let sent: usize = (0..9).map(|_| dut.send("080#").len()).sum();
    assert_eq!(sent, if sends { 3 } else { 0 });
}

pub fn acyclic(dut: &mut Dut, state: NmtState) {
    let sends = tpdo(dut, 0, state);
    let sent: Vec<usize> = (0..3)
        .map(|_| {
            dut.device.changed(Address::new(0x6041, 0));
            dut.send("080#").len()
        })
        .collect();
    assert_eq!(sent, [usize::from(sends); 3]);
    assert_eq!(dut.send("080#").len(), 0, "without an event, nothing is sent");
}

pub fn sync_start(dut: &mut Dut, state: NmtState) {
    dut.write_u32(0x1800, 1, 0x8000_0185).unwrap();
    dut.write(0x1800, 6, &[5]).unwrap();
    dut.write_u32(0x1800, 1, 0x185).unwrap();
    dut.write(0x1019, 0, &[10]).unwrap();
    let sends = tpdo(dut, 1, state);
    let sent: Vec<usize> = (1..=6).map(|counter| dut.send(&format!("080#{counter:02X}")).len()).collect();
    assert_eq!(sent, if sends { [0, 0, 0, 0, 1, 1] } else { [0; 6] });
}

pub fn transitions(dut: &mut Dut, command: u8, target: NmtState) {
    for state in STATES {
        for node in [5, 0] {
            dut.enter(state);
            dut.send(&format!("000#{command:02X}{node:02X}"));
            assert_eq!(dut.device.nmt_state(), target);
        }
        dut.enter(state);
        dut.send(&format!("000#{command:02X}06"));
        assert_eq!(dut.device.nmt_state(), state, "another node is meant");
    }
}
