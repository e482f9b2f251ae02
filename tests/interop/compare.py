#!/usr/bin/env python3
"""Compares what two decoders make of a log: tshark, which nobody here wrote, and `lexican monitor`.

usage: compare.py LEXICAN LOG

Frame by frame, service, node, index and sub-index, abort and error codes, NMT commands and states must agree. tshark
looks at each frame alone, so that it takes the segments of block transfers for commands: those are left out, and
counted.
"""

import json
import subprocess
import sys

FIELDS = [
    "frame.number", "can.id", "canopen.node_id", "canopen.sdo.main_idx", "canopen.sdo.sub_idx",
    "canopen.sdo.abort_code", "canopen.em.err_code", "canopen.nmt_ctrl.cd", "canopen.nmt_guard.state", "_ws.col.Info",
]

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
COMMANDS = {
    0x01: "enter OPERATIONAL",
    0x02: "enter STOPPED",
    0x80: "enter PRE-OPERATIONAL",
    0x81: "reset node",
    0x82: "reset communication",
}
STATES = {0x04: "STOPPED", 0x05: "OPERATIONAL", 0x7F: "PRE-OPERATIONAL"}


def difference(theirs, ours):
    """What the decoders do not agree on, or None."""
    service, text = ours["service"], ours["text"]
    info = theirs["_ws.col.Info"]
    if int(theirs["can.id"]) != int(ours["id"], 16):
        return "identifier"
    if service not in SERVICES or not info.startswith(SERVICES[service]):
        return "service"
    if service not in NODELESS and int(theirs["canopen.node_id"], 16) != ours["node"]:
        return "node"
    if theirs["canopen.sdo.main_idx"]:
        address = f"{int(theirs['canopen.sdo.main_idx'], 16):04X}:{int(theirs['canopen.sdo.sub_idx'], 16):02X}"
        if address not in text:
            return f"address {address}"
    if theirs["canopen.sdo.abort_code"]:
        code = f"{int(theirs['canopen.sdo.abort_code'], 16):08X}"
        if f"{code[:4]} {code[4:]}" not in text:
            return f"abort code {code}"
    if theirs["canopen.em.err_code"] and int(theirs["canopen.em.err_code"], 16):
        code = f"{int(theirs['canopen.em.err_code'], 16):04X}"
        if code not in text:
            return f"error code {code}"
    if theirs["canopen.nmt_ctrl.cd"] and COMMANDS.get(int(theirs["canopen.nmt_ctrl.cd"], 16), "?") not in text:
        return "command"
    if service == "heartbeat" and STATES.get(int(theirs["canopen.nmt_guard.state"], 16), "?") not in text:
        return "state"
    return None


def main():
    lexican, log = sys.argv[1:]
    line = ["tshark", "-r", log, "-d", "can.subdissector,canopen", "-T", "fields", "-E", "separator=/t"]
    line += [word for field in FIELDS for word in ("-e", field)]
    tshark = subprocess.run(line, capture_output=True, text=True, check=True).stdout.splitlines()
    monitor = subprocess.run([lexican, "monitor", "--bus", f"log:{log}", "--json"], capture_output=True, text=True)
    ours = [json.loads(line) for line in monitor.stdout.splitlines()]
    if not ours or len(ours) != len(tshark):
        sys.exit(f"{log}: tshark has {len(tshark)} frames, lexican {len(ours)}: {monitor.stderr}")
    segments, differences = 0, []
    for line, our in zip(tshark, ours):
        their = dict(zip(FIELDS, line.split("\t")))
        if our["service"].startswith("SDO") and our["text"].startswith("block segment"):
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
