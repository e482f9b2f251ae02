"""CANopen: data sheets, networks, simulated devices, and drives that move.

>>> import lexican
>>> with lexican.simulate("siko/ag03-1") as network:
...     drive = network.node(1).drive()
...     _ = drive.enable()
...     print(drive.move_to(5000))
reached

Calls block, and other threads go on meanwhile. :mod:`lexican.aio` has the same for asyncio, :mod:`lexican.can` the interface
for python-can.
"""

from lexican._native import (
    VERSION as __version__,
    Change,
    Closed,
    DataSheet,
    DataSheetError,
    Drive,
    DriveError,
    Entry,
    Event,
    Events,
    Finding,
    LexicanError,
    LinkFailed,
    Machine,
    MachineFileError,
    Network,
    NoAnswer,
    Node,
    ObjectUnknown,
    Outcome,
    SdoAborted,
    Value,
    ValueRefused,
    load,
    simulate,
)

__all__ = [
    "Change",
    "Closed",
    "DataSheet",
    "DataSheetError",
    "Drive",
    "DriveError",
    "Entry",
    "Event",
    "Events",
    "Finding",
    "LexicanError",
    "LinkFailed",
    "Machine",
    "MachineFileError",
    "Network",
    "NoAnswer",
    "Node",
    "ObjectUnknown",
    "Outcome",
    "SdoAborted",
    "Value",
    "ValueRefused",
    "__version__",
    "load",
    "simulate",
]
