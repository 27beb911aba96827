"""Links in the documents lead to files and headings; the parts that are made from the code are as the code.

Every name that users meet has its definition in a page.
"""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from benchmarks.pages.blocks import BLOCK, differing
from benchmarks.pages.parts import PARTS, keys_of_scenarios
from benchmarks.pages.places import CONFIGS, DOCSTRINGS, NAMES
from benchmarks.pages.python_names import without_entry
from benchmarks.results import pages
from scenarios.loading.resolve import names, suite_names
from sim.dataset.generate import generate
from tests.processes import ROOT
from tracking.errors.causes import CAUSES
from tracking.recordings.source import open_source
from tracking.running.run import track
from tracking.running.signals import STATISTICS
from tracking.running.tracker_registry import find
from tracking.running.tracker_registry import names as trackers
from tracking.scoring.catalogue import ALL
from tracking.stress.axes import AXES
from tracking.stress.failures import KINDS

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
        if anchor and target.suffix == ".md":
            assert anchor in anchors(target), f"{link}: no such heading"


def test_parts_of_the_pages_are_as_the_code() -> None:
    assert not differing(), "python -m benchmarks pages writes them"


def test_every_part_is_used() -> None:
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages())
    used = {(found[2], found[3]) for found in BLOCK.finditer(text)}
    assert {name for name, _ in used} == PARTS.keys()
    for part, known in (("docstring", DOCSTRINGS), ("parameters", CONFIGS), ("python", NAMES)):
        assert {argument for name, argument in used if name == part} == known.keys()
    begun = re.findall("^<!-- (?:generated|results): ", text, re.MULTILINE)
    assert len(begun) == len(re.findall("^<!-- end -->$", text, re.MULTILINE))


def test_public_names_have_an_entry() -> None:
    assert without_entry() == []


def test_every_key_of_a_scenario_has_a_meaning() -> None:
    assert all(key["meaning"] for key in keys_of_scenarios())


def test_pages_of_the_site() -> None:
    """Commands are wrapped between options alone, pictures keep their place, captions have a level."""
    finished = runpy.run_path(str(ROOT / "docs" / "conf.py"))["finished"]
    block = '<div class="highlight-sh notranslate"><pre>stress a --search 48 --hold-out x-y</pre></div>'
    shown = '<span class="option">--search</span> 48 <span class="option">--hold-out</span> x-y'
    assert (
        finished(block + "<p>--search</p>", ROOT)
        == block.replace("--search 48 --hold-out x-y", shown) + "<p>--search</p>"
    )
    assert finished('<img alt="a" src="demo.png" />', ROOT / "docs").startswith('<img loading="lazy" width="1')
    assert finished('<img src="guides/gate.svg" />', ROOT / "docs") == '<img src="guides/gate.svg" />'
    assert 'aria-level="2"' in finished('<p class="caption" role="heading">Start</p>', ROOT)


def columns(folder: Path) -> set[str]:
    """The names of the columns of all files of a sequence and its run, with those of the tables of the run."""
    small = ["duration=1", "camera.fps=5", "camera.image=[64, 48]"]
    (made,) = generate(["side-by-side"], range(1), folder / "walks", set=small)
    (sequence,) = open_source(made)
    run = track("blob", sequence, detections="file")
    run.write(folder / "run", sequence)
    files = {name for path in folder.rglob("*.parquet") for name in pq.read_schema(path).names}
    tables = {name for table in run.tables().named().values() for name in table.columns}
    return {name for name in files if not name.startswith("cov_")} | tables


def test_every_name_is_defined_in_the_repository(tmp_path: Path) -> None:
    """In a row of a table of its own."""
    defined = {
        "score": [score.key for score in ALL],
        "kind of error": KINDS,
        "cause": CAUSES,
        "axis": AXES,
        "key": [key["key"] for key in keys_of_scenarios()],
        "scenario or suite": [*names(), *suite_names()],
        "parameter": [name for tracker in trackers() for name in find(tracker).config_class.params()],
        "statistic": [statistic.name for statistic in STATISTICS],
        "column": columns(tmp_path),
    }
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages())
    rows = "\n".join(line for line in text.splitlines() if line.startswith("|"))
    assert not [f"{what} {name}" for what, found in defined.items() for name in found if f"`{name}`" not in rows]
