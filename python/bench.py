"""Figures of README.md: lexican beside python-canopen, or beside canopen-asyncio in an environment that has that one.

``python -P bench.py [FOLDER]``, with lexican in a release build, canopen or canopen-asyncio, python-can and pyserial. A figure is the
processor time of this process. Round trips are reads of 1000h by SDO over a pseudo-terminal (slcan), at whose other end a child answers.
FOLDER has the data sheets that are loaded.
"""

from __future__ import annotations

import asyncio
import logging
import os
import sys
import time
import tty
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lexican

try:
    import canopen
except ImportError:
    import canopen_asyncio as canopen

    sys.modules["canopen"] = canopen  # It looks for itself under that name.

SECONDS = 3.0
ROUNDS = 3


def adapter() -> tuple[str, int]:
    """A pseudo-terminal with an slcan adapter and a device that answers to each request; its name and the child."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    name = os.ttyname(theirs)
    child = os.fork()
    if child:
        os.close(ours)
        return name, child
    rest = b""
    while True:
        *lines, rest = (rest + os.read(ours, 4096)).split(b"\r")
        for line in lines:
            os.write(ours, b"t58584300100092010000\r" if line.startswith(b"t605") else b"\r")


def rate(read: Callable[[], object]) -> float:
    """Round trips per second of the processor, the best of some rounds."""
    best = 0.0
    for _ in range(ROUNDS):
        count, begun, until = 0, time.process_time(), time.monotonic() + SECONDS
        while time.monotonic() < until:
            read()
            count += 1
        best = max(best, count / (time.process_time() - begun))
    return best


def round_trips() -> tuple[float, float]:
    name, child = adapter()
    with lexican.Network(f"slcan:{name}?bitrate=500000") as network:
        ours = rate(lambda: network.read_bytes(5, 0x1000))
    os.kill(child, 9)
    name, child = adapter()
    network: Any = canopen.Network()
    network.connect(interface="slcan", channel=name, bitrate=500000)
    sdo = network.add_node(5).sdo
    if hasattr(sdo, "aupload"):
        loop = asyncio.new_event_loop()
        network.loop = loop
        theirs = rate(lambda: loop.run_until_complete(sdo.aupload(0x1000, 0)))
    else:
        theirs = rate(lambda: sdo.upload(0x1000, 0))
    network.disconnect()
    os.kill(child, 9)
    return ours, theirs


def loading(folder: Path) -> tuple[int, float, float]:
    """How many data sheets both read, and in how many seconds."""
    count, ours, theirs = 0, 0.0, 0.0
    for path in sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".eds", ".dcf")):
        begun = time.process_time()
        try:
            canopen.import_od(str(path))
            between = time.process_time()
            lexican.load(path)
        except Exception:
            continue  # One of them does not read it.
        ours, theirs, count = ours + time.process_time() - between, theirs + between - begun, count + 1
    return count, ours, theirs


if __name__ == "__main__":
    logging.disable()
    mine, other = round_trips()
    print(f"round trips per second of the processor: {mine:,.0f} to {other:,.0f}: {mine / other:.1f} times")
    sheets, mine, other = loading(Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "eds"))
    print(f"loading {sheets} data sheets: {mine:.2f} s to {other:.2f} s: {other / mine:.1f} times")
