#!/usr/bin/env python3
"""One run of the interoperability tests, with lexican's interop-peer on one side at least.

usage: run.py PEER device|manager|both slcan|vcan RESULTS

`device` tries lexican's device with python-canopen's manager, `manager` the other way round, `both` has no
python-canopen in it. Writes a line per service into the file RESULTS: name, verdict (ok, failed, or fault, which is
one of python-canopen's own), remark, between tabs.
"""

import atexit
import os
import select
import signal
import struct
import subprocess
import sys
import threading
import time
import tty

import canopen
from canopen.sdo.exceptions import SdoAbortedError

HERE = os.path.dirname(os.path.abspath(__file__))
EDS = os.path.join(HERE, "peer.eds")
NODE = 5
LSS_IDENTITY = (0x4C58, 0x7, 0x10002, 0x12345678)


def pattern(length):
    return bytes((at * 7 + length) & 0xFF for at in range(length))


# --- the two links -------------------------------------------------------------------------------------------


def cross(a, b):
    """Two pseudo-terminals back to back: what one end's program writes, the other's reads."""
    while True:
        for readable in select.select([a, b], [], [])[0]:
            os.write(b if readable == a else a, os.read(readable, 4096))


def links(kind):
    """The URL for lexican and the bus for python-canopen."""
    if kind == "vcan":
        return "socketcan:vcan0", {"interface": "socketcan", "channel": "vcan0"}
    masters, names = [], []
    for _ in range(2):
        master, slave = os.openpty()
        tty.setraw(slave)
        masters.append(master)
        names.append(os.ttyname(slave))
    crossing = os.fork()
    if crossing == 0:
        cross(*masters)
    atexit.register(os.kill, crossing, signal.SIGKILL)
    return f"slcan:{names[0]}", {"interface": "slcan", "channel": names[1], "bitrate": 500000, "sleep_after_open": 0}


# --- verdicts ------------------------------------------------------------------------------------------------

FAILED = []
RESULTS = open(sys.argv[4], "w", encoding="utf-8")


def write(service, verdict, remark):
    if verdict == "failed":
        FAILED.append(service)
    print(f"{service:24}{verdict:8}{remark}", flush=True)
    print(service, verdict, remark, sep="\t", file=RESULTS, flush=True)


def tell(service, try_it):
    try:
        verdict, remark = "ok", try_it() or ""
    except Exception as error:  # whatever it is: it goes into the table
        verdict, remark = "failed", f"{type(error).__name__}: {error}".replace("\n", " ")
    write(service, verdict, remark)


def same(got, expected):
    if got != expected:
        raise AssertionError(f"{got!r} instead of {expected!r}")


def eventually(what, condition, seconds=3.0):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"no {what}")
        time.sleep(0.005)


# --- python-canopen's manager, lexican's device ----------------------------------------------------------------


