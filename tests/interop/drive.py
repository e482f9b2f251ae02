"""A simulated drive, driven by python-canopen: what all drives have in common, and SIKO's with the frames of their
manuals' worked examples."""

import csv
import os
import subprocess
import threading
import time

from canopen.profiles.p402 import BaseNode402, State402

from verdicts import eventually, same, report

HERE = os.path.dirname(os.path.abspath(__file__))
DEVICES = os.path.join(HERE, "../../eds/devices")
MANUALS = os.path.join(HERE, "../manual")


class Model:
    """In what the drives differ: how they are tried, where their data sheet is, vendor-ID, what 100Ah or 1008h says, and
    how they are written."""

    def __init__(self, tried_as, name, sheet, vendor, text, four_bytes=False, emcy_bit=0):
        self.tried_as, self.name, self.vendor, self.text = tried_as, name, vendor, text
        self.four_bytes, self.emcy_bit = four_bytes, emcy_bit
        self.sheet = os.path.join(DEVICES, name, sheet)
        self.tables = os.path.join(MANUALS, os.path.basename(name))


# Bits of the status word (table 21).
TARGET_REACHED, STANDSTILL, MOVING = 1 << 10, 1 << 12, 1 << 15
POSITIONING, VELOCITY = 1, 2

# The state behind a command, in python-canopen's words and by its masks.
STATES = {
    "Shutdown": "READY TO SWITCH ON",
    "Switch On": "SWITCHED ON",
    "Enable Operation": "OPERATION ENABLED",
    "Disable Operation": "SWITCHED ON",
    "Disable Voltage": "SWITCH ON DISABLED",
}


