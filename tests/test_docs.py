"""Links in the documents lead to files and headings, and every part that is made from the code can be made."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from tests.processes import ROOT

PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
NOT_IN_ANCHORS = re.compile(r"[^\w\- ]")


def prose(page: Path) -> str:
    """The text of a page without its blocks of code and code inside lines."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    return re.sub(r"`[^`\n]*`(?!\])", "", text)


def anchors(page: Path) -> set[str]:
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    headings = HEADING.findall(text)
    return {NOT_IN_ANCHORS.sub("", heading.strip().lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links(page: Path) -> None:
    for link in LINK.findall(prose(page)):
        if link.startswith(("http://", "https://")):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        assert target.exists(), f"{link}: no such file"
        if anchor and target.suffix == ".md" and "<!-- generated:" not in target.read_text(encoding="utf-8"):
            assert anchor in anchors(target), f"{link}: no such heading"


@pytest.fixture(scope="module")
def site() -> ModuleType:
    spec = importlib.util.spec_from_file_location("docs_conf", ROOT / "docs" / "conf.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_generated_parts(site: ModuleType) -> None:
    asked = {found[1] for page in PAGES for found in site.GENERATED.finditer(page.read_text(encoding="utf-8"))}
    assert asked == site.PARTS.keys()
    pages = [page for page in PAGES if page.name != "CONTRIBUTING.md"]
    text = "\n".join(site.with_generated_parts(page.read_text(encoding="utf-8")) for page in pages)
    assert "<!-- generated: " not in text.replace("`<!-- generated: NAME -->`", "")
    for made in ("| `HOTA` |", "| `--shard-size SIZE` |", "| `gate` |", "| `merge` |", "camera.fps ", "eq. 2.2"):
        assert made in text


def test_public_names_have_an_entry(site: ModuleType) -> None:
    assert site.undocumented() == []


def test_every_key_of_a_scenario_has_a_meaning(site: ModuleType) -> None:
    assert all(row["meaning"] for row in site.keys_of_scenarios())
