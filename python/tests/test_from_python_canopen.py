"""The programs of from-python-canopen.md: both of a pair print the same, on a bus of the same devices."""

from __future__ import annotations

import re
import shutil
import threading
from pathlib import Path
from typing import Any

import can
import lexican
import pytest

HERE = Path(__file__).parents[1]
PAGE = (HERE / "from-python-canopen.md").read_text()
DRIVE = HERE.parent / "eds/devices/siko/ag03-1/SIKOAG03.EDS"
BLOCK = r"```python\n(.*?)```\n\n"
PAIRS = re.findall(rf"## ([^\n]*)\n\n{BLOCK}{BLOCK}```text\n(.*?)```", PAGE, re.DOTALL)
MACHINE = """\
[node.sensor]
id = 7
sheet = "sensor.eds"
[node.drive]
id = 5
sheet = "siko/ag03-1"
"""


@pytest.mark.parametrize("side", ["python-canopen", "lexican"])
@pytest.mark.parametrize(("title", "theirs", "ours", "prints"), PAIRS, ids=[pair[0] for pair in PAIRS])
def test_a_program_prints_what_the_page_says(
    title: str,
    theirs: str,
    ours: str,
    prints: str,
    side: str,
    sensor: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sensor.write_text(sensor.read_text().replace("Granularity=8", "Granularity=8\nLSS_Supported=1"))
    shutil.copy(DRIVE, sensor.with_name("drive.eds"))
    dcf = sensor.read_text().replace("DataType=6\nAccessType=rw\nDefaultValue=0", "DataType=6\nAccessType=rw\nParameterValue=250")
    sensor.with_name("left.dcf").write_text(dcf)
    sensor.with_name("bus.log").write_text("(1.0) can0 187#F9FF\n(1.5) can0 080#\n(2.0) can0 187#D4FE\n")
    machine = sensor.with_name("machine.toml")
    machine.write_text(MACHINE)
    monkeypatch.chdir(sensor.parent)
    # One device is alone on its bus for LSS.
    source, node = ("sensor.eds", "node7") if title == "LSS" else (machine, "sensor")
    with lexican.simulate(source, node=7, pace="real") as simulated:
        channel: Any = simulated
        program = ours if side == "lexican" else theirs
        program = program.replace('interface="socketcan", channel="can0"', 'interface="lexican", channel=simulated')
        program = program.replace('lexican.Network("can0")', "lexican.Network(bus)").replace('"can0"', "simulated")
        alarm = threading.Timer(1.0, simulated.carry_out, (node, "emcy 5000 81"))
        with can.Bus(interface="lexican", channel=channel) as bus:
            alarm.start()
            exec(program, {"simulated": simulated, "bus": bus})
            alarm.cancel()
            alarm.join()
    assert capsys.readouterr().out == prints


def test_all_programs_of_the_page_are_run() -> None:
    assert 2 * len(PAIRS) == PAGE.count("```python") > 0
