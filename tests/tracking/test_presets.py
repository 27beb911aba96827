"""Every preset of every tracker runs over every scenario of the catalogue, and over every recording.

A preset switches off what keeps a tracker from failing, such as misses and false alarms; it must go on all the same.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from scenarios.loading.resolve import load
from scenarios.loading.toml_files import names as scenario_names
from sim.sequence import simulate
from sim.types import DetectionMode, Sequence
from tracking.config import presets
from tracking.recordings.source import open_source
from tracking.running.prepare import prepare
from tracking.running.tracker_registry import find, names

PRESETS = [(tracker, preset) for tracker in names() for preset in presets(tracker)]
# Numbers of particles that replace a preset's.
SMALL = {"particles": 50, "partitions": 10}


def run(tracker: str, preset: str, sequence: Sequence, length: int, mode: DetectionMode) -> int:
    """Runs the preset with few particles over the first frames, and returns how many tracks it reported."""
    config = find(tracker).config_class.load(preset)
    small = {key: value for key, value in SMALL.items() if key in config.params()}
    short = replace(sequence, frames=lambda: islice(sequence.frames(), length), bare=None, length=length)
    ready = prepare(tracker, short, params=replace(config, **small), detections=mode)
    ready.reset(0)
    tracks = [ready.step(frame) for frame in ready.frames()]
    assert all(np.isfinite(a).all() for t in tracks for a in (t.pos, t.vel, t.cov, t.score))
    return sum(len(t.id) for t in tracks)


@pytest.mark.parametrize("scenario", scenario_names())
def test_presets_run_over_scenarios(scenario: str) -> None:
    """From points, two frames a second: people come, go and hide within few frames."""
    sequence = simulate(load(scenario, ["camera.fps=2"]), 40_001, 0, ())
    for tracker, preset in PRESETS:
        run(tracker, preset, sequence, 30, "file")


@pytest.mark.slow
@pytest.mark.parametrize("scenario", scenario_names())
def test_presets_run_over_pictures(scenario: str) -> None:
    settings = ["camera.fps=5", "camera.image=[160,120]"]
    sequence = simulate(load(scenario, settings), 40_001, 0, ("left", "right", "background"))
    for tracker, preset in PRESETS:
        run(tracker, preset, sequence, 12, "image")


# Recordings with labels, and their frame rates.
RECORDINGS = {
    "biwi/seq_hotel": 2.5, "biwi/zara01": 2.5, "caviar/mwt1gt.xml": 25, "mot/PETS09-S2L1-first200": 7,
    "mot/TUD-Campus": 25, "mot/AVG-TownCentre-first225": 2.5,
}  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*scores from:UserWarning")
@pytest.mark.parametrize("recording", RECORDINGS)
@pytest.mark.parametrize(("tracker", "preset"), PRESETS)
def test_presets_run_over_recordings(shared_data: Path, recording: str, tracker: str, preset: str) -> None:
    if recording.startswith("biwi") and "points" not in find(tracker).needs:
        pytest.skip("the recording has no boxes")
    (sequence,) = open_source(shared_data / recording, images=False, fps=RECORDINGS[recording])
    assert run(tracker, preset, sequence, sequence.length or 2000, "truth") > 0
