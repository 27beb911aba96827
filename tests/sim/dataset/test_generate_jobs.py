"""A job can be done twice, by whoever sees the folder, and leaves what is whole alone."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import Entry
from sim.dataset.generate import JobOutcome, SequenceJob, is_stored, run_job, stored_manifest
from sim.store import atomic
from tests.fake_simulator import FakeSimulator, scenario


@pytest.fixture
def made(simulate: FakeSimulator) -> FakeSimulator:
    """A fake simulator; `made.made` are the seeds that it has made."""
    return simulate


@pytest.fixture
def job(tmp_path: Path) -> SequenceJob:
    return SequenceJob(tmp_path / "flockscope-train" / "x-s00001", Entry("x", scenario()), 1)


def content(job: SequenceJob) -> dict[str, tuple[bytes, int]]:
    files = [p for p in job.folder.parent.rglob("*") if p.is_file()]
    return {p.relative_to(job.folder.parent).as_posix(): (p.read_bytes(), p.stat().st_ino) for p in files}


def test_what_is_whole_is_left_alone(job: SequenceJob, made: FakeSimulator) -> None:
    assert stored_manifest(job) is None
    assert run_job(job) == JobOutcome()
    before = content(job)
    assert is_stored(job)
    assert run_job(job) == JobOutcome()
    assert made.made == [1]
    assert content(job) == before


@pytest.mark.parametrize("late", [False, True])
def test_of_two_who_make_it_at_once_the_first_counts(
    job: SequenceJob, made: FakeSimulator, monkeypatch: pytest.MonkeyPatch, late: bool
) -> None:
    """A worker that was thought dead ends first: before ours looks, or between looking and renaming."""
    real, name = (os.rename, "rename") if late else (atomic.write_inside, "write_inside")

    def first_the_other(*args: Any) -> None:
        monkeypatch.setattr(os if late else atomic, name, real)
        assert run_job(job) == JobOutcome()
        others.update(content(job))
        real(*args)

    others: dict[str, tuple[bytes, int]] = {}
    monkeypatch.setattr(os if late else atomic, name, first_the_other)
    assert run_job(job) == JobOutcome()
    assert made.made == [1, 1]
    whole = {k: v for k, v in others.items() if not k.startswith(atomic.PARTIAL)}
    assert content(job) == whole
    assert len(others) == (1 + late) * len(whole)


@pytest.mark.parametrize("name", ["", "thesis.tex", "a/b/thesis.tex"])
def test_a_folder_of_others_is_no_place_for_a_sequence(job: SequenceJob, made: FakeSimulator, name: str) -> None:
    """Before: a folder or file with the name of the sequence was deleted. name: "" for a file."""
    mine = job.folder / name
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    with pytest.raises(InputError, match="something that flockscope did not write"):
        stored_manifest(job)
    assert isinstance(run_job(job).error, InputError)
    assert (mine.read_text(), made.made) == ("mine", [])


DIFFERENCES = [
    ({"camera": {"fps": 5}}, {"streams": ("left",)}, r"scenario \w{8}, streams \[.*\], images \w+"),
    ({"about": "1.2.0"}, {}, r"scenario \w{8}"),
    ({}, {"stride": 4}, "stride [14]"),
]


@pytest.mark.parametrize(("more", "change", "words"), DIFFERENCES)
def test_what_differs_is_named(
    job: SequenceJob, made: FakeSimulator, more: dict[str, Any], change: dict[str, Any], words: str
) -> None:
    run_job(job)
    other = SequenceJob(job.folder, Entry("x", scenario(**more)), 1, **change)
    with pytest.raises(InputError) as refused:
        stored_manifest(other)
    assert re.fullmatch(f"a sequence of {words}", refused.value.got)
    assert re.fullmatch(words, refused.value.expected)
    assert refused.value.expected not in refused.value.got
