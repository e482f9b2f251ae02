"""What README.md and the docstrings show is what happens."""

from __future__ import annotations

import doctest
import re
from pathlib import Path
from typing import Any

import lexican
import pytest

README = (Path(__file__).parents[1] / "README.md").read_text()
# Programs, and what they print.
SHOWN = re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", README, re.DOTALL)


@pytest.mark.parametrize(("program", "prints"), SHOWN)
def test_the_readme_shows_what_happens(program: str, prints: str, capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {"lexican": lexican}
    exec(program, names)
    assert capsys.readouterr().out == prints


def test_all_programs_of_the_readme_are_shown_with_what_they_print() -> None:
    assert len(SHOWN) == README.count("```python") > 0


def test_the_docstrings_show_what_happens() -> None:
    failed, tried = doctest.testmod(lexican)
    assert tried > 0 and failed == 0
