"""Processes that begin fresh with one thread each, and end when they should."""

from __future__ import annotations

import math
import os
import time

import pytest

from scenarios.errors import WorkError
from sim.workers import THREADS, pool


def test_every_item_with_its_result() -> None:
    with pool(2) as run:
        assert sorted(run(math.sqrt, [9.0, 4.0, 16.0])) == [(4.0, 2.0), (9.0, 3.0), (16.0, 4.0)]
        assert list(run(math.sqrt, [])) == []


def test_one_thread_each_and_the_environment_is_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    before = dict(os.environ)
    with pool(1) as run:
        assert dict(run(os.getenv, list(THREADS))) == dict.fromkeys(THREADS, "1")
    assert dict(os.environ) == before


def test_a_worker_that_dies_is_one_clear_error() -> None:
    with pytest.raises(WorkError, match="a worker that died"), pool(1) as run:
        list(run(os._exit, [3]))


def test_an_error_ends_what_the_others_are_at() -> None:
    """Half an hour of it, here; a negative time is refused at once."""
    with pytest.raises(ValueError, match="non-negative"), pool(2) as run:
        list(run(time.sleep, [1800.0, -1.0]))
