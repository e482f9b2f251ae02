//! Whatever is changed is restored, in devices made of data sheets.

use std::ops::ControlFlow;

use lexican_eds::model::Device;
use lexican_eds::{Input, Source};
use lexican_runtime::host::blocking::Network;
use lexican_runtime::host::{Link, VirtualBus, VirtualLink};
use lexican_runtime::{Duration, NodeId};
use lexican_toolbox::node::remote::RemoteNode;
use lexican_toolbox::parameters::backup::backup;
use lexican_toolbox::parameters::compare::{Side, compare};
use lexican_toolbox::parameters::restore::{Options, Outcome, configured, restore};
use lexican_toolbox::parameters::{Ended, Parameters, Progress};
use lexican_toolbox::values::address;
use lexican_toolbox::values::wire::written;

use crate::device::samples;
use lexican_simulation::VirtualDevice;
use lexican_toolbox::data_sheet::DataSheet;

const NODE: NodeId = NodeId::literal(5);

fn go_on(_: Progress<'_>) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// A network with a device that has booted.
fn network(device: &Device) -> Network<VirtualLink> {
    let bus = VirtualBus::with_bit_rate(500);
    bus.attach(VirtualDevice::power_on(bus.now(), NODE, device));
    let mut link = bus.link();
    let until = link.now() + Duration::from_secs(1);
    while link.receive(until).unwrap().is_some() {}
    Network::new(link)
}

/// Changes one bit of each parameter that takes the new value; returns how many do.
fn change(node: &mut RemoteNode<'_, VirtualLink>, device: &Device) -> usize {
    let parameters = Parameters::of_sheet(device, NODE);
    let changed = parameters.entries().filter(|entry| {
        let Ok(mut data) = node.read(address(entry)).unwrap() else { return false };
        data.iter_mut().take(1).for_each(|byte| *byte ^= 1);
        node.write(address(entry), &written(Some(device), data)).unwrap().is_ok()
    });
    changed.count()
}

#[test]
fn what_is_changed_is_restored_however_often_that_is_interrupted() {
    let library = ["siko/ag03-1", "siko/ag02", "kollmorgen/akd"];
    let library = library.map(|name| DataSheet::load(name, &[]).unwrap().device);
    for device in library.into_iter().chain([samples::sensor()]) {
        let name = device.info.product_name.clone().unwrap_or_default();
        let mut network = network(&device);
        let mut node = RemoteNode::new(&mut network, NODE);
        let kept = backup(&mut node, &device, false, &mut go_on).unwrap();
        assert_eq!(kept.left_out, [], "{name}");
        let dcf = lexican_eds::load(&Input::new(Source::new("kept.dcf", kept.dcf()))).0;
        let settings = configured(&dcf, NODE);
        assert_eq!(settings.len(), kept.kept, "{name}");
        for interrupted_at in [None, Some(1), Some(2), Some(4)] {
            let changed = change(&mut node, &device);
            assert!(changed > 3, "{name}: {changed}");
            if let Some(at) = interrupted_at {
                let mut stop = |progress: Progress<'_>| match progress {
                    Progress::Writing { at: now, .. } if now == at => ControlFlow::Break(()),
                    _ => ControlFlow::Continue(()),
                };
                let mut outcome = Outcome::default();
                let ended = restore(&mut node, &device, &settings, Options::default(), &mut stop, &mut outcome);
                assert!(matches!(ended, Err(Ended::Stopped)), "{name}");
                assert!(outcome.written.len() < at, "{name}: {outcome:?}");
            }
            let mut outcome = Outcome::default();
            restore(&mut node, &device, &settings, Options::default(), &mut go_on, &mut outcome).unwrap();
            assert!(outcome.refused.is_empty() && outcome.switched_off.is_empty(), "{name}: {outcome:?}");
            let now = Side::of_node(&mut node, device.clone(), &mut go_on).unwrap();
            assert_eq!(compare(&now, &Side::of_sheet(dcf.clone(), NODE)).differences, [], "{name}");
        }
    }
}
