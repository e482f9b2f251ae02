"""No drive is left moving unsaid, however a program goes on or ends."""

from __future__ import annotations

import asyncio
import gc
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator

import lexican
import pytest
from lexican import aio
from lexican._native import Frames

FAR = 100_000


def velocity(bus: Frames) -> int:
    """What the drive says of its velocity to another program."""
    while bus.receive(0.0):
        pass  # What the drive has answered to others.
    bus.send(0x601, False, bytes.fromhex("40 6c 60 00 00 00 00 00"))
    while True:
        received = bus.receive(2.0)
        assert received, "the drive does not answer"
        if received[1] == 0x581 and received[5][1:4] == b"\x6c\x60\x00":
            return int.from_bytes(received[5][4:8], "little", signed=True)


@pytest.fixture
def real() -> Iterator[lexican.Machine]:
    """A simulated drive whose time is that of the wall."""
    with lexican.simulate("siko/ag03-1", pace="real") as network:
        yield network


@pytest.fixture
def bus(real: lexican.Machine) -> Frames:
    """Another program's view of the bus of the drive."""
    return real.frames()


def moving(network: lexican.Machine, bus: Frames) -> lexican.Drive:
    """A drive under way."""
    drive = network.node(1).drive()
    drive.enable()
    drive.start_moving_to(FAR)
    while velocity(bus) == 0:
        network.sleep(0.05)
    return drive


def test_an_exception_ends_the_travel(real: lexican.Machine, bus: Frames) -> None:
    with pytest.raises(RuntimeError, match="mine"), real:
        drive = moving(real, bus)
        assert drive.state() == "OPERATION ENABLED"
        raise RuntimeError("mine")
    assert velocity(bus) == 0


def test_the_end_of_a_drive_ends_its_travel(real: lexican.Machine, bus: Frames) -> None:
    drive = moving(real, bus)
    with drive:
        pass
    assert velocity(bus) == 0
    with pytest.raises(lexican.Closed):
        drive.state()


def test_ctrl_c_ends_the_travel(real: lexican.Machine, bus: Frames) -> None:
    drive = moving(real, bus)
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt) as interrupt:
        drive.finish()
    assert velocity(bus) == 0
    if sys.version_info >= (3, 11):
        assert "stopped" in interrupt.value.__notes__[0]
    drive.disable()
    drive.enable()
    assert drive.move_to(drive.position()), "it can be ordered again"


def test_another_thread_ends_the_travel(real: lexican.Machine, bus: Frames) -> None:
    drive = moving(real, bus)
    threading.Timer(0.3, drive.cancel).start()
    with pytest.raises(lexican.DriveError, match="stopped"):
        drive.finish()
    assert velocity(bus) == 0


def test_a_task_that_is_cancelled_ends_the_travel(real: lexican.Machine, bus: Frames) -> None:
    async def main() -> None:
        drive = aio.Drive(moving(real, bus))
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(drive.finish(), 0.3)
        assert velocity(bus) == 0

    asyncio.run(main())


def test_a_collected_drive_is_stopped_and_that_is_said(
    real: lexican.Machine, bus: Frames, capfd: pytest.CaptureFixture[str]
) -> None:
    drive = moving(real, bus)
    del drive
    gc.collect()
    real.sleep(1.0)
    assert velocity(bus) == 0
    assert "node 1" in capfd.readouterr().err


def test_a_collected_network_is_stopped_and_that_is_said(capfd: pytest.CaptureFixture[str]) -> None:
    network = lexican.simulate("siko/ag03-1", pace="real")
    bus = network.frames()
    moving(network, bus)
    del network
    gc.collect()
    # The link of `bus` is all that is left.
    assert "node 1" in capfd.readouterr().err


def test_the_end_of_the_interpreter_ends_the_travel() -> None:
    # What is registered first is called last.
    program = """
import atexit

@atexit.register
def look():
    print("velocity", velocity(bus))

from test_safety import lexican, moving, velocity
network = lexican.simulate("siko/ag03-1", pace="real")
bus = network.frames()
drive = moving(network, bus)
"""
    line = [sys.executable, "-B", "-c", program]
    ended = subprocess.run(line, capture_output=True, text=True, timeout=60, cwd=os.path.dirname(__file__))
    assert (ended.returncode, ended.stdout.strip()) == (0, "velocity 0"), ended.stderr


FORK = """
import os, sys, threading

from test_safety import lexican, moving, velocity

network = lexican.simulate("siko/ag03-1", pace="real")
bus = network.frames()
drive = moving(network, bus)
child = os.fork()
if child == 0:
    for call in (drive.state, lambda: network.read_bytes(1, 0x1000)):
        try:
            call()
        except lexican.Closed:
            print("closed", flush=True)
    with lexican.simulate("siko/ag03-1") as own:
        print(own.read_bytes(1, 0x1018, 1).hex(), flush=True)
    sys.exit(0)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
print("moves" if velocity(bus) else "stands")
print(drive.stop())
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_a_forked_process_leaves_the_drive_alone() -> None:
    line = [sys.executable, "-B", "-c", FORK]
    ended = subprocess.run(line, capture_output=True, text=True, timeout=60, cwd=os.path.dirname(__file__))
    assert ended.returncode == 0 and "panicked" not in ended.stderr, ended.stderr
    assert ended.stdout.splitlines() == ["closed", "closed", "95010000", "moves", "reached"], ended.stdout


def test_many_threads_with_networks_of_their_own() -> None:
    def work() -> None:
        with lexican.simulate("siko/ag03-1") as network, network.node(1).drive() as drive:
            drive.enable()
            moved.append(bool(drive.move_to(500)))

    moved: list[bool] = []
    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert moved == [True] * 8
