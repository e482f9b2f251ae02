//! python-canopen on either side, doing what ours does.

use std::process::Command;

use super::player::NODE;
use super::wire::Wire;

/// Reads 1000h for a second, and prints the same line as ours: round trips, seconds, seconds of the processor.
const CLIENT: &str = "
import sys, time
import canopen
network = canopen.Network()
network.connect(**eval(sys.argv[1]))
sdo = network.add_node(int(sys.argv[2]), canopen.ObjectDictionary()).sdo
for _ in range(200):
    sdo.upload(0x1000, 0)
print('warm', flush=True)
trips, start, used = 0, time.perf_counter(), time.process_time()
while trips % 16 or time.perf_counter() - start < 1:
    sdo.upload(0x1000, 0)
    trips += 1
print(trips, time.perf_counter() - start, time.process_time() - used, flush=True)
network.disconnect()
";

/// A device with 1000h, 1001h and 1017h.
const DEVICE: &str = "
import sys
import canopen
from canopen.objectdictionary import ObjectDictionary, ODVariable, UNSIGNED8, UNSIGNED16, UNSIGNED32
od = ObjectDictionary()
for index, name, data_type, default in (
    (0x1000, 'Device type', UNSIGNED32, 0x20192),
    (0x1001, 'Error register', UNSIGNED8, 0),
    (0x1017, 'Producer heartbeat time', UNSIGNED16, 0),
):
    variable = ODVariable(name, index)
    variable.data_type, variable.default = data_type, default
    od.add_object(variable)
network = canopen.Network()
network.connect(**eval(sys.argv[1]))
network.create_node(int(sys.argv[2]), od)
print('ready', flush=True)
sys.stdin.read()
network.disconnect()
";

pub(super) fn client(python: &str, wire: &Wire) -> Command {
    script(python, CLIENT, &wire.far)
}

pub(super) fn device(python: &str, wire: &Wire) -> Command {
    script(python, DEVICE, &wire.near)
}

fn script(python: &str, script: &str, url: &str) -> Command {
    let bus = match url.split_once(':') {
        Some(("slcan", port)) => {
            format!("dict(interface='slcan', channel={port:?}, bitrate=500000, sleep_after_open=0)")
        }
        Some((_, interface)) => format!("dict(interface='socketcan', channel={interface:?})"),
        None => url.to_owned(),
    };
    let mut command = Command::new(python);
    command.args(["-c", script, &bus, &NODE.to_string()]);
    command
}
