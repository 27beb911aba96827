"""Docstrings and comments cite the paper as "sec. 4.3", "eq. 7", "Fig. 2", and only what the paper has."""

from __future__ import annotations

import io
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[4]
PLACES = "papers/blob/*.py", "detect/*.py", "filters/kalman.py", "filters/track_uncertainty.py", "filters/assignment.py"
FILES = sorted(file for place in PLACES for file in (ROOT / "tracking").glob(place))
SECTION = re.compile(r"(?<![\w.\-/])(?:3\.[1-3]|4\.[1-5])(?![\w.]|\s*(?:m|px|sigmas?|standard)\b)")
CITED = re.compile(r"(?:secs?\.|sections?) (?:\d(?:\.\d)?(?:, | to | and ))*$")
EQUATION = re.compile(r"\beqs?\.? (\d+)")


def prose(file: Path) -> str:
    """Returns the docstrings and comments of a file, one below the other, as single lines."""
    tokens = tokenize.generate_tokens(io.StringIO(file.read_text(encoding="utf-8")).readline)
    kinds = {tokenize.COMMENT}
    texts = [t.string for t in tokens if t.type in kinds or (t.type == tokenize.STRING and '"""' in t.string)]
    return "\n".join(" ".join(text.split()) for text in texts)


@pytest.mark.parametrize("file", FILES, ids=lambda f: f.stem)
def test_sections_and_equations_are_cited_in_one_form(file: Path) -> None:
    text = prose(file)
    bare = [
        text[max(m.start() - 40, 0) : m.end() + 10]
        for m in SECTION.finditer(text)
        if not CITED.search(text[: m.start()])
    ]
    assert bare == []
    assert "eqs. " not in text
    assert all(1 <= int(number) <= 10 for number in EQUATION.findall(text) if "." not in number)