class Simulation:
    """`lexican simulate MODEL`, until the end of the block."""

    def __init__(self, lexican, model, url, node, *more):
        self.line = [lexican, "simulate", model.name, "--bus", url, "--node", str(node), *more]

    def __enter__(self):
        self.process = subprocess.Popen(self.line, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        return self

    def happen(self, line):
        """Something happens to the drive: a line of its scripts."""
        print(line, file=self.process.stdin, flush=True)
        time.sleep(0.2)  # until it has read that

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(3)


def run(network, model, node, simulation):
    booted = threading.Event()
    network.subscribe(0x700 + node, lambda *_: booted.set())
    with simulation() as simulated:
        eventually("boot-up message", booted.is_set)
        drive = model.tried_as(network, model, node)
        report("identity", drive.identity)
        drive.examples(simulated)
        report("states by its CiA 402 profile", drive.states)
        report("fault, EMCY and fault reset", lambda: drive.fault(simulated))
        report("settings kept by the EEPROM", drive.settings)
        report("heartbeat, guarding", drive.error_control)


class Drive:
    """What all drives have in common; FAULT, KEPT, `examples` and `travel` are their own."""

    def __init__(self, network, model, node):
        self.network, self.model = network, model
        self.node = network.add_node(BaseNode402(node, model.sheet))
        self.node.sdo.RESPONSE_TIMEOUT = 2.0
        self.id = node
        self.status_word = 0
        for base in (0x180, 0x380, 0x480):  # all three begin with it
            network.subscribe(base + node, self.on_status)

    def on_status(self, _, data, __):
        self.status_word = data[0] | data[1] << 8

    def identity(self):
        sdo = self.node.sdo
        same(sdo[0x1000].raw & 0xFFFF, 402)
        index, order, text = self.model.text
        same(sdo.upload(index, 0)[::order], text)
        same(sdo[0x1018][1].raw, self.model.vendor)
        return f"{len(self.node.object_dictionary)} objects of our data sheet"

    def write(self, index, sub, value):
        """A value that fits: with four bytes where the drive takes no others."""
        if self.model.four_bytes:
            self.node.sdo.download(index, sub, value.to_bytes(4, "little"))
        else:
            sdo = self.node.sdo[index]
            (sdo[sub] if sub else sdo).raw = value

    def status(self):
        """What the drive says now, which is also what it has said by itself."""
        word = self.node.sdo[0x6041].raw
        eventually("status word by PDO", lambda: self.status_word == word or self.node.sdo[0x6041].raw != word)
        return word

    def state(self):
        word = self.node.sdo[0x6041].raw
        return next((name for name, (mask, value) in State402.SW_MASK.items() if word & mask == value), None)

    def nmt_state(self):
        """By node guarding: heartbeats are off by default."""
        answer = []
        self.network.subscribe(0x700 + self.id, lambda _, data, __: answer.append(data[0] & 0x7F))
        self.network.send_message(0x700 + self.id, b"", remote=True)
        eventually("guarding answer", lambda: answer)
        self.network.unsubscribe(0x700 + self.id)
        return {4: "STOPPED", 5: "OPERATIONAL", 0x7F: "PRE-OPERATIONAL"}[answer[0]]

    def states(self):
        """python-canopen's own state machine, which knows nothing of this drive."""
        node = self.node
        node.setup_402_state_machine(read_pdos=True)
        # Now, since it reads the status word from the PDOs that come with it.
        node.nmt.state = "OPERATIONAL"
        for state in ("READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED", "SWITCH ON DISABLED"):
            node.state = state
            same(self.state(), state)
        node.nmt.state = "PRE-OPERATIONAL"

    def fault(self, simulated):
        """The drive fails during a travel, says so by EMCY, and is reset."""
        node = self.node
        if self.model.emcy_bit:
            self.write(0x1014, 0, node.sdo[0x1014].raw | self.model.emcy_bit)
        self.write(0x6060, 0, POSITIONING)
        node.nmt.state = "OPERATIONAL"
        node.state = "OPERATION ENABLED"
        self.travel()
        code, cause, end = self.FAULT
        simulated.happen(cause)
        eventually("EMCY", lambda: node.emcy.active, 5)
        same(f"{node.emcy.active[0].code:04X}", code)
        eventually("FAULT", lambda: self.state() == "FAULT")
        same(f"{node.sdo[0x1003][1].raw & 0xFFFF:04X}", code)
        simulated.happen(end)
        node.state = "SWITCH ON DISABLED"
        eventually("end of the error", lambda: not node.emcy.active)
        node.nmt.state = "PRE-OPERATIONAL"

    def settings(self):
        """A parameter outlives the reset of the node."""
        index, sub = self.KEPT
        kept = self.read(index, sub)
        self.write(index, sub, kept + 1)
        self.store()
        booted = threading.Event()
        self.network.subscribe(0x700 + self.id, lambda *_: booted.set())
        self.node.nmt.send_command(0x81)
        eventually("boot-up message", booted.is_set)
        same(self.read(index, sub), kept + 1)
        self.write(index, sub, kept)

    def store(self):
        """By itself, with each write."""

    def read(self, index, sub):
        sdo = self.node.sdo[index]
        return (sdo[sub] if sub else sdo).raw

    def error_control(self):
        heard = []
        self.write(0x1017, 0, 50)
        self.network.subscribe(0x700 + self.id, lambda _, data, __: heard.append(data[0]))
        eventually("5 heartbeats", lambda: heard[-5:] == [0x7F] * 5)
        self.write(0x1017, 0, 0)
        same(self.nmt_state(), "PRE-OPERATIONAL")


class Positioner(Drive):
    """A positioning drive of SIKO's."""

    # Something holds the shaft: fault B of table 2, code 7121h of table 20.
    FAULT = ("7121", 'shaft = "blocked"', 'shaft = "free"')
    KEPT = (0x2410, 5)

    def examples(self, _):
        report("table 25, positioning", lambda: self.play("example_position.csv", POSITIONING))
        report("table 26, velocity", lambda: self.play("example_velocity.csv", VELOCITY))

    def travel(self):
        here = self.node.sdo[0x6064].raw
        self.network.send_message(0x400 + self.id, b"\x1F\x00" + (here + 3000).to_bytes(4, "little", signed=True))
        eventually("motion", lambda: self.status() & MOVING)

    def play(self, table, mode):
        """Sends the table's frames, and checks after each that the drive has obeyed."""
        self.write(0x6060, 0, mode)
        with open(os.path.join(self.model.tables, table), encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        begin, frames = time.monotonic(), 0
        for row in rows:
            if row["kind"] != "wait":
                data = bytes.fromhex(row["data"])
                self.network.send_message(int(row["cob_id"], 16), data)
                frames += 1
            self.follow(row, mode)
        return f"{frames} frames, {time.monotonic() - begin:.1f} s"

    def follow(self, row, mode):
        meaning = row["meaning"]
        if row["kind"] == "NMT":
            eventually(meaning, lambda: meaning.endswith(self.nmt_state()))
        elif meaning in STATES:
            eventually(STATES[meaning], lambda: self.state() == STATES[meaning])
        elif row["kind"] == "RPDO3":
            self.target = int.from_bytes(bytes.fromhex(row["data"])[2:], "little", signed=True)
            eventually("motion", lambda: self.status() & MOVING)
            # Long enough to be stopped under way.
            time.sleep(1)
        elif row["kind"] == "RPDO4":
            self.target = int.from_bytes(bytes.fromhex(row["data"])[2:], "little", signed=True)
            eventually("motion", lambda: not self.status() & STANDSTILL)
            if "change" in meaning:  # the table does not say how long it runs so
                self.reach_velocity()
        elif meaning == "target position reached":
            eventually(meaning, lambda: self.status() & TARGET_REACHED and not self.status() & MOVING, 30)
            near(self.node.sdo[0x6064].raw, self.target, self.node.sdo[0x6067].raw)
        elif meaning == "target speed reached":
            self.reach_velocity()
        elif meaning == "intermediate stop":
            eventually("standstill", lambda: not self.status() & MOVING)
            here = self.node.sdo[0x6064].raw
            time.sleep(0.3)
            # It stands, but for the last increments in which it settles.
            near(self.node.sdo[0x6064].raw, here, self.node.sdo[0x6067].raw)
            same(self.status() & TARGET_REACHED, 0)
        elif meaning == "stop":
            eventually("standstill", lambda: self.status() & STANDSTILL, 10)

    def reach_velocity(self):
        eventually(f"{self.target} rev/min", lambda: self.status() & TARGET_REACHED, 10)
        near(self.node.sdo[0x606C].raw, self.target, self.node.sdo[0x6067].raw)


def near(got, expected, window):
    if abs(got - expected) > window:
        raise AssertionError(f"{got} instead of {expected}, +-{window}")


MODELS = {
    # Four characters in a number: the first in the lowest byte.
    "ag03-1": Model(Positioner, "siko/ag03-1", "SIKOAG03.EDS", 0x195, (0x1008, 1, b"AG03")),
    # In the highest; 23h is its only command that writes (table 18), and EMCY waits for bit 30 of 1014h.
    "ag02": Model(Positioner, "siko/ag02", "SIKOAG02.EDS", 0x195, (0x100A, -1, b"2.00"), True, 1 << 30),
}
