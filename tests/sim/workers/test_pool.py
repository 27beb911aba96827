"""Items that kill their workers, with workers that only pretend to die."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future

import pytest

from scenarios.errors import WorkError
from sim.workers.calls import WorkResult
from sim.workers.pool import process_pool


class PretendedProcess:
    """Takes the place of WorkerProcess: it dies of "bad" items."""

    ended = "exit code 3"

    def submit(self, function: Callable[[str], str], item: str) -> Future[str]:
        future = Future[str]()
        future.set_result(item)
        return future

    def outcome(self, future: Future[str]) -> WorkResult | None:
        return None if future.result() == "bad" else WorkResult(future.result())

    def close(self) -> None:
        pass


@pytest.fixture(autouse=True)
def no_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sim.workers.pool.WorkerProcess", PretendedProcess)


def outcomes(items: list[str]) -> list[str]:
    with process_pool(1) as run:
        return [result for _, result in run(str, items, on_loss=lambda item, error: "lost")]


def test_bad_items_among_good_ones_are_lost_and_no_more() -> None:
    assert outcomes(["bad", "good"] * 5) == ["lost", "good"] * 5


def test_if_nothing_but_deaths_happens_the_fault_is_not_the_items() -> None:
    assert outcomes(["bad"] * 2) == ["lost"] * 2
    with pytest.raises(WorkError, match="killed 3 workers, the last by exit code 3"):
        outcomes(["bad"] * 3)