class Manager:
    def __init__(self, network):
        self.network = network
        self.node = network.add_node(NODE, EDS)
        self.node.sdo.RESPONSE_TIMEOUT = 2.0

    def run(self):
        tell("LSS", self.lss)
        tell("boot-up", self.boot_up)
        tell("heartbeat", self.heartbeat)
        tell("node guarding", self.guarding)
        tell("NMT", self.nmt)
        tell("SDO read expedited", self.read_expedited)
        tell("SDO write expedited", self.write_expedited)
        tell("SDO read segmented", self.read_segmented)
        tell("SDO write segmented", self.write_segmented)
        tell("SDO read block", self.read_block)
        tell("SDO write block", self.write_block)
        tell("SDO aborts", self.aborts)
        tell("PDO", self.pdo)
        tell("SYNC", self.sync)
        tell("EMCY", self.emcy)
        tell("SDO reads per second", self.speed)

    def lss(self):
        """The device begins without node-ID: it is found by fast scan, and boots with what it is given."""
        lss = self.network.lss
        lss.RESPONSE_TIMEOUT = 0.2
        found, identity = lss.fast_scan()
        same((found, tuple(identity or ())), (True, LSS_IDENTITY))
        lss.configure_node_id(NODE)
        lss.store_configuration()
        same(lss.inquire_node_id(), 255)  # until it is active (CiA 305)
        booted = threading.Event()
        self.network.subscribe(0x700 + NODE, lambda *_: booted.set())
        lss.send_switch_state_global(lss.WAITING_STATE)
        eventually("boot-up message after LSS", booted.is_set)
        lss.send_switch_state_selective(*LSS_IDENTITY)
        for command, part in zip((0x5A, 0x5B, 0x5C, 0x5D), LSS_IDENTITY):
            same(lss.inquire_lss_address(command), part)
        same(lss.inquire_node_id(), NODE)
        lss.send_switch_state_global(lss.WAITING_STATE)
        self.network.subscribe(0x700 + NODE, self.node.nmt.on_heartbeat)
        return "fast scan, configure, store, inquire, select"

    def boot_up(self):
        waiter = threading.Thread(target=lambda: time.sleep(0.1) or self.node.nmt.send_command(0x81))
        waiter.start()
        self.node.nmt.wait_for_bootup(3)
        waiter.join()

    def heartbeat(self):
        self.node.sdo["Producer heartbeat time"].raw = 100
        stamps = []
        self.node.nmt.add_heartbeat_callback(lambda state: stamps.append(time.monotonic()))
        eventually("10 heartbeats", lambda: len(stamps) >= 10)
        self.node.sdo["Producer heartbeat time"].raw = 0
        gaps = [b - a for a, b in zip(stamps, stamps[1:])]
        return f"100 ms: {min(gaps) * 1000:.0f} to {max(gaps) * 1000:.0f} ms"

    def guarding(self):
        answers = []
        self.network.subscribe(0x700 + NODE, lambda _, data, __: answers.append(data[0]))
        self.node.nmt.start_node_guarding(0.05)
        eventually("6 guarding answers", lambda: len(answers) >= 6)
        self.node.nmt.stop_node_guarding()
        same([answer >> 7 for answer in answers[:6]], [0, 1, 0, 1, 0, 1])

    def nmt(self):
        self.node.sdo["Producer heartbeat time"].raw = 20
        for state in ("OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"):
            self.node.nmt.state = state
            heard = lambda: self.node.nmt.wait_for_heartbeat(1) == state
            eventually(state, heard)
        self.node.sdo["Producer heartbeat time"].raw = 0

    def read_expedited(self):
        same(self.node.sdo["Device type"].raw, 0)
        same(self.node.sdo["Identity object"]["Serial number"].raw, 0x12345678)

    def write_expedited(self):
        for value in (10, 1000):
            self.node.sdo["Limited value"].raw = value
            same(self.node.sdo["Limited value"].raw, value)

    def read_segmented(self):
        same(self.node.sdo["Manufacturer device name"].raw, "lexican interoperability peer")
        same(self.node.sdo["Counter"].raw, 0x0123456789ABCDEF)

    def write_segmented(self):
        for length in (5, 7, 8, 500):
            self.node.sdo.download(0x2005, 0, pattern(length), force_segment=True)
            same(self.node.sdo.upload(0x2005, 0), pattern(length))
        return "5 to 500 bytes"

    def read_block(self):
        for length in (8, 889, 890, 5000):
            self.node.sdo.download(0x2005, 0, pattern(length))
            with self.node.sdo.open(0x2005, 0, "rb", block_transfer=True, buffering=7 * 127) as stream:
                same(stream.read(), pattern(length))
        return "8 to 5000 bytes"

    def write_block(self):
        for length in (8, 889, 890, 5000):
            data = pattern(length)
            with self.node.sdo.open(0x2005, 0, "wb", size=length, block_transfer=True) as stream:
                stream.write(data)
            same(self.node.sdo.upload(0x2005, 0), data)
        return "8 to 5000 bytes"

    def aborts(self):
        sdo = self.node.sdo
        for code, attempt in (
            (0x06020000, lambda: sdo.upload(0x3000, 0)),
            (0x06090011, lambda: sdo.upload(0x1018, 9)),
            (0x06010002, lambda: sdo.download(0x1000, 0, bytes(4))),
            (0x06010001, lambda: sdo.upload(0x2003, 0)),
            (0x06090032, lambda: sdo.download(0x2002, 0, struct.pack("<H", 9))),
            (0x06090031, lambda: sdo.download(0x2002, 0, struct.pack("<H", 1001))),
            (0x06070012, lambda: sdo.download(0x2002, 0, bytes(4))),
            (0x06070013, lambda: sdo.download(0x2002, 0, bytes(1))),
        ):
            try:
                attempt()
            except SdoAbortedError as abort:
                same(f"{abort.code:08X}", f"{code:08X}")
            else:
                raise AssertionError(f"no abort {code:08X}")
        return "8 codes"

    def pdo(self):
        node = self.node
        node.tpdo.read()
        node.rpdo.read()
        node.nmt.state = "OPERATIONAL"
        got = []
        node.tpdo[1].add_callback(lambda pdo: got.append(pdo[0].raw))
        for value in (1, -2, 1000000):
            node.rpdo[1][0].raw = value
            node.rpdo[1].transmit()
            eventually(f"PDO with {value}", lambda: got and got[-1] == value)
        # Another mapping, written the way CiA 301 wants it.
        node.nmt.state = "PRE-OPERATIONAL"
        pdo = node.tpdo[1]
        pdo.clear()
        pdo.add_variable(0x2000, 0)
        pdo.add_variable(0x2001, 0)
        pdo.save()
        node.nmt.state = "OPERATIONAL"
        node.rpdo[1][0].raw = 77
        node.rpdo[1].transmit()
        eventually("PDO with two objects", lambda: (pdo[0].raw, pdo[1].raw) == (77, 77))
        return "both ways, and another mapping"

    def sync(self):
        got = []
        self.node.tpdo[2].add_callback(lambda pdo: got.append(pdo.timestamp))
        self.network.sync.start(0.05)
        eventually("10 synchronous PDOs", lambda: len(got) >= 10)
        self.network.sync.stop()
        return "10 synchronous PDOs"

    def emcy(self):
        self.node.sdo["Raise error"].raw = 0x2310
        eventually("EMCY", lambda: self.node.emcy.active)
        error = self.node.emcy.active[0]
        same((error.code, error.register, error.data), (0x2310, 0x01, bytes([1, 2, 3, 4, 5])))
        same(self.node.sdo[0x1003][1].raw & 0xFFFF, 0x2310)
        self.node.sdo["Raise error"].raw = 0
        eventually("end of the error", lambda: not self.node.emcy.active)

    def speed(self):
        reads = 2000
        begin, used = time.monotonic(), time.process_time()
        for _ in range(reads):
            self.node.sdo.upload(0x1000, 0)
        each = (time.process_time() - used) / reads * 1e6
        return f"{reads / (time.monotonic() - begin):.0f}/s, {each:.0f} us of processor time each"


