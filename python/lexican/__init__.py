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
    VERSION,
    Change as Change,
    Closed as Closed,
    DataSheet as DataSheet,
    DataSheetError as DataSheetError,
    Drive as Drive,
    DriveError as DriveError,
    Entry as Entry,
    Event as Event,
    Events as Events,
    Fault as Fault,
    Finding as Finding,
    LexicanError as LexicanError,
    LinkFailed as LinkFailed,
    Machine as Machine,
    MachineFileError as MachineFileError,
    Network as Network,
    NoAnswer as NoAnswer,
    Node as Node,
    ObjectUnknown as ObjectUnknown,
    Outcome as Outcome,
    Pdo as Pdo,
    Restored as Restored,
    SdoAborted as SdoAborted,
    Value as Value,
    ValueRefused as ValueRefused,
    load as load,
    lss_configure as lss_configure,
    lss_scan as lss_scan,
    simulate as simulate,
)

__version__ = VERSION
