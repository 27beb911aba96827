"""Sequences on several processes: order, warnings and errors are those of one process."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import pytest

from scenarios.errors import InputError, WorkError
from sim.types import Sequence
from tests.short_scene import write_short_scene
from tracking.app.cli import run
from tracking.app.sequence_workers import OpenedAs, over_sequences


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("workers")
    write_short_scene(folder, "0:4")
    return folder / "data"


def named(sequence: Sequence, job: str) -> str:
    warnings.warn(f"{sequence.name} warns", stacklevel=2)
    if job == "fail":
        raise InputError(got=sequence.name, expected="a", remedy="b")
    if job == "die":
        os._exit(3)
    return f"{job} on {sequence.name}"


def outcome(data: Path, jobs: list[str], workers: int) -> tuple[list[str], list[str], str]:
    """Results, warnings and error."""
    source, found, error = OpenedAs(data), list[str](), ""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            for one in over_sequences(named, source.open(), jobs, source, workers):
                found.append(one)
        except (InputError, WorkError) as failure:
            error = failure.line()
    return found, [str(w.message) for w in caught], error


@pytest.mark.parametrize("jobs", [["a", "b", "c", "d"], ["a", "b", "fail", "d"]])
def test_two_workers_are_one(data: Path, jobs: list[str]) -> None:
    alone, both = (outcome(data, jobs, n) for n in (1, 2))
    assert alone == both
    assert alone[0][:2] == ["a on scene-s00000", "b on scene-s00001"]


def test_a_sequence_that_kills_its_worker_is_named(data: Path) -> None:
    found, _, error = outcome(data, ["a", "die", "c", "d"], 2)
    assert found == ["a on scene-s00000"]
    assert error.startswith("scene-s00001: got an item that killed 3 workers")


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_files_of_track_are_the_same(data: Path, tmp_path: Path) -> None:
    tracker = f"{Path(__file__).resolve().parents[2] / 'fake_tracker.py'}:Nearest"
    for n in "12":
        assert run(["track", tracker, str(data), "--workers", n, "--out", str(tmp_path / n)]) == 0
    files = [p.relative_to(tmp_path / "1") for p in sorted((tmp_path / "1").rglob("*")) if p.is_file()]
    assert len(files) > 4 * 4
    for file in files:
        if file.name != "run.json":  # it holds speeds
            assert (tmp_path / "1" / file).read_bytes() == (tmp_path / "2" / file).read_bytes(), file
