"""The notebook runs, and its travel is what it says; it is kept without outputs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib
import pytest

NOTEBOOK = Path(__file__).parents[1] / "notebook.ipynb"
matplotlib.use("agg")  # pyright: ignore[reportUnknownMemberType]


def test_the_notebook_runs(capsys: pytest.CaptureFixture[str]) -> None:
    import matplotlib.pyplot as plt

    names: dict[str, Any] = {}
    cells = [cell for cell in json.loads(NOTEBOOK.read_text())["cells"] if cell["cell_type"] == "code"]
    for number, cell in enumerate(cells):
        assert (cell["outputs"], cell["execution_count"]) == ([], None), "strip it"
        exec(compile("".join(cell["source"]), f"{NOTEBOOK.name}, code cell {number}", "exec"), names)
    assert capsys.readouterr().out == "reached\n"
    travel, swing = names["travel"], names["swing"]
    assert abs(travel["Position Actual Value"].iloc[-1] - 4.0) < 0.1 and names["units"]["Position Actual Value"] == "mm"
    assert travel["Velocity Actual Value"].max() > 0 == travel["Velocity Actual Value"].iloc[-1]
    assert len(swing) == 50_000 and 1500 < swing["Position Actual Value"].max() < 2000
    assert len(plt.get_fignums()) == 2, "a figure for each plot"
    plt.close("all")
