"""The brightness of a sequence's frames: drawn again from the stored scenario, without clouds and flicker."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sim
from scenarios import load
from scenarios.loading.toml_files import dump
from sim.store.sequence_folder import open_sequence, write_sequence
from sim.types import Array

SWITCH = "light.switch=[{at = 4.0, gain = 0.5, ramp = 0.0}]"
STEADY = ["light.drift=0", "light.flicker=0.3", "camera.fps=5"]


def brightness(*set: str, stride: int = 1) -> Array:
    made = sim.simulate(load("merge", [*STEADY, *set]), 3, streams=(), stride=stride)
    return made.load_light()


@pytest.mark.parametrize("stride", [1, 5])
def test_a_switch(stride: int) -> None:
    light = brightness(SWITCH, stride=stride)
    first = 4 * 5 // stride  # row of the frame at 4 s
    assert np.allclose(light[:first], 1)
    assert np.allclose(light[first:], 0.5)


def test_drift_is_kept() -> None:
    assert np.ptp(brightness("light.drift=0.1", "light.drift_time=2")) > 0.05


def test_a_stored_sequence_has_the_same(tmp_path: Path) -> None:
    scenario = load("lights", ["camera.fps=5"])
    live = sim.simulate(scenario, 3, streams=())
    write_sequence(tmp_path / "s", live, scenario=dump(scenario), seed=3)
    stored = open_sequence(tmp_path / "s").load_light()
    assert np.array_equal(stored, live.load_light())
    assert len(stored) == live.length
