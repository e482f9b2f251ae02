"""The two links that both sides can use, and a recording of one of them."""

import atexit
import os
import select
import signal
import subprocess
import time
import tty


def cross(a, b):
    """Two pseudo-terminals back to back: what one end's program writes, the other's reads."""
    while True:
        for readable in select.select([a, b], [], [])[0]:
            os.write(b if readable == a else a, os.read(readable, 4096))


def links(kind):
    """Two URLs for lexican and the second of them for python-canopen: who sends at one is heard at the other."""
    if kind == "vcan":
        return "socketcan:vcan0", "socketcan:vcan0", {"interface": "socketcan", "channel": "vcan0"}
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
    bus = {"interface": "slcan", "channel": names[1], "bitrate": 500000, "sleep_after_open": 0}
    return f"slcan:{names[0]}", f"slcan:{names[1]}", bus


class Recording:
    """A log of the bus, beside the results: `candump -L`."""

    def __init__(self, path):
        self.process = subprocess.Popen(["candump", "-L", "vcan0"], stdout=open(path, "w", encoding="ascii"))
        time.sleep(0.2)  # until it listens

    def end(self):
        time.sleep(0.2)  # until it has written
        self.process.kill()
        self.process.wait()
