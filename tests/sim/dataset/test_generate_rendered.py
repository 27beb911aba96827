"""Rendered datasets: one content in every kind of pictures, one truth with and without, the same for any workers."""

import json
from pathlib import Path

import pytest

from scenarios.loading.resolve import Entry
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
