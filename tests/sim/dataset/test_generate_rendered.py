"""Rendered datasets: one content in every kind of pictures, one truth with and without, the same for any workers."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from scenarios.loading.resolve import Entry, resolve
from scenarios.schema.scenario import Scenario
from sim.dataset.generate import generate
from sim.io.store.validate import validate
from sim.workers.start import WorkerOptions

pytestmark = pytest.mark.slow

ALL = ("left", "right", "disparity", "ids")
SCENARIO = Scenario.model_validate(
    {
        "schema": 1, "duration": 1.0, "warmup": 0.5,
        "camera": {"image": [128, 96], "fps": 10, "focal_px": 110, "baseline": 0.2},
        "picture": {"noise": 2.0},
        "group": [
            {"id": "a", "size": 2, "start": [6, 5], "goal": [10, 5]},
            {"id": "b", "start": [8, 7], "goal": [8, 3]},
        ],
    }
)  # fmt: skip


def made(out: Path, streams=ALL, images="jpg", workers=1) -> tuple[list[dict], dict[str, bytes]]:
    folders = generate(
        [Entry("x", SCENARIO)], range(2), out, streams=streams, images=images, workers=WorkerOptions(workers)
    )
    assert validate(out) == []
    body = {str(p.relative_to(out)): p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}
    return [json.loads((f / "manifest.json").read_text()) for f in folders], body


def test_one_content_in_every_kind(tmp_path):
    found = {images: made(tmp_path / images, images=images)[0] for images in ("jpg", "png", "mp4")}
    bare, _ = made(tmp_path / "none", streams=())
    for k in range(2):
        for key in ("truth_hash", "content_hash", "pixels"):
            assert found["jpg"][k][key] == found["png"][k][key] == found["mp4"][k][key]
        assert bare[k]["truth_hash"] == found["jpg"][k]["truth_hash"]
    assert found["jpg"][0]["pixels"]["left"] != found["jpg"][1]["pixels"]["left"]


ROOT = Path(__file__).resolve().parents[3]
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


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_however_it_is_made(tmp_path: Path) -> None:
    scene, here, there = tmp_path / "scene.toml", tmp_path / "here", tmp_path / "there"
    scene.write_text(SCENE)
    for entry in resolve(str(scene)):
        generate([entry], range(2), here)
    line = ["generate", str(scene), "--seeds", "0:2", "--out", str(there), "--workers", "2", "--json"]
    other = {"PYTHONHASHSEED": "12345", "OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-m", "tracking.app.cli", *line], env={**os.environ, **other}, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stdout
    assert content(here) == content(there)
    assert validate(there) == []
    first, second = (p.read_bytes() for p in sorted(there.rglob("truth.parquet")))
    assert first != second
