"""Figures of README.md: lexican beside python-canopen, or beside canopen-asyncio in an environment that has that one.

``python -P bench.py [FOLDER]``, with lexican in a release build, canopen or canopen-asyncio, python-can and pyserial. A figure is the
processor time of this process. Round trips are reads of 1000h by SDO over a pseudo-terminal (slcan), at whose other end a child answers.
Frames are those of a PDO of two entries, in one buffer and one by one. Memory is what the process has after 10^6 transfers with a simulated
device, beside what it had after the first 10^4. FOLDER has the data sheets that are loaded.
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


def decoding(count: int = 1_000_000) -> tuple[float, float, float]:
    """Frames per second that are decoded: ours in one buffer and as a list of bytes, and theirs."""
    sheet = Path(__file__).parents[1] / "eds/devices/siko/ag03-1/SIKOAG03.EDS"
    noise = os.urandom(8 * count)
    frames = [noise[at : at + 6] for at in range(0, len(noise), 8)]
    (pdo,) = (pdo for pdo in lexican.load(sheet).pdos(5) if pdo.name == "TPDO3")
    theirs: Any = canopen.Network().add_node(5, str(sheet)).tpdo[3]
    theirs.read(from_od=True)

    def one_by_one() -> list[list[int]]:
        columns: list[list[int]] = [[] for _ in theirs.map]
        for frame in frames:
            theirs.on_message(theirs.cob_id, frame, 0.0)
            for column, variable in zip(columns, theirs.map):
                column.append(variable.raw)
        return columns

    spent: list[float] = []
    for decode in (lambda: pdo.decode(noise), lambda: pdo.decode(frames), one_by_one):
        best = float("inf")
        for _ in range(ROUNDS):
            begun = time.process_time()
            decoded = decode()
            best = min(best, time.process_time() - begun)
            if decode is one_by_one:
                break
        spent.append(count / best)
    assert [column.tolist() for column in pdo.decode(frames).values()] == decoded
    return spent[0], spent[1], spent[2]


def memory(transfers: int = 1_000_000, first: int = 10_000) -> tuple[int, int]:
    """Kilobytes that the process has after the first transfers, and after all."""
    with lexican.simulate("siko/ag03-1") as network:
        for at in range(transfers):
            network.read_bytes(1, 0x1018, 1)
            if at == first:
                before = kilobytes()
        return before, kilobytes()


def kilobytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024


if __name__ == "__main__":
    logging.disable()
    if canopen.__name__ == "canopen":  # That of canopen-asyncio is the same code.
        buffer, listed, other = decoding()
        print(f"frames decoded per second: {buffer:,.0f} and {listed:,.0f} to {other:,.0f}: {buffer / other:.0f} and {listed / other:.0f} times")
    before, after = memory()
    print(f"memory after 10^4 transfers {before:,} kB, after 10^6 {after:,} kB")
    mine, other = round_trips()
    print(f"round trips per second of the processor: {mine:,.0f} to {other:,.0f}: {mine / other:.1f} times")
    sheets, mine, other = loading(Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[1] / "eds"))
    print(f"loading {sheets} data sheets: {mine:.2f} s to {other:.2f} s: {other / mine:.1f} times")
