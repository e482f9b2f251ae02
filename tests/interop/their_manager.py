"""python-canopen's manager, which tries every service of lexican's device."""

import os
import struct
import threading
import time

from canopen.sdo.exceptions import SdoAbortedError

from verdicts import eventually, same, report

HERE = os.path.dirname(os.path.abspath(__file__))
EDS = os.path.join(HERE, "peer.eds")
LSS_IDENTITY = (0x4C58, 0x7, 0x10002, 0x12345678)


def pattern(length):
    return bytes((at * 7 + length) & 0xFF for at in range(length))


class Manager:
    def __init__(self, network, node):
        self.network = network
        self.node = network.add_node(node, EDS)
        self.node.sdo.RESPONSE_TIMEOUT = 2.0

    def run(self):
        report("LSS", self.lss)
        report("boot-up", self.boot_up)
        report("heartbeat", self.heartbeat)
        report("node guarding", self.guarding)
        report("NMT", self.nmt)
        report("SDO read expedited", self.read_expedited)
        report("SDO write expedited", self.write_expedited)
        report("SDO read segmented", self.read_segmented)
        report("SDO write segmented", self.write_segmented)
        report("SDO read block", self.read_block)
        report("SDO write block", self.write_block)
        report("SDO aborts", self.aborts)
        report("PDO", self.pdo)
        report("SYNC", self.sync)
        report("TIME", self.time)
        report("EMCY", self.emcy)
        report("SDO reads per second", self.speed)

    def lss(self):
        """The device begins without node-ID: it is found by fast scan, and boots with what it is given."""
        lss = self.network.lss
        lss.RESPONSE_TIMEOUT = 0.2
        found, identity = lss.fast_scan()
        same((found, tuple(identity or ())), (True, LSS_IDENTITY))
        lss.configure_node_id(self.node.id)
        lss.store_configuration()
        same(lss.inquire_node_id(), 255)  # until it is active (CiA 305)
        booted = threading.Event()
        self.network.subscribe(0x700 + self.node.id, lambda *_: booted.set())
        lss.send_switch_state_global(lss.WAITING_STATE)
        eventually("boot-up message after LSS", booted.is_set)
        lss.send_switch_state_selective(*LSS_IDENTITY)
        for command, part in zip((0x5A, 0x5B, 0x5C, 0x5D), LSS_IDENTITY):
            same(lss.inquire_lss_address(command), part)
        same(lss.inquire_node_id(), self.node.id)
        lss.send_switch_state_global(lss.WAITING_STATE)
        self.network.subscribe(0x700 + self.node.id, self.node.nmt.on_heartbeat)
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
        self.network.subscribe(0x700 + self.node.id, lambda _, data, __: answers.append(data[0]))
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

    def time(self):
        """What was sent is what the device has understood, and a device that does not consume it hears nothing."""
        self.node.sdo["COB-ID TIME"].raw = 0x80000100
        for days, ms in ((0, 0), (15300, 86399875)):
            expected = struct.pack("<LH", ms, days)
            self.network.time.transmit(441763200 + days * 86400 + ms / 1000)
            eventually("time", lambda: self.node.sdo.upload(0x2007, 0) == expected)
        self.node.sdo["COB-ID TIME"].raw = 0x00000100
        self.network.time.transmit(441763200)
        same(self.node.sdo.upload(0x2007, 0), expected)

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
