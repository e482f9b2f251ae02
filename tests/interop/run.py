#!/usr/bin/env python3
"""One run of the interoperability tests, with lexican on one side at least.

usage: run.py PROGRAM device|manager|both|ag03-1|ag02|akd slcan|vcan RESULTS

`device` tries lexican's device with python-canopen's manager, `manager` the other way round, `both` has no
python-canopen in it; PROGRAM is interop-peer. `ag03-1`, `ag02` and `akd` let python-canopen drive the
simulated drive; PROGRAM is lexican. Writes a line per service into the file RESULTS: name, verdict (ok, failed, or fault, which is one of
python-canopen's own), remark, between tabs.
"""

import subprocess
import sys

import canopen

import buses
import drive
import servo
import their_device
import their_manager
import verdicts

NODE = 5
MODELS = drive.MODELS | servo.MODELS


class Served:
    """A program of lexican's that is a node of the bus, until the end of the block."""

    def __init__(self, *words):
        self.process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __enter__(self):
        verdicts.same(self.process.stdout.readline(), "ready\n")

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.wait(3)


def run_peer(peer, url, python_canopen):
    lines = subprocess.run([peer, "manager", url, str(NODE)], stdout=subprocess.PIPE, text=True).stdout
    for line in lines.splitlines():
        service, verdict, remark = line.split("\t")
        missing = their_device.MISSING
        if python_canopen and service in missing and (verdict == "failed") != service.startswith("SDO"):
            verdict, remark = "fault", missing[service]
        verdicts.write(service, verdict, remark)


def flood(peer, seconds):
    """Foreign frames as fast as cangen sends them; meanwhile no answer may be lost."""
    with Served(peer, "device", "socketcan:vcan0", str(NODE)):
        noise = subprocess.Popen(["cangen", "vcan0", "-g", "0", "-i", "-I", "2A7", "-L", "8"], stderr=subprocess.DEVNULL)
        packets = "/sys/class/net/vcan0/statistics/tx_packets"
        before = int(open(packets, encoding="ascii").read())
        line = subprocess.run([peer, "reads", "socketcan:vcan0", str(NODE), str(seconds)], stdout=subprocess.PIPE, text=True)
        frames = (int(open(packets, encoding="ascii").read()) - before) // seconds
        noise.kill()
        noise.wait()
    service, verdict, remark = line.stdout.strip().split("\t")
    verdicts.write(service, verdict, f"{remark}, with {frames} frames per second on the bus for {seconds} s")


def main():
    program, direction, kind, results = sys.argv[1:5]
    verdicts.write_into(results)
    url, far_url, bus = buses.links(kind)
    recording = buses.Recording(results.replace(".txt", ".log")) if kind == "vcan" else None
    network = canopen.Network()
    if direction == "device":
        with Served(program, "device", url):
            network.connect(**bus)
            their_manager.Manager(network, NODE).run()
    elif direction == "manager":
        network.connect(**bus)
        their_device.Device(network, NODE)
        run_peer(program, url, True)
    elif direction in MODELS:
        network.connect(**bus)
        model = MODELS[direction]
        drive.run(network, model, NODE, lambda *more: drive.Simulation(program, model, url, NODE, *more))
    else:
        with Served(program, "device", far_url):
            run_peer(program, url, False)
    if recording:
        recording.end()
    network.disconnect()
    if direction == "both" and kind == "vcan":
        flood(program, 60)
    sys.exit(1 if verdicts.FAILED else 0)


if __name__ == "__main__":
    main()
