"""Which image scale holds: the camera's, the sequence's, the tracker's own, that of boxes."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.scene.camera import px_per_m_at_centre
from sim.scene.visibility import scale_of_all_boxes
from sim.sequence import simulate
from sim.types import Groups, Sequence, Tracks
from tracking.running import image_scale
from tracking.running.image_scale import ImageScale, learned_by
from tracking.running.run import grouped
from tracking.scoring import user_arrays


class Learned:
    def __init__(self, value: object) -> None:
        self.px_per_m = value


@pytest.mark.parametrize("value", [40, 40.0, np.float32(40), np.float64(40), np.int32(40)])
def test_a_trackers_own_scale_is_a_number_of_any_kind(value):
    assert learned_by(Learned(value)) == 40.0
    assert image_scale.from_tracks(ImageScale(float("nan")), learned_by(Learned(value)), ()) == ImageScale(40.0)


@pytest.mark.parametrize("value", [None, True, "40", np.ones(1), float("nan"), np.float32("inf")])
def test_anything_else_is_no_scale(value):
    assert np.isnan(learned_by(Learned(value)))
    assert np.isnan(learned_by(object()))


def side_by_side(index: int) -> Tracks:
    """Two people at rest, 60 px apart in the image."""
    pos = np.array([[200.0, 200.0], [260.0, 200.0]])
    known = np.zeros((2, 2)), np.tile(np.eye(4), (2, 1, 1))
    alone = np.full(2, -1)
    return Tracks(index, index / 10, "image", "person", np.array([1, 2]), alone, pos, *known, groups=Groups.none())


def recording(camera, px_per_m: float, **source) -> Sequence:
    truth = simulate(load("merge", ["camera.fps=2"]), 40_001).truth.replace(px_per_m=20.0)
    return Sequence(
        "made", 10.0, 30, lambda: iter(()), load_truth=lambda: truth, camera=camera, px_per_m=px_per_m, source=source
    )


def test_stored_tracks_are_grouped_by_the_scale_of_the_tracker(monkeypatch):
    """The camera's, else the one that the user states, else that of all labels; as for `track`, but for the last."""
    camera = simulate(load("merge", ["camera.fps=2"]), 40_001).camera
    used = []
    monkeypatch.setattr(
        "tracking.grouping.foot_points.with_groups", lambda tracks, fps, scale, rule: used.append(scale) or tracks
    )
    unknown = float("nan")
    for made in (
        recording(camera, unknown), recording(camera, 55.0), recording(None, 55.0), recording(None, unknown),
        recording(None, 55.0, px_per_m_frames=12), recording(camera, 55.0, px_per_m_frames=12),
    ):  # fmt: skip
        grouped([side_by_side(1)], made)
    seen = px_per_m_at_centre(camera)
    assert used == [seen, seen, 55.0, 20.0, 20.0, seen]


def test_scoring_and_readers_take_the_scale_of_the_truth_alike():
    """`tracking.scoring` stands alone, so that it has the rule of its own."""
    height = np.random.default_rng(0).uniform(20, 90, 33)
    box = np.column_stack([np.zeros((33, 3)), height])
    assert user_arrays._scale(box) == scale_of_all_boxes(height) == np.median(height) / 1.7
    assert np.isnan(scale_of_all_boxes(height[:0]))
