"""The demo's page: links, columns of what is known, videos of people and of groups as wholes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sim.types import Sequence, Tracks
from tests.groups_as_wholes import wholes
from tracking.app.commands.demo import WITHOUT_PEOPLE, PixelScene, ResultSection, demo_page
from tracking.app.commands.score_tables import SequenceScores
from tracking.scoring import evaluate


@pytest.fixture
def rows(sequence: Sequence, tracks: list[Tracks]) -> dict[str, SequenceScores]:
    """What a tracker of people and one of groups get for the same scene."""
    output = {"people": tracks, "groups": wholes(sequence, "ground")}
    return {name: SequenceScores("meeting", evaluate(sequence.truth, answers)) for name, answers in output.items()}


def tables(text: str) -> list[list[list[str]]]:
    """Cells of the heads and bodies."""
    found = []
    for table in re.findall(r"<table>(.*?)</table>", text, re.DOTALL):
        lines = re.findall(r"<tr>(.*?)</tr>", table.partition("<tfoot>")[0], re.DOTALL)
        cells = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", line, re.DOTALL) for line in lines]
        found.append([[re.sub(r"<[^>]*>", "", cell) for cell in line] for line in cells])
    return found


def test_what_is_not_known_of_any_row_has_no_column(rows: dict[str, SequenceScores], tmp_path: Path) -> None:
    both = ResultSection(
        "both", [rows["people"], rows["groups"]], [tmp_path / "a.html", tmp_path / "b.html"], ["p of x", "g of x"]
    )
    films = {"p": tmp_path / "p.mp4", "g": tmp_path / "x" / "g & g.mp4"}
    alone = [
        ResultSection(f"{name} alone", [rows[name]], [tmp_path / f"{name}.html"], [name])
        for name in ("people", "groups")
    ]
    text = demo_page(tmp_path, PixelScene(both, films, 160, 16.0), [], alone)
    first, people, groups = tables(text)
    assert first[0] == people[0]
    assert [cell for cell in people[0] if cell not in groups[0]] == ["HOTA", "MOTA", "IDF1"]
    assert first[2][:4] == ["g of x", "–", "–", "–"]
    assert float(first[1][1]) > 0.5
    assert float(groups[1][1]) > 0
    assert text.count(WITHOUT_PEOPLE) == 1
    assert text.index("groups alone") < text.index(WITHOUT_PEOPLE)
    sources = re.findall(r'(?:href|src)="([^"#]*)', text)
    assert sources == ["p.mp4", "x/g &amp; g.mp4", "a.html", "b.html", "people.html", "groups.html"]
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", text)
    assert ["boxes of people" in words for words in captions] == [True, False]
