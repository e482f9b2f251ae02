//! Encoded messages decode to the same values, and any bytes decode without a panic.

use lexican_runtime::AbortCode;
use lexican_runtime::object::Address;
use lexican_runtime::wire::sdo::{
    Abort, BlockEnd, ClientRequest, Confirmation, Content, Expedited, Segment, ServerResponse,
};
use lexican_runtime::wire::sdo_block::BlockSegment;
use proptest::prelude::*;

fn address() -> impl Strategy<Value = Address> {
    any::<(u16, u8)>().prop_map(|(index, sub)| Address::new(index, sub))
}

fn content() -> impl Strategy<Value = Content> {
    let some = |data: &[u8]| Expedited::new(data).expect("one to four bytes");
    prop_oneof![
        prop::collection::vec(any::<u8>(), 1..=4).prop_map(move |data| Content::Expedited(some(&data))),
        any::<[u8; 4]>().prop_map(|data| Content::Expedited(Expedited::of_unknown_len(data))),
        any::<Option<u32>>().prop_map(|size| Content::Segmented { size }),
    ]
}

fn segment() -> impl Strategy<Value = Segment> {
    (any::<bool>(), prop::collection::vec(any::<u8>(), 0..=7), any::<bool>())
        .prop_map(|(toggle, data, last)| Segment::new(toggle, &data, last).expect("at most seven bytes"))
}

fn abort() -> impl Strategy<Value = Abort> {
    (address(), any::<u32>()).prop_map(|(address, code)| Abort { address, code: AbortCode(code) })
}

fn confirmation() -> impl Strategy<Value = Confirmation> {
    any::<(u8, u8)>().prop_map(|(sequence, block_size)| Confirmation { sequence, block_size })
}

fn block_end() -> impl Strategy<Value = BlockEnd> {
    (0..=7_u8, any::<u16>()).prop_map(|(unused, crc)| BlockEnd::new(unused, crc).expect("at most seven"))
}

fn request() -> impl Strategy<Value = ClientRequest> {
    use ClientRequest as R;
    prop_oneof![
        segment().prop_map(R::DownloadSegment),
        (address(), content()).prop_map(|(address, content)| R::InitiateDownload { address, content }),
        address().prop_map(|address| R::InitiateUpload { address }),
        any::<bool>().prop_map(|toggle| R::UploadSegment { toggle }),
        abort().prop_map(R::Abort),
        (address(), any::<(bool, u8, u8)>()).prop_map(|(address, (crc, block_size, switch_threshold))| {
            R::InitiateBlockUpload { address, crc, block_size, switch_threshold }
        }),
        Just(R::StartBlockUpload),
        confirmation().prop_map(R::ConfirmBlockUpload),
        Just(R::EndBlockUpload),
        (address(), any::<(bool, Option<u32>)>()).prop_map(|(address, (crc, size))| R::InitiateBlockDownload {
            address,
            crc,
            size
        }),
        block_end().prop_map(R::EndBlockDownload),
    ]
}

fn response() -> impl Strategy<Value = ServerResponse> {
    use ServerResponse as R;
    prop_oneof![
        segment().prop_map(R::UploadSegment),
        any::<bool>().prop_map(|toggle| R::DownloadSegment { toggle }),
        (address(), content()).prop_map(|(address, content)| R::InitiateUpload { address, content }),
        address().prop_map(|address| R::InitiateDownload { address }),
        abort().prop_map(R::Abort),
        (address(), any::<(bool, u8)>()).prop_map(|(address, (crc, block_size))| R::InitiateBlockDownload {
            address,
            crc,
            block_size
        }),
        confirmation().prop_map(R::ConfirmBlockDownload),
        Just(R::EndBlockDownload),
        (address(), any::<(bool, Option<u32>)>()).prop_map(|(address, (crc, size))| R::InitiateBlockUpload {
            address,
            crc,
            size
        }),
        block_end().prop_map(R::EndBlockUpload),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(5_000))]

    #[test]
    fn a_request_is_parsed_as_what_it_was(request in request()) {
        prop_assert_eq!(ClientRequest::parse(&request.to_bytes()), Some(request));
    }

    #[test]
    fn a_response_is_parsed_as_what_it_was(response in response()) {
        prop_assert_eq!(ServerResponse::parse(&response.to_bytes()), Some(response));
    }

    #[test]
    fn a_block_segment_is_parsed_as_what_it_was(sequence in 1..=127_u8, data: [u8; 7], last: bool) {
        let segment = BlockSegment::new(sequence, data, last).expect("1 to 127");
        prop_assert_eq!(BlockSegment::parse(&segment.to_bytes()), Some(segment));
    }

    #[test]
    fn what_is_parsed_means_the_same_when_it_is_emitted_again(bytes: [u8; 8]) {
        if let Some(request) = ClientRequest::parse(&bytes) {
            prop_assert_eq!(ClientRequest::parse(&request.to_bytes()), Some(request));
        }
        if let Some(response) = ServerResponse::parse(&bytes) {
            prop_assert_eq!(ServerResponse::parse(&response.to_bytes()), Some(response));
        }
        if let Some(segment) = BlockSegment::parse(&bytes) {
            prop_assert_eq!(segment.to_bytes(), bytes);
        }
    }

    #[test]
    fn other_than_eight_bytes_mean_nothing(bytes in prop::collection::vec(any::<u8>(), 0..=16)) {
        prop_assume!(bytes.len() != 8);
        prop_assert_eq!(ClientRequest::parse(&bytes), None);
        prop_assert_eq!(ServerResponse::parse(&bytes), None);
        prop_assert_eq!(BlockSegment::parse(&bytes), None);
    }
}

#[test]
fn commands_that_the_standard_does_not_know_mean_nothing() {
    for command in 0..=255_u8 {
        let bytes = [command, 0, 0x10, 0, 1, 2, 3, 4];
        assert_eq!(ClientRequest::parse(&bytes).is_none(), command >> 5 == 7, "{command:02X}");
        let is_unknown = command >> 5 == 7 || command & 0xE3 == 0xA3;
        assert_eq!(ServerResponse::parse(&bytes).is_none(), is_unknown, "{command:02X}");
    }
}

#[test]
fn values_that_do_not_fit_cannot_be_made() {
    assert_eq!(Expedited::new(&[]), None);
    assert_eq!(Expedited::new(&[0; 5]), None);
    assert_eq!(Segment::new(false, &[0; 8], false), None);
    assert_eq!(BlockEnd::new(8, 0), None);
    assert_eq!(BlockSegment::new(0, [0; 7], true), None);
    assert_eq!(BlockSegment::new(128, [0; 7], true), None);
}