# --- python-canopen's device, lexican's manager ----------------------------------------------------------------


class Device:
    def __init__(self, network):
        self.network = network
        self.node = network.create_node(NODE, EDS)
        self.node.add_write_callback(self.on_write)
        self.node.sdo[0x1017].raw = 0
        network.subscribe(0x200 + NODE, self.on_rpdo)
        network.subscribe(0x080, self.on_sync)
        network.subscribe(0x000, self.on_nmt)
        self.actual = bytes(4)
        self.node.nmt.send_command(0x82)
        self.node.nmt.send_command(0x80)

    def on_rpdo(self, _, data, __):
        """python-canopen moves no PDO by itself: this is what its users write."""
        self.actual = bytes(data)
        self.network.send_message(0x180 + NODE, self.actual)

    def on_sync(self, *_):
        if self.node.nmt.state == "OPERATIONAL":
            self.network.send_message(0x280 + NODE, self.actual)

    def on_nmt(self, _, data, __):
        """Nor does it come back from a reset: it stays in INITIALISING, with heartbeats that say so."""
        if data[0] in (0x81, 0x82) and data[1] in (0, NODE):
            self.node.nmt.send_command(0x82)
            self.node.nmt.send_command(0x80)

    def on_write(self, index, subindex, od, data):
        if index == 0x2004:
            code = struct.unpack("<H", data)[0]
            register = 1 if code else 0
            self.node.emcy.send(code, register, bytes([1, 2, 3, 4, 5]))


