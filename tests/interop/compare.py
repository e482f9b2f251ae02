#!/usr/bin/env python3
"""Compares what two decoders make of a log: tshark, which is independent of lexican, and `lexican monitor`.

usage: compare.py LEXICAN LOG

Frame by frame, service, node, index and sub-index, abort and error codes, NMT commands and states, LSS commands
and times must agree. tshark looks at each frame alone, so that it takes the segments of block transfers for commands:
those are left out, and counted.
"""

import json
import subprocess
import sys

# What tshark calls a field, and where lexican has it: both as numbers.
FIELDS = {
    "canopen.sdo.main_idx": ("sdo", "index"),
    "canopen.sdo.sub_idx": ("sdo", "sub"),
    "canopen.sdo.abort_code": ("sdo", "abort_code"),
    "canopen.em.err_code": ("emcy", "code"),
    "canopen.em.err_reg": ("emcy", "register"),
    "canopen.nmt_ctrl.cd": ("nmt", "code"),
    "canopen.lss.cs": ("lss", "code"),
    "canopen.lss.nid": ("lss", "node_id"),
    "canopen.lss.fastscan.id": ("lss", "value"),
    "canopen.lss.fastscan.check": ("lss", "bit_checked"),
    "canopen.sync.counter": ("sync", "counter"),
}
# What lexican has as decimal numbers.
DECIMAL = ("node_id", "value", "bit_checked", "counter")
GENERAL = ["frame.number", "can.id", "canopen.node_id", "canopen.nmt_guard.state", "_ws.col.Info"]

# What lexican calls a service, and how tshark's line of it begins.
SERVICES = {
    "NMT": "NMT:",
    "SYNC": "SYNC",
    "TIME": "TIME STAMP",
    "EMCY": "EMCY",
    "SDO request": "Default-SDO (rx)",
    "SDO response": "Default-SDO (tx)",
    "boot-up": "NMT Error Control: Boot-up",
    "heartbeat": "NMT Error Control:",
    "LSS request": "LSS (Master)",
    "LSS response": "LSS (Slave)",
    **{f"RPDO{n}": f"PDO{n} (rx)" for n in range(1, 5)},
    **{f"TPDO{n}": f"PDO{n} (tx)" for n in range(1, 5)},
    # A remote frame; tshark does not look into those.
    "guarding": "ID: ",
}
NODELESS = ("NMT", "SYNC", "TIME", "LSS request", "LSS response", "guarding")
STATES = {0x04: "STOPPED", 0x05: "OPERATIONAL", 0x7F: "PRE-OPERATIONAL"}


def difference(theirs, ours):
    """What the decoders do not agree on, or None."""
    service = ours["service"]
    info = theirs["_ws.col.Info"]
    if int(theirs["can.id"]) != int(ours["id"], 16):
        return "identifier"
    if service not in SERVICES or not info.startswith(SERVICES[service]):
        return "service"
    if service not in NODELESS and int(theirs["canopen.node_id"], 16) != ours["node"]:
        return "node"
    for field, (protocol, name) in FIELDS.items():
        if theirs[field]:
            mine = ours.get(protocol, {}).get(name)
            if name == "node_id" and mine is None:
                mine = 0xFF  # which says that there is none (CiA 305)
            mine = mine if name in DECIMAL or mine is None else int(mine, 16)
            if mine != number(theirs[field]):
                return f"{field} {theirs[field]}"
    if service == "heartbeat" and STATES.get(number(theirs["canopen.nmt_guard.state"])) != ours["error_control"]["state"]:
        return "state"
    return None


def number(text):
    """As tshark prints it: hexadecimal with a mark, or decimal."""
    return int(text, 0)


def main():
    lexican, log = sys.argv[1:]
    line = ["tshark", "-r", log, "-d", "can.subdissector,canopen", "-T", "fields", "-E", "separator=/t"]
    fields = [*GENERAL, *FIELDS]
    line += [word for field in fields for word in ("-e", field)]
    tshark = subprocess.run(line, capture_output=True, text=True, check=True).stdout.splitlines()
    monitor = subprocess.run([lexican, "monitor", "--bus", f"log:{log}", "--json"], capture_output=True, text=True)
    decoded = [json.loads(line) for line in monitor.stdout.splitlines()]
    # What is not a frame is an event: a device that was recognised, for one.
    ours = [line for line in decoded if "id" in line]
    if not ours or len(ours) != len(tshark):
        sys.exit(f"{log}: tshark has {len(tshark)} frames, lexican {len(ours)}: {monitor.stderr}")
    segments, differences = 0, []
    for line, our in zip(tshark, ours):
        their = dict(zip(fields, line.split("\t")))
        if our.get("sdo", {}).get("command", "").endswith("block-segment"):
            segments += 1
            continue
        what = difference(their, our)
        if what:
            differences.append(f"frame {their['frame.number']}: {what}: {their['_ws.col.Info']} | {our}")
    for found in differences[:20]:
        print(found)
    verdict = "failed" if differences else "ok"
    compared = len(ours) - segments
    print(f"same decoding as tshark\t{verdict}\t{compared - len(differences)} of {compared} frames agree, "
          f"{segments} block segments left out")
    sys.exit(1 if differences else 0)


if __name__ == "__main__":
    main()
