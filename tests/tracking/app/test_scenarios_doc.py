"""docs/reference/scenario-files.md is correct: its example loads, and it lists the catalogue and every key."""

from __future__ import annotations

import re
from pathlib import Path

from scenarios.loading.resolve import load, names, suite_names
from tracking.app.commands.scenario_keys import list_keys

DOC = (Path(__file__).resolve().parents[3] / "docs" / "reference" / "scenario-files.md").read_text(encoding="utf-8")


def test_example(tmp_path: Path) -> None:
    example = re.findall(r"^```toml\n(.*?)^```$", DOC, re.DOTALL | re.MULTILINE)
    assert len(example) == 1
    (tmp_path / "example.toml").write_text(example[0])
    assert [e.id for e in load(tmp_path / "example.toml").event] == ["m1", "s1"]


def test_catalogue() -> None:
    rows = re.findall(r"^\| `([a-z-]+)` \|", DOC, re.MULTILINE)
    assert rows == names()
    assert all(f"| `{name}` | {load(name).about} |" in DOC for name in rows)
    assert all(f"`{name}`" in DOC for name in suite_names())


def test_keys() -> None:
    assert f"```\n{list_keys().text.rstrip()}\n```" in DOC, "put the output of `flockscope scenarios --schema` into it"
    assert all(row["meaning"] for row in list_keys().data["keys"])
