"""The example of docs/guides/write-a-scenario.md loads, and every key of a scenario has a meaning."""

from __future__ import annotations

import re
from pathlib import Path

from scenarios.loading.resolve import load
from tracking.app.commands.scenarios import list_keys

DOCS = Path(__file__).resolve().parents[3] / "docs"


def test_example(tmp_path: Path) -> None:
    guide = (DOCS / "guides" / "write-a-scenario.md").read_text(encoding="utf-8")
    example = re.findall(r"^```toml\n(.*?)^```$", guide, re.DOTALL | re.MULTILINE)
    (tmp_path / "example.toml").write_text(example[0])
    assert [e.id for e in load(tmp_path / "example.toml").event] == ["m1", "s1"]


def test_keys() -> None:
    assert all(row["meaning"] for row in list_keys().data["keys"])
