#!/usr/bin/env python3
"""The simulated AG02 behind its serial port, driven by pyserial alone: figures 4 and 6 of the manual, step by step.

usage: serial_port.py PROGRAM

PROGRAM is the example `simulate` of lexican-siko-serial, which prints the path of its pseudo-terminal. Nothing of
lexican's is on this side: telegrams are those of table 3, patterns those of the figures.
"""

import subprocess
import sys
import time

import serial

from verdicts import eventually, same


class Port:
    """A drive at a serial port: 9600 baud, no parity, eight data bits, one stop bit, no handshake."""

    def __init__(self, path):
        self.line = serial.Serial(path, 9600, timeout=1)

    def ask(self, telegram, end=b"\r"):
        self.line.write(telegram.encode())
        answer = self.line.read_until(end)
        if not answer.endswith(end):
            raise AssertionError(f"{telegram}: {answer!r}")
        return answer[:-1].decode("latin-1")

    def done(self, telegram):
        same(self.ask(telegram), ">")

    def shows(self, pattern):
        """Waits until the system status word is as a pattern of a flow chart."""
        bits = pattern.replace(" ", "")

        def is_so():
            word = f"{int(self.ask('R').rstrip('>'), 16):016b}"
            return all(bit in ("x", is_) for bit, is_ in zip(bits, word, strict=True))

        eventually(pattern, is_so, 30)

    def position(self):
        return int(self.ask("Z").rstrip(">"))

    def inch(self, character, seconds):
        """Characters with less than 100 ms between them."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self.line.write(character)
            time.sleep(0.03)


def figure_4(drive):
    drive.shows("000x 0000 x000 x000")
    drive.done("F0+0003000")
    drive.done("M")
    drive.shows("x1xx 10x0 0001 0000")
    same(drive.ask("M"), "?04")
    for stop in "NO":
        drive.done(stop)
        drive.shows("x10x 00x0 0000 0000")
        drive.done("M")
        drive.shows("x1xx 10x0 0001 0000")
    drive.shows("000x 0000 0000 1000")
    same(drive.position(), 3000)
    drive.line.write(b"W")
    same(drive.line.read(5), (3000).to_bytes(4, "big", signed=True) + b">")
    drive.done("F0+0000000")
    drive.done("M")
    drive.shows("x1xx 10x0 0001 0000")
    drive.done("I")
    drive.shows("000x 0000 0000 x000")
    drive.done("Y")
    drive.shows("x0xx 1000 0001 0000")
    drive.shows("000x 0000 0000 x000")
    for character, sign in ((b",", 1), (b".", -1)):
        before = drive.position()
        drive.inch(character, 1)
        drive.shows("000x 0000 0000 x000")
        if (drive.position() - before) * sign < 100:
            raise AssertionError(f"{character!r} leads from {before} to {drive.position()}")


def figure_6(drive):
    drive.done("X1")
    drive.shows("00xx 0000 x000 x000")
    for stop in ("N", "O", "F0+0000000"):
        drive.done("F0+0000060")
        drive.done("M")
        drive.shows("00xx 1000 0001 x000")
        eventually("60 rev/min", lambda: drive.ask("V") == "+060>")
        drive.done("F0-0000040")
        eventually("-40 rev/min", lambda: drive.ask("V") == "-040>")
        drive.done(stop)
        drive.shows("00xx 0000 x000 x000")
    same(drive.ask("Y"), "?04")
    drive.done("X0")


def parameters(drive):
    for telegram, answer in (("G00", "00250>"), ("E1", "+1000000>"), ("Q", "00>"), ("J0", "00>"), ("J1", "---------->")):
        same(drive.ask(telegram), answer)
    drive.done("h0900020")
    same(drive.ask("g09"), "00020>")
    for refused, number in (("H0901001", "?02"), ("F0+1000001", "?09"), ("G06", "?01")):
        same(drive.ask(refused), number)
    drive.done("S11100")


def main():
    process = subprocess.Popen(sys.argv[1:2], stdout=subprocess.PIPE, text=True)
    try:
        drive = Port(process.stdout.readline().strip())
        for part in (parameters, figure_4, figure_6):
            begin = time.monotonic()
            part(drive)
            print(f"serial port, {part.__name__}: ok, {time.monotonic() - begin:.1f} s")
    finally:
        process.terminate()
        process.wait(3)


if __name__ == "__main__":
    main()
