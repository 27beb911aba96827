"""One call for work in this process and in others; what a dead worker was at is done again."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from scenarios.errors import WorkError
from sim.workers.calls import THREAD_VARIABLES
from sim.workers.pool import MAX_LOSSES, process_pool
from sim.workers.start import results_in_order, start_workers
from tests.errands import complain, fall, fall_at_first, hide, process, root_of, told


@pytest.mark.parametrize("workers", [1, 2])
def test_every_item_with_its_result(workers: int) -> None:
    with start_workers(workers) as run:
        assert sorted(run(root_of, [9.0, 4.0, 16.0])) == [(4.0, 2.0), (9.0, 3.0), (16.0, 4.0)]
        assert list(run(root_of, [])) == []


@pytest.mark.parametrize("workers", [1, 3])
def test_items_are_taken_when_there_is_somebody_to_do_them(workers: int) -> None:
    taken, seen = [], []

    def items() -> Iterator[int]:
        for k in range(12):
            assert len(taken) - len(seen) < workers
            taken.append(k)
            yield k

    with start_workers(workers) as run:
        for k, _ in run(process, items()):
            seen.append(k)
    assert sorted(seen) == list(range(12))


def test_one_thread_each_and_the_environment_is_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREAD_VARIABLES", "7")
    monkeypatch.delenv("MKL_NUM_THREAD_VARIABLES", raising=False)
    before = dict(os.environ)
    with process_pool(1) as run:
        assert dict(run(os.getenv, list(THREAD_VARIABLES))) == dict.fromkeys(THREAD_VARIABLES, "1")
    assert dict(os.environ) == before


def test_the_work_of_dead_workers_is_done_again(tmp_path: Path) -> None:
    markers = [tmp_path / str(k) for k in range(4)]
    with process_pool(2) as run:
        assert sorted(run(fall_at_first, markers)) == [(m, m.name) for m in markers]


def test_an_item_that_kills_all_its_workers_is_one_clear_error() -> None:
    with (
        pytest.raises(WorkError, match=f"got an item that killed {MAX_LOSSES} workers, the last by exit code 3"),
        process_pool(2) as run,
    ):
        list(run(fall, [0, 3, 2]))


@pytest.mark.parametrize("workers", [1, 3])
def test_results_in_the_order_of_the_items_whoever_was_first(workers: int, tmp_path: Path) -> None:
    items = [(tmp_path / str(k), seconds) for k, seconds in enumerate((0.5, 0.0, 0.2, 0.0))]
    with start_workers(workers) as run:
        assert list(results_in_order(run, told, items)) == ["0", "1", "2", "3"]
        assert list(results_in_order(run, told, [])) == []


def test_what_cannot_be_sent_back_is_an_error_not_a_death() -> None:
    with pytest.raises(TypeError, match="pickle"), process_pool(1) as run:
        list(run(hide, [0]))
    with pytest.raises(RuntimeError, match="Awkward: ab"), process_pool(1) as run:
        list(run(complain, [0]))
