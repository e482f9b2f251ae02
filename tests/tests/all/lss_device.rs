//! An LSS device at a reset communication (CiA 305): what was configured takes effect, and the configuration state
//! ends.

use lexican_runtime::service::lss_device::{LssDevice, LssHost, StoreError};
use lexican_runtime::wire::lss::{Identity, LssState};
use lexican_runtime::{CobId, Frame, Instant, NodeId};

struct Host;

impl LssHost for Host {
    fn configure_bit_timing(&mut self, _table: u8, _index: u8) -> bool {
        false
    }
    fn store(&mut self, _node: Option<NodeId>) -> Result<(), StoreError> {
        Err(StoreError::NotSupported)
    }
}

/// Sends a request, filled up to eight bytes, and returns the answer, if any.
fn ask(device: &mut LssDevice, request: &[u8]) -> Option<Vec<u8>> {
    let mut data = [0; 8];
    data[..request.len()].copy_from_slice(request);
    let frame = Frame::new(CobId::standard(0x7E5).unwrap(), &data).unwrap();
    device.handle_frame(Instant::ZERO, &frame, &mut Host);
    device.poll_transmit(Instant::ZERO).map(|frame| frame.data().to_vec())
}

const CONFIGURE: [u8; 2] = [0x04, 1];
const INQUIRE_NODE: [u8; 1] = [0x5E];

#[test]
fn a_reset_ends_configuring_and_brings_the_node_id_into_effect() {
    let node = NodeId::literal(5);
    let mut device = LssDevice::new(Identity { vendor: 1, product: 2, revision: 3, serial: 4 }, None);
    assert_eq!(ask(&mut device, &CONFIGURE), None);
    assert_eq!(ask(&mut device, &[0x11, 5]), Some(vec![0x11, 0, 0, 0, 0, 0, 0, 0]));
    assert_eq!(ask(&mut device, &INQUIRE_NODE), Some(vec![0x5E, 0xFF, 0, 0, 0, 0, 0, 0]), "not active yet");
    assert_eq!(device.reset(), Some(node));
    assert_eq!(device.state(), LssState::Waiting);
    assert_eq!(ask(&mut device, &INQUIRE_NODE), None, "it has not been selected again");
    assert_eq!(ask(&mut device, &CONFIGURE), None);
    assert_eq!(ask(&mut device, &INQUIRE_NODE), Some(vec![0x5E, 5, 0, 0, 0, 0, 0, 0]));
}

#[test]
fn an_answer_that_was_not_sent_is_not_sent_after_a_reset() {
    let mut device = LssDevice::new(Identity { vendor: 1, product: 2, revision: 3, serial: 4 }, None);
    ask(&mut device, &CONFIGURE);
    let inquiry = Frame::new(CobId::standard(0x7E5).unwrap(), &[0x5E, 0, 0, 0, 0, 0, 0, 0]).unwrap();
    device.handle_frame(Instant::ZERO, &inquiry, &mut Host);
    device.reset();
    assert_eq!(device.poll_transmit(Instant::ZERO), None);
}
