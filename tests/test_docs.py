"""Links of the documents lead somewhere, and their generated tables and lists are those that the code prints."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from scenarios.loading.resolve import load, names, resolve, suite_names
from scenarios.loading.suites import about, find_suite
from tracking.app.commands.scenarios import list_keys
from tracking.app.commands_page import command_sections
from tracking.app.constants_page import constants_table
from tracking.detect.background_settings import BackgroundSettings
from tracking.environment import observation
from tracking.grouping.link_rule import LinkRule
from tracking.papers.blob.config import BlobConfig
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.joint.config import JointConfig
from tracking.papers.relational.config import RelationalConfig
from tracking.papers.stereo.config import StereoConfig
from tracking.scoring import catalogue

ROOT = Path(__file__).resolve().parents[1]
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
        assert not anchor or target.suffix != ".md" or anchor in anchors(target), f"{link}: no such heading"


TABLES = {
    "commands.md": command_sections,
    "environment.md": observation.table,
    "foreground.md": BackgroundSettings.table,
    "grouping.md": LinkRule.table,
    "metrics.md": catalogue.table,
    "scenario-files.md": lambda: f"```\n{list_keys().text.rstrip()}\n```",
    "trackers/blob.md": BlobConfig.table,
    "trackers/group-pda.md": GroupPdaConfig.table,
    "trackers/group-pda.md#constants": lambda: constants_table("group_pda"),
    "trackers/joint.md": JointConfig.table,
    "trackers/joint.md#constants": lambda: constants_table("joint"),
    "trackers/relational.md": RelationalConfig.table,
    "trackers/relational.md#constants": lambda: constants_table("relational"),
    "trackers/stereo.md": StereoConfig.table,
}
REFERENCE = ROOT / "docs" / "reference"


@pytest.mark.parametrize("page", TABLES)
def test_a_page_holds_its_generated_table(page: str) -> None:
    """CONTRIBUTING.md says which command prints it."""
    text = (REFERENCE / page.partition("#")[0]).read_text(encoding="utf-8")
    assert TABLES[page]() in text, f"put the printed table into docs/reference/{page}"


def test_scenarios_and_suites_are_listed() -> None:
    page = (REFERENCE / "scenario-files.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([a-z-]+)` \|", page, re.MULTILINE)
    assert rows == names()
    assert all(f"| `{name}` | {load(name).about} |" in page for name in rows)
    rows = re.findall(r"^\| suite `(.+)` \| (\d+) \| (.+) \|$", page, re.MULTILINE)
    suites = [(name, find_suite(name)) for name in suite_names()]
    assert rows == [(name, str(len(resolve(f"suite:{name}"))), about(file)) for name, file in suites]
    assert all(row["meaning"] for row in list_keys().data["keys"])


def test_the_example_of_the_guide_loads(tmp_path: Path) -> None:
    guide = (ROOT / "docs" / "guides" / "write-a-scenario.md").read_text(encoding="utf-8")
    example = re.findall(r"^```toml\n(.*?)^```$", guide, re.DOTALL | re.MULTILINE)
    (tmp_path / "example.toml").write_text(example[0])
    assert [e.id for e in load(tmp_path / "example.toml").event] == ["m1", "s1"]
