#!/usr/bin/env python3
"""Logs that lexican and other software exchange.

usage: logs.py LEXICAN written|read|bus FOLDER RESULTS

`written`: others read what lexican writes; `read`: lexican reads what others write; `bus`: what canplayer sends to vcan0 is
recorded, and what is replayed there, candump records. A line per format and program goes into RESULTS, as in run.py.
"""

import datetime
import os
import random
import signal
import subprocess
import sys
import time

import can

import verdicts

# Dates in ASC are local time.
os.environ["TZ"] = "UTC"
time.tzset()

START = 1_506_783_973_191_123
FRAMES = 500


def frames():
    """Frames as tuples: time in microseconds, channel from 0, identifier, extended, remote, length, data, received."""
    chance = random.Random(301)
    at, found = START, []
    for _ in range(FRAMES):
        at += chance.choice([47, 1_000, 123_456, 2_000_001])
        extended, remote = chance.random() < 0.2, chance.random() < 0.1
        number = chance.randrange(1 << 29 if extended else 1 << 11)
        length = chance.randrange(9)
        data = b"" if remote else chance.randbytes(length)
        found.append((at, chance.randrange(2), number, extended, remote, length, data, chance.random() < 0.7))
    return found


def candump(frame):
    at, channel, number, extended, remote, length, data, received = frame
    number = f"{number:08X}" if extended else f"{number:03X}"
    content = f"R{length}" if remote else data.hex().upper()
    return f"({at // 1_000_000:010}.{at % 1_000_000:06}) can{channel} {number}#{content} {'R' if received else 'T'}\n"


