"""The simulated AKD, driven by python-canopen with the frames of its manual's worked examples (chapter 7.2.1)."""

import csv
import os
import time

from drive import POSITIONING, TARGET_REACHED, Drive, Model, State402
from verdicts import eventually, report, same

SETPOINT_ACKNOWLEDGED = 1 << 12
HOMING_ATTAINED = 1 << 12
HOMING_FINISHED = 1 << 23  # of 1002h
NEGATIVE_LIMIT_SWITCH = 17  # method of homing without index pulse


class Servo(Drive):
    FAULT = ("8611", "fault = 0x8611", "fault = none")
    KEPT = (0x6081, 0)

    def examples(self, simulated):
        # python-canopen takes every PDO that has come twice for one that comes regularly, and waits for it.
        for pdo in range(0x1800, 0x1804):
            self.node.sdo[pdo][5].raw = 50
        report("7.2.1.2, states", lambda: self.play("7.2.1.2"))
        report("7.2.1.3, velocity", lambda: self.play("7.2.1.3"))
        report("7.2.1.4, torque", lambda: self.play("7.2.1.4"))
        report("7.2.1.7, homing", lambda: self.home(simulated))
        report("positions by PDO, and by SYNC", self.positions)

    def play(self, chapter):
        """Sends the requests of a chapter, and compares the responses; the manual's node-ID is another."""
        with open(os.path.join(self.model.tables, "frames.csv"), encoding="utf-8", newline="") as file:
            rows = [row for row in csv.DictReader(file) if row["chapter"] == chapter]
        answers, begin, frames = [], time.monotonic(), 0
        receive = lambda _, data, __: answers.append(bytes(data))
        self.network.subscribe(0x580 + self.id, receive)
        for request, response in zip(rows, rows[1:]):
            if not request["kind"].endswith("request"):
                continue
            expected = bytes.fromhex(response["data"])
            eventually(request["frame"], lambda: same_response(self.ask(request, answers), expected), 10)
            eventually(request["meaning"], self.effect(request["meaning"]))
            frames += 2
        self.network.unsubscribe(0x580 + self.id, receive)
        self.node.sdo[0x6040].raw = 0
        return f"{frames} frames, {time.monotonic() - begin:.1f} s"

    def ask(self, request, answers):
        answers.clear()
        self.network.send_message(0x600 + self.id, bytes.fromhex(request["data"]).ljust(8, b"\0"))
        eventually(f"answer to {request['frame']}", lambda: answers)
        return answers[0]

    def effect(self, meaning):
        """What a frame leads to, beside its response."""
        sdo = self.node.sdo
        return {
            # 606Ch counts 1/1000.
            "velocity setpoint": lambda: sdo[0x606C].raw == sdo[0x60FF].raw * 1000,
            "setpoint 400 mA": lambda: sdo[0x6077].raw == 400 and sdo[0x606C].raw > 0,
            "Intermediate Stop": lambda: sdo[0x606C].raw == 0,
            "intermediate Stop": lambda: sdo[0x606C].raw == 0,
        }.get(meaning, lambda: True)

    def home(self, simulated):
        """The example does not say by which method."""
        here = self.node.sdo[0x6064].raw
        simulated.happen(f"negative_limit = {here - 3000}")
        self.node.sdo[0x6098].raw = NEGATIVE_LIMIT_SWITCH
        remark = self.play("7.2.1.7")
        same(self.node.sdo[0x1002].raw & HOMING_FINISHED, HOMING_FINISHED)
        simulated.happen("negative_limit = none")
        return remark

    def positions(self):
        """Targets by the third receive PDO: at once, and with the next SYNC (6.3.1.1: transmission type 0)."""
        node = self.node
        self.write(0x6060, 0, POSITIONING)
        for by_sync in (False, True):
            node.nmt.state = "PRE-OPERATIONAL"
            node.sdo[0x1402][2].raw = 0 if by_sync else 255
            node.nmt.state = "OPERATIONAL"
            node.state = "OPERATION ENABLED"
            here = node.sdo[0x6064].raw
            target = self.order(20_000)
            if by_sync:
                time.sleep(0.2)
                same(node.sdo[0x6064].raw, here)
                self.network.sync.transmit()
            eventually("set-point acknowledged", lambda: self.status() & SETPOINT_ACKNOWLEDGED)
            self.network.send_message(0x200 + self.id, b"\x0F\x00")
            eventually("target reached", lambda: self.status() & TARGET_REACHED, 10)
            same(node.sdo[0x6064].raw, target)
            node.state = "SWITCH ON DISABLED"
        node.nmt.state = "PRE-OPERATIONAL"
        node.sdo[0x1402][2].raw = 255

    def order(self, distance):
        target = self.node.sdo[0x6064].raw + distance
        self.network.send_message(0x400 + self.id, b"\x1F\x00" + target.to_bytes(4, "little", signed=True))
        return target

    def travel(self):
        self.order(100_000)
        eventually("motion", lambda: self.node.sdo[0x606C].raw > 0)

    def store(self):
        self.node.sdo.download(0x1010, 1, b"save")


def same_response(got, expected):
    """A status word has the printed state, and says whether homing is finished; its other bits depend on the device."""
    if expected[:4] != b"\x4B\x41\x60\x00":
        return got == expected
    words = [int.from_bytes(response[4:6], "little") for response in (got, expected)]
    states = [[name for name, (mask, value) in State402.SW_MASK.items() if word & mask == value] for word in words]
    return states[0] == states[1] and not (words[0] ^ words[1]) & HOMING_ATTAINED


MODELS = {"akd": Model(Servo, "kollmorgen/akd", "AKD.EDS", 0x6A, (0x1008, 1, b"M006"))}