# What its device does not have, whatever lexican's manager tries. That lexican's side is right is shown by
# lexican's own device, and where its manager has the service, by that.
MISSING = {
    "LSS": "its device has no LSS",
    "node guarding": "its device does not answer remote frames",
    "SDO read block": "its server has no block transfer; lexican's client goes on in segments",
    "SDO write block": "its server has no block transfer; lexican's client goes on in segments",
}


def run_peer(peer, url, python_canopen):
    lines = subprocess.run([peer, "manager", url, str(NODE)], stdout=subprocess.PIPE, text=True).stdout
    for line in lines.splitlines():
        service, verdict, remark = line.split("\t")
        if python_canopen and service in MISSING and (verdict == "failed") != service.startswith("SDO"):
            verdict, remark = "fault", MISSING[service]
        write(service, verdict, remark)


class Peer:
    """lexican's device, until the end of the block."""

    def __init__(self, peer, *arguments):
        self.process = subprocess.Popen(
            [peer, "device", *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def __enter__(self):
        same(self.process.stdout.readline(), "ready\n")

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.wait(3)


class Recording:
    """A log of the bus, beside the results: `candump -L`."""

    def __init__(self, path):
        self.process = subprocess.Popen(["candump", "-L", "vcan0"], stdout=open(path, "w", encoding="ascii"))
        time.sleep(0.2)  # until it listens

    def end(self):
        time.sleep(0.2)  # until it has written
        self.process.kill()
        self.process.wait()


def flood(peer, seconds):
    """Frames that concern nobody, as fast as cangen can; meanwhile no answer may be lost."""
    with Peer(peer, "socketcan:vcan0", str(NODE)):
        noise = subprocess.Popen(["cangen", "vcan0", "-g", "0", "-i", "-I", "2A7", "-L", "8"], stderr=subprocess.DEVNULL)
        packets = "/sys/class/net/vcan0/statistics/tx_packets"
        before = int(open(packets, encoding="ascii").read())
        line = subprocess.run([peer, "reads", "socketcan:vcan0", str(NODE), str(seconds)], stdout=subprocess.PIPE, text=True)
        frames = (int(open(packets, encoding="ascii").read()) - before) // seconds
        noise.kill()
        noise.wait()
    service, verdict, remark = line.stdout.strip().split("\t")
    write(service, verdict, f"{remark}, with {frames} frames per second on the bus for {seconds} s")


def main():
    peer, direction, kind = sys.argv[1:4]
    url, bus = links(kind)
    recording = Recording(sys.argv[4].replace(".txt", ".log")) if kind == "vcan" else None
    network = canopen.Network()
    if direction == "device":
        with Peer(peer, url):
            network.connect(**bus)
            Manager(network).run()
    elif direction == "manager":
        network.connect(**bus)
        Device(network)
        run_peer(peer, url, True)
    else:
        far = f"slcan:{bus['channel']}" if kind == "slcan" else url
        with Peer(peer, far):
            run_peer(peer, url, False)
    if recording:
        recording.end()
    network.disconnect()
    if direction == "both" and kind == "vcan":
        flood(peer, 60)
    sys.exit(1 if FAILED else 0)


if __name__ == "__main__":
    main()
