#!/usr/bin/env python3
"""Has lexican test whether python-canopen's device does what CANopen asks for.

usage: conform.py LEXICAN REPORT

LEXICAN is the command; REPORT is where it writes what it finds, as JSON.
"""

import subprocess
import sys

import canopen

import buses
import their_device

NODE = 5


def main():
    lexican, report = sys.argv[1:3]
    url, _, bus = buses.links("slcan")
    network = canopen.Network()
    network.connect(**bus)
    their_device.Device(network, NODE)
    line = [lexican, "conform", "--bus", url, str(NODE), "--device", their_device.EDS, "--allow", "all"]
    # It lets the device send an emergency, by the callback that their_device.py has for it.
    line += ["--emergency", "2004=0x1000", "--force", "--report", report]
    sys.exit(subprocess.run(line, stdout=subprocess.DEVNULL).returncode)


if __name__ == "__main__":
    main()
