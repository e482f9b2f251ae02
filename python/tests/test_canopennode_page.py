"""What the page for users of CANopenNode shows is what happens."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_for_users_of_canopennode(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", (DOCS / "canopennode.md").read_text(), re.DOTALL)
    assert len(shown) == 1
    program, prints = shown[0]
    (tmp_path / "eds").mkdir()
    shutil.copy(DOCS / "canopennode" / "io.xdd", tmp_path / "eds")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(program, names)
    assert capsys.readouterr().out == prints
