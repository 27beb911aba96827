"""A stride leaves frames of the camera out; those that stay are as they are without it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.dataset.generate import generate
from sim.sequence import simulate
from sim.types import Truth

ROWS = ("pos", "vel", "box", "visibility", "z", "heading", "height", "truncation")


def same_rows(every: Truth, kept: Truth, stride: int) -> None:
    there = (every.frame - 1) % stride == 0
    assert ((every.frame[there] - 1) // stride + 1).tolist() == kept.frame.tolist()
    assert every.id[there].tolist() == kept.id.tolist()
    for name in ROWS:
        np.testing.assert_array_equal(getattr(every, name)[there], getattr(kept, name), name)


@pytest.mark.parametrize("stride", [7, 500])
def test_common_frames_are_equal(stride: int) -> None:
    """People, boxes and detections; the camera, too, which another camera.fps would place elsewhere."""
    scenario = load("merge")
    every, kept = simulate(scenario, 5, streams=()), simulate(scenario, 5, streams=(), stride=stride)
    assert (kept.fps, kept.length) == (every.fps / stride, -(-every.length // stride))
    assert (kept.camera.position == every.camera.position).all()
    same_rows(every.truth, kept.truth, stride)
    for d, k in zip(list(every)[::stride], kept, strict=True):
        assert k.t == k.detections.t == pytest.approx(d.t, abs=1e-12)
        np.testing.assert_array_equal(d.detections.pos, k.detections.pos)
        np.testing.assert_array_equal(d.detections.box, k.detections.box)


def test_labels_are_those_of_a_camera_with_this_frame_rate() -> None:
    kept = simulate(load("merge"), 5, streams=(), stride=4).truth
    slow = simulate(load("merge", ["camera.fps=2.5"]), 5, streams=()).truth
    assert [(e.kind, e.start, e.end, e.members) for e in kept.events] == [
        (e.kind, e.start, e.end, e.members) for e in slow.events
    ]
    assert kept.group.tolist() == slow.group.tolist()
    assert kept.orders == slow.orders


@pytest.mark.parametrize("stride", [0, -1, 1001, 2.0])
def test_a_stride_without_frames_is_refused(stride: int, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--stride: got .*; expected a whole number from 1 to 1000 at 10 frames/s"):
        simulate(load("merge"), 5, streams=(), stride=stride)
    with pytest.raises(InputError, match="--stride"):
        generate(["merge"], range(1), tmp_path / "data", streams=(), stride=stride)
    assert not (tmp_path / "data").exists()
