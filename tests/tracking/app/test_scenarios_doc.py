"""docs/reference/scenario-files.md lists the catalogue, the suites and every key. The example of the guide loads."""

from __future__ import annotations

import re
from pathlib import Path

from scenarios.loading.resolve import find_suite, load, names, read_suite, resolve, suite_names
from tracking.app.commands.scenarios import list_keys

DOCS = Path(__file__).resolve().parents[3] / "docs"
DOC = (DOCS / "reference" / "scenario-files.md").read_text(encoding="utf-8")


def test_example(tmp_path: Path) -> None:
    guide = (DOCS / "guides" / "write-a-scenario.md").read_text(encoding="utf-8")
    example = re.findall(r"^```toml\n(.*?)^```$", guide, re.DOTALL | re.MULTILINE)
    (tmp_path / "example.toml").write_text(example[0])
    assert [e.id for e in load(tmp_path / "example.toml").event] == ["m1", "s1"]


def test_catalogue() -> None:
    rows = re.findall(r"^\| `([a-z-]+)` \|", DOC, re.MULTILINE)
    assert rows == names()
    assert all(f"| `{name}` | {load(name).about} |" in DOC for name in rows)


def test_suites() -> None:
    rows = re.findall(r"^\| suite `(.+)` \| (\d+) \| (.+) \|$", DOC, re.MULTILINE)
    suites = [(name, find_suite(name)) for name in suite_names()]
    assert rows == [(name, str(len(resolve(f"suite:{name}"))), read_suite(file).about) for name, file in suites]


def test_keys() -> None:
    assert f"```\n{list_keys().text.rstrip()}\n```" in DOC, "put the output of `flockscope scenarios --schema` into it"
    assert all(row["meaning"] for row in list_keys().data["keys"])