def parsed(line):
    """A line of candump -L, which may have no direction."""
    stamp, interface, content, *direction = line.split()
    number, _, data = content.partition("#")
    remote = data.startswith("R")
    data, length = (b"", int(data[1:] or 0)) if remote else (bytes.fromhex(data), len(data) // 2)
    at = round(float(stamp[1:-1]) * 1_000_000)
    channel = int(interface[3:]) if interface[3:].isdigit() else 0
    return (at, channel, int(number, 16), len(number) == 8, remote, length, data, direction != ["T"])


def message(frame):
    at, channel, number, extended, remote, length, data, received = frame
    return can.Message(timestamp=at / 1_000_000, channel=channel, arbitration_id=number, is_extended_id=extended,
                       is_remote_frame=remote, dlc=length, data=data, is_rx=received)


def of_message(each, first_channel=0):
    channel = int(str(each.channel).removeprefix("can")) - first_channel
    return (round(each.timestamp * 1_000_000), channel, each.arbitration_id, each.is_extended_id, each.is_remote_frame,
            each.dlc, bytes(each.data), each.is_rx)


def compare(found, expected, unit=1, start=START, channels=True, directions=True, lengths=True):
    """The same frames; times may differ by a unit, and what is switched off is not compared."""
    verdicts.same(len(found), len(expected))

    def kept(frame):
        _, channel, number, extended, remote, length, data, received = frame
        length = length if lengths or not remote else None
        return channels and channel, number, extended, remote, length, data, directions and received

    for ours, theirs in zip(found, expected):
        verdicts.same(kept(ours), kept(theirs))
        # Times in floating point are a microsecond off.
        if abs(ours[0] - (theirs[0] - START + start)) > max(unit, 2):
            raise AssertionError(f"{ours[0]} us instead of {theirs[0]}")


class Exchange:
    def __init__(self, lexican, folder):
        self.lexican, self.folder, self.frames = lexican, folder, frames()
        self.base = self.path("base.log")
        with open(self.base, "w", encoding="ascii") as file:
            file.writelines(map(candump, self.frames))

    def path(self, name):
        return os.path.join(self.folder, name)

    def ours(self, name, kind=None):
        """A log that lexican writes."""
        path = self.path(name)
        subprocess.run([self.lexican, "convert", "--force", self.base, path, *(["--to", kind] if kind else [])], check=True,
                       stdout=subprocess.DEVNULL)
        return path

    def theirs(self, path):
        """The frames that lexican reads, with their directions."""
        lines = subprocess.run([self.lexican, "convert", path, "-", "--to", "asc"], stdout=subprocess.PIPE, check=True)
        asc = self.path("back.asc")
        with open(asc, "wb") as file:
            file.write(lines.stdout)
        return [of_message(each) for each in can.ASCReader(asc, relative_timestamp=False)]

    def exact(self, path):
        """The frames that lexican reads, with their exact times."""
        lines = subprocess.run([self.lexican, "convert", path, "-", "--to", "candump"], stdout=subprocess.PIPE, check=True)
        return list(map(parsed, lines.stdout.decode("ascii").splitlines()))

    def python_reads(self, name, reader, kind=None, first_channel=0, **lost):
        path = self.ours(name, kind)
        compare([of_message(each, first_channel) for each in reader(path)], self.frames, **lost)

    def python_writes(self, name, writer, version=None, remote=True, **lost):
        path = self.path(name)
        written = [frame for frame in self.frames if remote or not frame[4]]
        with writer(path) as log:
            if version:
                log.file_version = version
            for each in map(message, written):
                log.on_message_received(each)
        compare(self.theirs(path), written, **lost)

    def tshark_reads(self, name):
        path = self.ours(name)
        fields = ["frame.time_epoch", "can.id", "can.flags.xtd", "can.flags.rtr", "can.len", "data.data"]
        fields += ["frame.interface_name"] if name.endswith("pcapng") else []
        line = ["tshark", "-r", path, "-T", "fields", "-E", "separator=/t", *(word for field in fields for word in ("-e", field))]
        found = []
        for text in subprocess.run(line, stdout=subprocess.PIPE, check=True, text=True).stdout.splitlines():
            at, number, extended, remote, length, data, *name_of = text.split("\t")
            flag = {"True": True, "False": False, "1": True, "0": False}
            channel = int(name_of[0].removeprefix("can")) if name_of else 0
            found.append((round(float(at) * 1_000_000), channel, int(number, 0), flag[extended], flag[remote], int(length),
                          b"" if flag[remote] else bytes.fromhex(data.replace(":", "")), True))
        compare(found, self.frames, channels=name.endswith("pcapng"), directions=False)

    def text2pcap_writes(self, name, kind):
        """A capture that is made of the bytes of the packets in hexadecimal."""
        dump, path = self.path(f"{name}.txt"), self.path(name)
        with open(dump, "w", encoding="ascii") as file:
            for at, _, number, extended, remote, length, data, _ in self.frames:
                stamp = datetime.datetime.fromtimestamp(at // 1_000_000, datetime.timezone.utc)
                number |= extended << 31 | remote << 30
                packet = number.to_bytes(4, "big") + bytes([length, 0, 0, 0]) + data
                file.write(f"{stamp:%Y-%m-%dT%H:%M:%S}.{at % 1_000_000:06}000Z\n000000 {packet.hex(' ')}\n")
        subprocess.run(["text2pcap", "-q", "-F", kind, "-l", "227", "-t", "ISO", dump, path], check=True)
        compare(self.exact(path), self.frames, channels=False, directions=False)

    def editcap_writes(self, name, kind):
        path = self.path(name)
        subprocess.run(["editcap", "-F", kind, self.ours("ours.pcapng"), path], check=True)
        compare(self.exact(path), self.frames, channels=kind == "pcapng", directions=False)

    def asc2log_reads(self):
        path, log = self.ours("ours.asc"), self.path("asc2log.log")
        subprocess.run(["asc2log", "-I", path, "-O", log], check=True)
        with open(log, encoding="ascii") as file:
            found = list(map(parsed, file))
        # It needs a German or an American locale to read the date, and takes the present time without.
        compare(found, self.frames, start=found[0][0] - self.frames[0][0] + START, directions=False, lengths=False)

    def log2asc_writes(self):
        path = self.path("log2asc.asc")
        subprocess.run(["log2asc", "-I", self.base, "-O", path, "can0", "can1"], check=True)
        found = self.theirs(path)
        # It dates the log by the day on which it runs, or to the second.
        compare(found, self.frames, start=found[0][0] - self.frames[0][0] + START, lengths=False, directions=False)

    def written(self):
        yield "candump: python-can", lambda: self.python_reads("ours.log", can.CanutilsLogReader, directions=False)
        yield "asc: python-can", lambda: self.python_reads(
            "ours.asc", lambda path: can.ASCReader(path, relative_timestamp=False))
        yield "asc: can-utils", self.asc2log_reads
        yield "trc 1.0: python-can", lambda: self.python_reads(
            "trc10.trc", can.TRCReader, "trc1.0", 1, unit=1000, start=START - self.frames[0][0], channels=False, directions=False)
        yield "trc 1.1: python-can", lambda: self.python_reads("trc11.trc", can.TRCReader, "trc1.1", 1, unit=100, channels=False)
        yield "trc 1.3: python-can", lambda: self.python_reads("trc13.trc", can.TRCReader, "trc1.3", 1)
        yield "trc 2.0: python-can", lambda: self.python_reads("trc20.trc", can.TRCReader, "trc2.0", 1, channels=False)
        yield "trc 2.1: python-can", lambda: self.python_reads("trc21.trc", can.TRCReader, "trc", 1)
        yield "blf: python-can", lambda: self.python_reads("ours.blf", can.BLFReader)
        yield "pcap: tshark", lambda: self.tshark_reads("ours.pcap")
        yield "pcapng: tshark", lambda: self.tshark_reads("ours.pcapng")

    def read(self):
        # Its writer of ASC has dates, and so all times, to the millisecond; that of TRC leaves remote frames out.
        version = can.io.trc.TRCFileVersion
        yield "candump: python-can", lambda: self.python_writes("python.log", can.CanutilsLogWriter, lengths=False)
        yield "asc: python-can", lambda: self.python_writes("python.asc", can.ASCWriter, unit=1000)
        yield "asc: can-utils", self.log2asc_writes
        yield "trc 1.0: python-can", lambda: self.python_writes(
            "python10.trc", can.TRCWriter, version.V1_0, False, unit=1000, start=START - self.frames[0][0], channels=False,
            directions=False)
        yield "trc 2.1: python-can", lambda: self.python_writes("python21.trc", can.TRCWriter, remote=False)
        yield "blf: python-can", lambda: self.python_writes("python.blf", can.BLFWriter)
        yield "pcap: tshark", lambda: self.text2pcap_writes("text.pcap", "pcap")
        yield "pcap, nanoseconds: tshark", lambda: self.text2pcap_writes("text-nano.pcap", "nsecpcap")
        yield "pcapng: tshark", lambda: self.text2pcap_writes("text.pcapng", "pcapng")
        yield "pcap, nanoseconds, converted: tshark", lambda: self.editcap_writes("nano.pcap", "nsecpcap")
        yield "pcapng, converted: tshark", lambda: self.editcap_writes("again.pcapng", "pcapng")

    def bus(self):
        yield "canplayer, and record", self.canplayer
        yield "replay, and candump", self.replay

    def on_the_bus(self, recorder, sender):
        """What one program records, to its standard output, while another one sends."""
        log = self.path(f"{os.path.basename(recorder[0])}.log")
        with open(log, "wb") as out, subprocess.Popen(recorder, stdout=out, stderr=subprocess.DEVNULL) as recording:
            time.sleep(0.5)  # until it listens
            subprocess.run(sender, check=True, stdout=subprocess.DEVNULL)
            time.sleep(0.5)  # until it has written
            recording.send_signal(signal.SIGTERM)
        with open(log, encoding="ascii") as file:
            found = [parsed(line) for line in file]
        # When a frame is heard is a matter of the machine.
        still = [[(START, *frame[1:]) for frame in each] for each in (found, self.frames)]
        compare(*still, channels=False, directions=False)

    def canplayer(self):
        self.on_the_bus([self.lexican, "record", "--bus", "vcan0", "-o", "-", "--to", "candump"],
                        ["canplayer", "-t", "-I", self.base, "vcan0=can0", "vcan0=can1"])

    def replay(self):
        replay = [self.lexican, "replay", self.ours("ours.blf"), "--bus", "vcan0", "--speed", "500"]
        self.on_the_bus(["candump", "-L", "vcan0"], replay)


def main():
    lexican, direction, folder, results = sys.argv[1:5]
    os.makedirs(folder, exist_ok=True)
    verdicts.write_into(results)
    for what, try_it in getattr(Exchange(lexican, folder), direction)():
        verdicts.report(what, try_it)
    sys.exit(1 if verdicts.FAILED else 0)


if __name__ == "__main__":
    main()
