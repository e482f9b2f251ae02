"""What a program that goes wrong, closes early or runs for long meets."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import lexican
import pytest


def program(text: str) -> str:
    """What a program prints that has to end within a minute."""
    line = [sys.executable, "-B", "-c", text]
    ended = subprocess.run(line, capture_output=True, text=True, timeout=60, cwd=os.path.dirname(__file__))
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


class Adapter:
    """A bus of python-can that nobody answers on, whose driver takes its time."""

    def recv(self, timeout: float | None = None) -> None:
        time.sleep(timeout or 0)

    def send(self, msg: object, timeout: float | None = None) -> None:
        time.sleep(0.05)


CLOSED_MEANWHILE = """
import threading
from test_limits import Adapter, lexican

network = lexican.Network(Adapter())
network.produce_heartbeat(127, 0.001)
closing = threading.Timer(0.2, network.close)
closing.start()
network.sleep(0.5)
closing.join()
print("both have ended")
"""


def test_a_call_that_ends_after_another_thread_has_closed_the_network() -> None:
    # The last that has the network's thread waits for its end, and that thread for the interpreter, to send.
    assert program(CLOSED_MEANWHILE) == "both have ended\n"


CLOSED_BY_CALLS = """
import threading
from test_limits import Adapter, lexican

network = lexican.Network(Adapter())
network.produce_heartbeat(127, 0.001)

def ask():
    try:
        while True:
            network.now()
    except lexican.Closed:
        pass

threads = [threading.Thread(target=ask) for _ in range(4)]
for thread in threads:
    thread.start()
network.close()
for thread in threads:
    thread.join()
print("all have ended")
"""


def test_a_network_is_closed_while_others_call_it() -> None:
    assert program(CLOSED_BY_CALLS) == "all have ended\n"


COLLECTED_WITH_CALLBACK = """
import threading, time
from test_limits import lexican

begun = threading.Event()

def slow(event):
    if not begun.is_set():
        begun.set()
        for _ in range(200):
            time.sleep(0.001)
        print("the callback has ended")

network = lexican.simulate("siko/ag03-1")
network.on(None, slow)
network.carry_out("node1", "power off")
network.carry_out("node1", "power on")
network.sleep(1)
begun.wait()
del network
"""


def test_no_callback_of_a_collected_network_is_inside_python_when_it_ends() -> None:
    for _ in range(10):
        assert program(COLLECTED_WITH_CALLBACK) == "the callback has ended\n"


def test_a_panic_is_an_exception(capfd: pytest.CaptureFixture[str]) -> None:
    class Reentrant(Adapter):
        """One that asks the network that it carries, which waits for it: nothing can come of that."""

        def send(self, msg: object, timeout: float | None = None) -> None:
            try:
                network.now()
            except BaseException as error:
                raised.append(error)

    raised: list[BaseException] = []
    with lexican.Network(Reentrant()) as network:
        network.send(0x123)
        (panic,) = raised
        assert type(panic).__name__ == "PanicException" and not isinstance(panic, Exception)
        assert "runtime" in str(panic)
        assert network.now() >= 0, "it goes on"
    assert "panicked" in capfd.readouterr().err


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="this system does not say how much memory is in use")
def test_memory_is_flat_over_transfers(network: lexican.Machine) -> None:
    def kilobytes() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024

    def transfer(count: int) -> None:
        for _ in range(count // 4):
            network.read_bytes(1, 0x1018, 1)
            network.write_bytes(1, 0x6067, 0, b"\x05\x00")
            node.read("position window")
            node.write("position window", 7)

    node = network[1]
    transfer(2_000)
    before = kilobytes()
    transfer(20_000)
    assert kilobytes() - before < 256, "a transfer has not left 13 bytes"
