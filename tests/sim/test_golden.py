"""The same scenario, seed and environment give the truth they gave before, to the last bit (benchmarks/golden.py)."""

from __future__ import annotations

import pytest

from benchmarks import golden
from scenarios.loading.resolve import names
from sim.hashing import ENGINE


@pytest.fixture(scope="module")
def kept() -> dict[str, dict[str, str]]:
    """The golden hashes of this environment."""
    file, here = golden.golden_file(), golden.environment()
    if not golden.FILE.is_file():
        pytest.skip(f"no golden hashes are kept; {golden.WRITE}")
    assert file["engine"] == ENGINE, f"golden hashes are of engine {file['engine']}; {golden.WRITE}"
    if here not in file["environments"]:
        pytest.skip(f"no golden hashes for {here}; on an unchanged checkout, {golden.WRITE}")
    return file["environments"][here]


@pytest.mark.parametrize("name", names())
def test_truth_is_as_it_was(name: str, kept: dict[str, dict[str, str]]) -> None:
    assert golden.difference(name, kept.get(name), golden.present_hashes(name)) == ""


def test_what_has_changed_is_told_apart() -> None:
    one = {"scenario": "a", "truth": "b"}
    assert golden.difference("x", one, dict(one)) == ""
    assert "no golden hash" in golden.difference("x", None, one)
    assert "scenario has changed" in golden.difference("x", one, {"scenario": "c", "truth": "d"})
    assert "raise sim.hashing.ENGINE" in golden.difference("x", one, {"scenario": "a", "truth": "d"})
