"""Data sheets, beside what python-canopen and cantools make of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import canopen
import cantools
import lexican
import pytest

from conftest import OVERLAY


def test_an_entry_has_what_python_canopen_reads(sensor: Path) -> None:
    foreign: Any = canopen.import_od(str(sensor))
    sheet = lexican.load(sensor)
    assert len(sheet) == sum(len(it) if hasattr(it, "subindices") else 1 for it in foreign.values())
    for (index, sub), entry in sheet.items():
        it = foreign[index]
        variable = it[sub] if hasattr(it, "subindices") else it
        assert (entry.name, entry.access) == (variable.name, variable.access_type)
        if not isinstance(entry.default, str) or entry.data_type == "VISIBLE_STRING":
            assert entry.default == variable.default, entry


def test_entries_are_found_by_name_and_address(sensor: Path) -> None:
    sheet = lexican.load(sensor)
    assert [sheet[name].name for name in ("pressure", 0x2000, (0x1018, 2), "1018:02", "identity object/product code")] == [
        "Pressure",
        "Pressure",
        "Product code",
        "Product code",
        "Product code",
    ]
    assert sheet[0x1800, 1].default == "$NODEID+0x180"
    assert 0x2000 in sheet and "temperature" not in sheet
    with pytest.raises(lexican.ObjectUnknown, match="did you mean 2000:00 Pressure"):
        sheet["presure"]


def test_a_finding_has_its_place_and_a_remedy(sensor: Path) -> None:
    assert [finding for finding in lexican.load(sensor).lint() if finding.severity != "note"] == []
    text = sensor.read_text().replace("SupportedObjects=3\n1=0x2000", "SupportedObjects=4\n1=0x2000")
    sensor.write_text(text)
    (finding,) = (finding for finding in lexican.load(sensor).lint() if finding.severity != "note")
    line = text.splitlines().index("[ManufacturerObjects]") + 2
    assert (finding.severity, finding.line, finding.file) == ("warning", line, str(sensor))
    assert finding.remedy and finding.rule and f"{sensor}:{line}" in str(finding)


def test_two_sheets_differ_by_object(sensor: Path) -> None:
    before = lexican.load(sensor)
    sensor.write_text(sensor.read_text().replace("DefaultValue=-7", "DefaultValue=-8"))
    (change,) = before.diff(lexican.load(sensor))
    assert (change.place, change.attribute, change.before, change.after) == ("2000:00", "default", "-7", "-8")
    assert before.diff(before) == []


def test_an_overlay_says_units(sensor: Path) -> None:
    overlay = sensor.with_name("sensor.toml")
    overlay.write_text(OVERLAY)
    assert lexican.load(sensor)["pressure"].unit is None
    assert lexican.load(sensor, [overlay])["pressure"].unit == "bar"


@pytest.mark.parametrize(
    ("data_type", "text", "ours", "theirs"),
    [(3, "0xFFFF", -1, 65535), (2, "0xFD", -3, 253), (4, "0x80000000", -(2**31), 2**31), (1, "0x10", True, 16)],
)
def test_hexadecimal_defaults_of_signed_types_are_negative(
    sensor: Path, data_type: int, text: str, ours: object, theirs: int
) -> None:
    # All in which 271 data sheets of a corpus differ: of 60C2h:02, whose default is -3, python-canopen makes 253, which no INTEGER8 is. It
    # reads limits as we do.
    old = "DataType=3\nAccessType=ro\nDefaultValue=-7"
    assert old in sensor.read_text()
    sensor.write_text(sensor.read_text().replace(old, f"DataType={data_type}\nAccessType=ro\nDefaultValue={text}"))
    sheet = lexican.load(sensor)
    foreign: Any = canopen.import_od(str(sensor))
    assert (sheet[0x2000].default, foreign[0x2000].default) == (ours, theirs)
    outside = [finding.rule for finding in sheet.lint() if finding.rule == "eds::default-outside-type"]
    assert len(outside) == (data_type == 1), "no BOOLEAN is 16, and lint says so"


def test_what_a_dcf_configures(sensor: Path) -> None:
    dcf = sensor.with_suffix(".dcf")
    text = sensor.read_text().replace("ParameterName=Producer heartbeat time", "ParameterName=Producer heartbeat time\nParameterValue=250")
    dcf.write_text(text + "\n[DeviceComissioning]\nNodeID=5\nNodeName=left\nBaudrate=500\n")
    assert [(entry.index, entry.value) for entry in lexican.load(dcf).configured()] == [(0x1017, 250)]
    assert b"BO_ 389 " in lexican.load(dcf).to_dbc()


def test_cantools_reads_the_database(sensor: Path) -> None:
    database: Any = cantools.database.load_string(lexican.load(sensor).to_dbc(5, 6).decode("cp1252"), "dbc")
    (message,) = (message for message in database.messages if message.frame_id == 0x185)
    (signal,) = message.signals
    assert database.decode_message(0x186, b"\xf9\xff") == {signal.name: -7}


def test_rows_are_the_columns_of_the_command(sensor: Path) -> None:
    sheet = lexican.load(sensor)
    rows = sheet.rows()
    assert len(rows) == len(sheet)
    (row,) = (row for row in rows if row["index"] == "2000")
    assert (row["data_type"], row["default"], row["low_limit"]) == ("INTEGER16", "-7", "")
    (object,) = (object for object in sheet.dump()["objects"] if object["index"] == "2000")
    assert object["entries"][0]["default"] == -7


def test_what_is_no_sheet_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(lexican.DataSheetError, match="did you mean siko/ag03-1"):
        lexican.load("siko/ag03")
    (tmp_path / "empty.eds").write_text("nothing")
    with pytest.raises(lexican.DataSheetError, match="describes no object"):
        lexican.load(tmp_path / "empty.eds")
    with pytest.raises(lexican.LexicanError, match="which node-ID"):
        lexican.load("siko/ag03-1").to_dbc()
