"""Answers in another plane or unit than they say end the run; what trackers of ours report does not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from scenarios.errors import WorkError
from scenarios.loading.resolve import load
from sim.scene.body import PERSON_HEIGHT
from sim.scene.camera import project
from sim.sequence import simulate
from sim.types import Context, Detections, Frame, Sequence, Tracks
from tests.reference_sense import pinhole
from tests.tracking.running.test_run import Stranger
from tracking.running.plane_check import COMPARED, PlaneCheck
from tracking.running.run import track
from tracking.scoring import evaluate


@pytest.fixture(scope="module")
def scene() -> Sequence:
    return simulate(load("crowd", ["camera.fps=5"]), 30_000)


@pytest.fixture(scope="module")
def flat(scene: Sequence) -> Sequence:
    """The same without camera: a recording with boxes in the image."""
    truth = scene.truth
    assert truth is not None
    images = truth.replace(pos=None, vel=None, groups=None)
    return Sequence(
        "flat",
        scene.fps,
        scene.length,
        scene.frames,
        lambda: images,
        scene.image_size,
        px_per_m=40.0,
        has_detections=True,
    )


def centres(d: Detections) -> np.ndarray:
    assert d.box is not None
    return d.box[:, :2] + d.box[:, 2:] / 2


def corners(d: Detections) -> np.ndarray:
    assert d.box is not None
    return np.hstack([d.box[:, :2], d.box[:, :2] + d.box[:, 2:]])


def shares(d: Detections) -> np.ndarray:
    assert d.box is not None
    return d.box / np.tile([640, 480], 2)


def answered(needs: tuple[str, ...], step: Callable[[Frame, Detections, np.ndarray], Tracks]) -> type[Stranger]:
    """A tracker that makes its answer from the detections by `step`, which also gets row numbers as ids."""

    class Answering(Stranger):
        def step(self, frame: Frame, detections: Detections | None) -> Tracks:
            assert detections is not None
            return step(frame, detections, np.arange(len(detections.pos)))

    Answering.needs = needs
    return Answering


WRONG = {
    "px copied to the ground": lambda f, d, i: Tracks.of_points(f, i, centres(d), plane=d.plane),
    "px on the ground, with boxes": lambda f, d, i: Tracks.of_points(f, i, centres(d), box=d.box),
    "metres in the image": lambda f, d, i: Tracks.of_points(f, i, d.pos, plane="image"),
    "metres in the image, with boxes": lambda f, d, i: Tracks.of_points(f, i, d.pos, plane="image", box=d.box),
    "corners as sizes": lambda f, d, i: Tracks.of_boxes(f, i, corners(d)),
    "corners as sizes, on the ground": lambda f, d, i: Tracks.of_points(f, i, d.pos, box=corners(d)),
    "shares of the picture": lambda f, d, i: Tracks.of_boxes(f, i, shares(d)),
    "shares of the picture, on the ground": lambda f, d, i: Tracks.of_points(f, i, d.pos, box=shares(d)),
    "centimetres": lambda f, d, i: Tracks.of_points(f, i, 100 * d.pos),
    "feet": lambda f, d, i: Tracks.of_points(f, i, d.pos / 0.3048),
    "axes of the other sign": lambda f, d, i: Tracks.of_points(f, i, -d.pos),
}


@pytest.mark.parametrize("name", WRONG)
def test_answers_in_a_wrong_unit_end_the_run(scene: Sequence, name: str) -> None:
    with pytest.raises(WorkError) as caught:
        track(answered(("boxes",), WRONG[name]), scene, detections="file")
    error = caught.value
    assert "frame" in error.place
    assert int(error.place.split("frame ")[1]) <= COMPARED  # as soon as enough people were seen
    assert all([error.got, error.expected, "Tracks.of_boxes" in error.remedy])


def test_points_in_metres_are_not_px(scene: Sequence) -> None:
    wrong = answered(("points",), lambda f, d, i: Tracks.of_points(f, i, d.pos, plane="image"))
    with pytest.raises(WorkError, match='plane "image"'):
        track(wrong, scene, detections="file")


@pytest.mark.parametrize("needs", [("boxes",), ("points",)])
def test_px_are_not_the_ground_of_a_recording_without_a_camera(flat: Sequence, needs: tuple[str, ...]) -> None:
    wrong = answered(needs, lambda f, d, i: Tracks.of_points(f, i, d.pos, plane="ground"))
    with pytest.raises(WorkError, match='plane "ground"'):
        track(wrong, flat, detections="truth")
    own = answered(needs, lambda f, d, i: Tracks.of_points(f, i, d.pos * [0.02, 0.03] - 9, plane="ground"))
    assert len(track(own, flat, detections="truth")) == flat.length  # of a tracker that knows the ground


@pytest.mark.parametrize("name", ["corners as sizes", "shares of the picture"])
def test_without_a_camera_boxes_are_compared_with_the_detections(flat: Sequence, name: str) -> None:
    with pytest.raises(WorkError, match="boxes like the detections'"):
        track(answered(("boxes",), WRONG[name]), flat, detections="file")


RIGHT = {
    "boxes": lambda f, d, i: Tracks.of_boxes(f, i, d.box, d.score),
    "points": lambda f, d, i: Tracks.of_points(f, i, d.pos, plane=d.plane),
    "both": lambda f, d, i: Tracks.of_points(f, i, d.pos, d.score, plane=d.plane, box=d.box),
}


@pytest.mark.parametrize("name", RIGHT)
def test_the_remedy_works(scene: Sequence, flat: Sequence, name: str) -> None:
    for sequence in (scene, flat):
        run = track(answered(("boxes",), RIGHT[name]), sequence, detections="truth")
        assert sequence.truth is not None
        assert evaluate(sequence.truth, run)["DetRe"] > 0.98


def test_people_who_leave_the_detections_behind_are_no_fault(scene: Sequence) -> None:
    """A tracker that is right at first may carry people on, or lose its way: its scores tell."""
    wrong = answered(
        ("boxes",), lambda f, d, i: Tracks.of_points(f, i, d.pos + (1e3 if f.index > 5 else 0.0), plane=d.plane)
    )
    assert len(track(wrong, scene, detections="file")) == scene.length


def test_lists_fill_all_fields() -> None:
    frame = Frame(3, 0.2)
    t = Tracks.of_boxes(frame, [4, 7], [[0, 0, 10, 20], [5, 5, 10, 20]], [0.5, 1.0], seen=np.array([True, False]))
    assert (t.index, t.t, t.plane, t.unit) == (3, 0.2, "image", "person")
    assert (t.id.tolist(), t.pos.tolist(), t.score.tolist()) == ([4, 7], [[5, 10], [10, 15]], [0.5, 1.0])
    assert (t.group.tolist(), t.seen.tolist(), t.cov.shape) == ([-1, -1], [True, False], (2, 4, 4))
    assert np.isnan(t.vel).all()
    for none in (Tracks.of_boxes(frame, [], []), Tracks.of_points(frame, [], [])):
        assert (none.id.dtype, none.pos.shape, none.cov.shape) == (np.int64, (0, 2), (0, 4, 4))
    assert Tracks.of_points(frame, [1], [[1.0, 2.0, 0.5]], plane="space").vel.shape == (1, 3)


def test_a_plane_that_is_wrong_from_a_later_frame_on_ends_the_run(scene: Sequence) -> None:
    class Later:
        needs = ("boxes",)

        def reset(self, context: object, seed: int) -> None: ...

        def step(self, frame: Frame, d: Detections) -> Tracks:
            id = 100 * frame.index + np.arange(len(d.pos))
            pos = d.pos if frame.index < 15 else centres(d)  # px, said to be metres
            return Tracks.of_points(frame, id, pos, plane="ground", box=d.box)

    with pytest.raises(WorkError, match=r"frame 20.*expected people in m"):
        track(Later(), scene, detections="file")


@pytest.mark.parametrize("fits", [True, False])
def test_positions_in_the_image_are_compared_with_the_middles_of_bodies(fits: bool) -> None:
    camera, check = pinhole(), PlaneCheck()
    points = np.column_stack([np.linspace(4, 12, COMPARED), np.full(COMPARED, 3.0)])
    middle, _ = project(camera, np.column_stack([points, np.full(COMPARED, PERSON_HEIGHT / 2)]))
    pos = middle - np.array([0.0, 60.0 if fits else 150.0])  # a person is 76 px high
    given = Detections(1, 0.0, "ground", points, None, None, np.ones(COMPARED))
    none, zero, cov = np.full(COMPARED, -1), np.zeros((COMPARED, 2)), np.zeros((COMPARED, 4, 4))
    t = Tracks(1, 0.0, "image", "person", np.arange(COMPARED), none, pos, zero, cov, None, np.ones(COMPARED))
    if fits:
        check.check(t, given, Context(10.0, 45.0, camera), "mine", "made")
        assert check.fitting == COMPARED
    else:
        with pytest.raises(WorkError, match="made, frame 1"):
            check.check(t, given, Context(10.0, 45.0, camera), "mine", "made")
