"""Many frames of a PDO at once: what single frames are, and what python-canopen makes of them."""

from __future__ import annotations

import array
import importlib
import os
from pathlib import Path
from typing import Any

import canopen
import lexican
import pytest

DRIVE = Path(__file__).parents[2] / "eds/devices/siko/ag03-1/SIKOAG03.EDS"


def pdo(name: str = "TPDO3", sheet: str | Path = "siko/ag03-1") -> lexican.Pdo:
    (found,) = (it for it in lexican.load(sheet).pdos(5) if it.name == name)
    return found


def test_all_sources_come_to_the_same(tmp_path: Path) -> None:
    frames = [os.urandom(6) for _ in range(500)]
    padded = b"".join(frame + bytes(2) for frame in frames)
    log = tmp_path / "all.log"
    lines = (f"({at / 10:.6f}) can0 385#{frame.hex()}\n(0.0) can0 386#00\n" for at, frame in enumerate(frames))
    log.write_text("".join(lines))
    it = pdo()
    assert (it.cob_id, it.units) == (0x385, {"Statusword": None, "Position Actual Value": "increments"})
    listed = it.decode(frames)
    assert listed["Statusword"].tolist() == [int.from_bytes(frame[:2], "little") for frame in frames]
    positions = [float(int.from_bytes(frame[2:], "little", signed=True)) for frame in frames]
    assert listed["Position Actual Value"].tolist() == positions
    for source in (padded, bytearray(padded), array.array("B", padded), memoryview(padded).cast("B", (500, 8)), iter(frames)):
        assert it.decode(source) == listed
    numpy: Any = importlib.import_module("numpy")
    for source in (numpy.frombuffer(padded, "u1").reshape(-1, 8), numpy.frombuffer(padded, "<u8"), numpy.array(frames, object)):
        assert it.decode(source) == listed
    logged = it.decode(log)
    assert logged.pop("time").tolist() == [at / 10 for at in range(500)]
    assert logged == listed == {name: it.decode(str(log))[name] for name in listed}


def test_python_canopen_makes_the_same_of_the_frames() -> None:
    frames = [os.urandom(8) for _ in range(200)]
    node: Any = canopen.Network().add_node(5, str(DRIVE))
    for ours in lexican.load(DRIVE).pdos(5):
        theirs: Any = (node.tpdo if ours.name[0] == "T" else node.rpdo)[int(ours.name[4:])]
        theirs.read(from_od=True)
        decoded = ours.decode(frames)
        assert len(decoded) == len(theirs.map)
        for at, frame in enumerate(frames):
            theirs.data = bytearray(frame)
            assert [column[at] for column in decoded.values()] == [variable.raw for variable in theirs.map]


def test_units_are_those_that_the_node_is_set_to() -> None:
    with lexican.simulate("siko/ag03-1", node=5) as network:
        network[5].write("spindle pitch", "4.00 mm")
        (it,) = (it for it in network[5].pdos() if it.name == "TPDO3")
        assert it.units["Position Actual Value"] == "mm"
        decoded = it.decode([bytes.fromhex("3702 d2040000")])
        assert decoded["Position Actual Value"].tolist() == [12.34]
        network[5].write((0x1802, 2), 1)
        network.nmt("start", 5)
        network.produce_sync(0.1)
        values = it.next(1.0)
        assert values and values["Position Actual Value"].unit == "mm"


def test_what_is_no_frame_is_refused(tmp_path: Path) -> None:
    it = pdo()
    with pytest.raises(ValueError, match="frame 1 has 5 bytes, and TPDO3 has 6"):
        it.decode([bytes(6), bytes(5)])
    with pytest.raises(ValueError, match="8 bytes for each"):
        it.decode(bytes(12))
    with pytest.raises(ValueError, match="8 bytes for each"):
        it.decode(array.array("H", bytes(16)))
    with pytest.raises(lexican.LexicanError, match="missing.log"):
        it.decode(tmp_path / "missing.log")
    with pytest.raises(TypeError):
        it.decode(5)  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]
    with pytest.raises(lexican.LexicanError, match="on no bus"):
        it.latest()
    assert [len(column) for column in it.decode(b"").values()] == [0, 0]


def test_pandas_takes_the_columns() -> None:
    pandas: Any = importlib.import_module("pandas")
    frame = pandas.DataFrame(pdo().decode(bytes(8) * 1000))
    assert frame.shape == (1000, 2) and str(frame.dtypes["Position Actual Value"]) == "float64"
