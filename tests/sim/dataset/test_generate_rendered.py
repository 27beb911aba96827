"""Rendered datasets: one content in every kind of pictures, one truth with and without, the same for any workers."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.loading.resolve import resolve
from sim.dataset.generate import generate
from sim.store.validate import validate
from tests.fake_simulator import content
from tests.processes import python

pytestmark = pytest.mark.slow


SCENE = """
schema = 1
duration = 3.0
world = { walls = [[2, 8, 14, 8]], pillars = [[8, 3, 0.3]] }
camera = { fps = 5 }
group = [
    { id = "a", size = 3, start = [5, 5], goal = [11, 5] },
    { id = "b", size = 2, start = [11, 4], goal = [5, 6], repeat = 1 },
    { id = "alone", size = 1, start = [{ uniform = [6, 10] }, 2], goal = [8, 6], repeat = 3 },
]
"""


def test_however_it_is_made(tmp_path: Path) -> None:
    scene, here, there = tmp_path / "scene.toml", tmp_path / "here", tmp_path / "there"
    scene.write_text(SCENE)
    for entry in resolve(str(scene)):
        generate([entry], range(2), here)
    line = ["generate", scene, "--seeds", "0:2", "--out", there, "--workers", "2", "--json"]
    other = {"PYTHONHASHSEED": "12345", "OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2"}
    done = python("-m", "tracking.app.cli", *line, **other)
    assert done.returncode == 0, done.stdout
    assert content(here) == content(there)
    assert validate(there) == []
    first, second = (p.read_bytes() for p in sorted(there.rglob("truth.parquet")))
    assert first != second
