"""python-canopen's device, for lexican's manager to try every service on."""

import os
import struct

HERE = os.path.dirname(os.path.abspath(__file__))
EDS = os.path.join(HERE, "peer.eds")

# What its device lacks, so that lexican's manager cannot succeed. That lexican's side is right is shown by
# lexican's own device, and where its manager has the service, by that.
MISSING = {
    "LSS": "its device has no LSS",
    "node guarding": "its device does not answer remote frames",
    "SDO read block": "its server has no block transfer; lexican's client goes on in segments",
    "SDO write block": "its server has no block transfer; lexican's client goes on in segments",
}


class Device:
    def __init__(self, network, node):
        self.network = network
        self.node = network.create_node(node, EDS)
        self.node.add_write_callback(self.on_write)
        self.node.sdo[0x1017].raw = 0
        network.subscribe(0x200 + node, self.on_rpdo)
        network.subscribe(0x080, self.on_sync)
        network.subscribe(0x100, self.on_time)
        network.subscribe(0x000, self.on_nmt)
        self.actual = bytes(4)
        self.node.nmt.send_command(0x82)
        self.node.nmt.send_command(0x80)

    def on_rpdo(self, _, data, __):
        """python-canopen moves no PDO by itself: this is what its users write."""
        self.actual = bytes(data)
        self.network.send_message(0x180 + self.node.id, self.actual)

    def on_sync(self, *_):
        if self.node.nmt.state == "OPERATIONAL":
            self.network.send_message(0x280 + self.node.id, self.actual)

    def on_time(self, _, data, __):
        """Nor does it consume TIME."""
        self.node.set_data(0x2007, 0, bytes(data))

    def on_nmt(self, _, data, __):
        """Nor does it come back from a reset: it stays in INITIALISING, with heartbeats that say so."""
        if data[0] in (0x81, 0x82) and data[1] in (0, self.node.id):
            self.node.nmt.send_command(0x82)
            self.node.nmt.send_command(0x80)

    def on_write(self, index, subindex, od, data):
        if index == 0x2004:
            code = struct.unpack("<H", data)[0]
            register = 1 if code else 0
            self.node.emcy.send(code, register, bytes([1, 2, 3, 4, 5]))
