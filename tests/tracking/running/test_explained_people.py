"""Evidence is taken where groups are derived: on the ground below boxes, in metres, before groups are known."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Camera, Sequence, Truth
from tests.boxed_people import CAMERA, boxed, place
from tracking.grouping.belief import default_belief
from tracking.running.explained_people import explained_people
from tracking.running.run import TrackingRun, group

APART = {"near": 2.0, "far": 14.0}  # y of two people, m, who walk beside each other, 1 m apart


def sequence_of(truth: Truth, camera: Camera | None = CAMERA) -> Sequence:
    return Sequence("two", truth.fps, truth.length, lambda: iter(()), lambda: truth, camera=camera, px_per_m=40.0)


@pytest.mark.parametrize("y", APART.values(), ids=APART)
def test_boxes_are_on_the_ground_of_the_camera(y: float) -> None:
    truth = place(y)
    run = TrackingRun(tuple(boxed(truth)))
    found = explained_people(sequence_of(truth), run, default_belief())
    np.testing.assert_allclose(found.values[:, 0], 1.0, atol=0.06)
    assert found.ids.tolist() == [1, 2]


def test_groups_that_are_known_change_nothing() -> None:
    """The same evidence from a stored run whose groups are derived as from the run before."""
    truth = place(*APART.values(), 7.0)
    sequence, before = sequence_of(truth, camera=None), TrackingRun(tuple(boxed(truth)))
    after = group(sequence, before)
    assert after.info["ground"] == "boxes"
    assert (after[-1].group > 0).all()
    one, two = (explained_people(sequence, run, default_belief()) for run in (before, after))
    np.testing.assert_array_equal(one.values, two.values)
    assert one.people == two.people


def test_labels_and_the_groups_of_labels_are_the_same_people() -> None:
    truth = place(6.0)
    sequence = sequence_of(truth)
    one, two = (explained_people(sequence, run, default_belief()) for run in (None, group(sequence)))
    assert one.people == two.people
    np.testing.assert_array_equal(one.log_odds, two.log_odds)


def test_whole_groups_and_pixels_without_a_scale_have_no_evidence() -> None:
    truth = place(6.0)
    tracks = boxed(truth)
    wholes = TrackingRun(tuple(t.replace(unit="group") for t in tracks))
    with pytest.raises(InputError, match="people with ids"):
        explained_people(sequence_of(truth), wholes, default_belief())
    bare = TrackingRun(tuple(t.replace(box=None) for t in tracks))
    flat = Sequence("two", truth.fps, truth.length, lambda: iter(()), px_per_m=float("nan"))
    with pytest.raises(InputError, match="px_per_m"):
        explained_people(flat, bare, default_belief())
