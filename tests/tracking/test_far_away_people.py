"""What happens far away changes nobody's track: people have random numbers of their own. The one sum over all is the
noise of positions that the belief takes for people who were seen for a short time; here it is held at its start."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Camera, Context, Detections, Frame
from tracking.grouping import person_motion
from tracking.papers.relational.config import ParticleConfig, RelationalConfig
from tracking.papers.relational.tracker import Particle, Relational
from tracking.papers.stereo.tracker import Stereo

FPS, FRAMES = 10.0, 45
CAMERA = Camera("pinhole", (640, 480), (500.0, 500.0), (320.0, 240.0), np.array([0.0, -10.0, 3.0]), np.eye(3))
TRACKERS = {
    "particle": lambda: Particle(ParticleConfig(particles=150)),
    "relational": lambda: Relational(RelationalConfig(particles=150)),
    "state": lambda: Relational(RelationalConfig(particles=150, relation_evidence="state")),
    "stereo": lambda: Stereo(),
}


def walkers(near, seed):
    """Points of two people side by side, who part, by frame; `near` False: of one person 100 m away, who turns."""
    draws = np.random.default_rng(seed)
    for k in range(FRAMES):
        if near:
            true = np.array([[0.12 * k, 0.0], [0.12 * k, 0.8 + 0.08 * max(k - 25, 0)]])
        else:
            true = np.array([[100.0 + 3 * np.sin(k / 10), -40 + 0.1 * k]])
        yield (true + draws.normal(0, 0.06, true.shape))[draws.random(len(true)) > 0.12]


def near_tracks(tracker, context, first, last, shuffled=False):
    """The bytes of the tracks near the origin, by frame; the person far away is detected in frames first to last - 1,
    and comes before or after the others in the detections."""
    tracker.reset(context, 5)
    out, draws = [], np.random.default_rng(3)
    for k, (near, far) in enumerate(zip(walkers(True, 1), walkers(False, 2), strict=True)):
        points = np.concatenate([near, far]) if first <= k < last else near
        if shuffled:
            points = draws.permutation(points)
        if isinstance(tracker, Stereo):
            points = np.column_stack([points, np.zeros(len(points))])
        plane = "space" if isinstance(tracker, Stereo) else "ground"
        found = Detections(k + 1, k / FPS, plane, points, score=np.ones(len(points)))
        tracks = tracker.step(Frame(k + 1, k / FPS), found)
        rows = np.flatnonzero(np.abs(tracks.pos[:, 0]) < 50)
        rows = rows[np.lexsort(tracks.pos[rows].T)]
        out.append([values[rows].tobytes() for values in (tracks.pos, tracks.vel, tracks.cov, tracks.score)])
    return out


@pytest.mark.parametrize("camera", [None, CAMERA], ids=["no camera", "camera"])
@pytest.mark.parametrize("name", TRACKERS)
def test_a_person_far_away_changes_no_track(name, camera, monkeypatch):
    """Who is there from the start, who comes later, and who leaves."""
    monkeypatch.setattr(person_motion, "FIRST", (0.1, 1e30))  # so heavy that no deviation counts
    if name == "stereo" and camera is not None:
        pytest.skip("the camera of stereo has a baseline")
    context = Context(FPS, float("nan"), camera)
    alone = near_tracks(TRACKERS[name](), context, 0, 0)
    assert sum(len(frame[0]) > 0 for frame in alone) > 30
    for first, last in ((0, FRAMES), (17, FRAMES), (0, 20)):
        assert near_tracks(TRACKERS[name](), context, first, last) == alone
