"""Datasets of a simulator that makes random sequences."""

from __future__ import annotations

import sys

import pytest

from tests.fake_simulator import FakeSimulator


@pytest.fixture
def simulate(monkeypatch: pytest.MonkeyPatch) -> FakeSimulator:
    fake = FakeSimulator()
    monkeypatch.setitem(sys.modules, "sim.sequence", fake)
    return fake
