"""Figures with limbs: proportions, gait, and the place of each part."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.scene import figure
from sim.scene.body import DEPTH_SHARE, SHOULDER_SHARE, placed
from sim.scene.figure import Parts, limbs, things, with_worn

FEET = slice(9, 11)


def person(phase: float, swing: float, height: float = 1.7) -> Parts:
    one = np.ones(1)
    return limbs(height * one, SHOULDER_SHARE * height * one, DEPTH_SHARE * height * one, phase * one, swing * one)


def lowest(parts: Parts) -> np.ndarray:
    shapes = placed(np.zeros((1, 3)), np.zeros(1), parts)
    return (shapes.centre[..., 2] - np.sqrt(shapes.shape[..., 2, 2]))[0]


@given(st.floats(0, 6.3), st.floats(0, 1.1))
def test_the_lower_foot_is_on_the_ground_and_the_head_is_nearly_at_the_height(phase: float, swing: float) -> None:
    parts = person(phase, swing)
    assert lowest(parts).min() == pytest.approx(0, abs=1e-9)
    assert lowest(parts).argmin() in (9, 10)
    top = parts.offset[0, 1, 2] + parts.half[0, 1, 2]
    assert 1.7 - 0.12 < top < 1.7 + 0.01


def test_feet_are_apart_by_half_a_step_at_most_when_standing_and_by_a_step_when_walking() -> None:
    for phase, share in ((0.0, 1.0), (1.0, np.cos(1.0))):
        assert np.ptp(person(phase, 0.0).offset[0, FEET, 1]) == pytest.approx(0.23 * share, abs=0.02)
    assert 0.5 < np.ptp(person(0.0, 1.0).offset[0, FEET, 1]) < 0.8  # m, of a person of 1.7 m


@pytest.mark.parametrize("swing", [0.0, 1.0])
def test_boxes_of_people_seen_from_the_side_are_neither_sticks_nor_splits(swing: float) -> None:
    """Labels of people in PETS09-S2L1 are 0.29 to 0.41 of their height wide (5 to 95 %), with a margin at each side."""
    for phase in np.linspace(0, 2 * np.pi, 9):
        shapes = placed(np.zeros((1, 3)), np.zeros(1), person(phase, swing))  # along x
        half, x = np.sqrt(shapes.shape[..., 0, 0]), shapes.centre[..., 0]
        assert 0.2 < np.ptp([x - half, x + half]) / 1.7 < 0.5


def test_half_a_stride_later_left_and_right_are_exchanged() -> None:
    early, late = person(0.7, 1.0), person(0.7 + np.pi, 1.0)
    for first in range(5, figure.LIMB_PARTS, 2):
        assert early.offset[0, first, 1:] == pytest.approx(late.offset[0, first + 1, 1:], abs=1e-9)
        assert early.offset[0, first, 0] == -early.offset[0, first + 1, 0]


def test_an_arm_swings_against_the_leg_of_its_side() -> None:
    parts = person(0.0, 1.0)
    assert parts.offset[0, FEET, 1][0] > 0 > parts.offset[0, FEET, 1][1]
    assert parts.offset[0, 13, 1] < parts.offset[0, 14, 1]


@given(st.floats(-3, 3), st.floats(-1, 1))
def test_a_pitched_part_ends_where_its_pitch_says(heading: float, pitch: float) -> None:
    """At a positive pitch its lower end is ahead; u = (−sin, cos) of the pitch, along and up."""
    parts = Parts(np.array([[[0.1, 0.2, 0.9]]]), np.array([[[0.05, 0.1, 0.4]]]), np.array([[pitch]]))
    shapes = placed(np.array([[3.0, 4.0, 0.5]]), np.array([heading]), parts)
    along, right = np.array([np.cos(heading), np.sin(heading)]), np.array([np.sin(heading), -np.cos(heading)])
    centre = np.array([*(np.array([3.0, 4.0]) + 0.1 * right + 0.2 * along), 1.4])
    assert shapes.centre[0, 0] == pytest.approx(centre)
    down = 0.4 * np.array([*(np.sin(pitch) * along), -np.cos(pitch)])
    ahead = 0.1 * np.array([*(np.cos(pitch) * along), np.sin(pitch)])
    for end in (down, ahead):
        assert end @ np.linalg.inv(shapes.shape[0, 0]) @ end == pytest.approx(1.0)
    assert np.linalg.det(shapes.shape[0, 0]) == pytest.approx((0.05 * 0.1 * 0.4) ** 2)


def test_what_is_not_worn_is_inside_the_torso() -> None:
    parts, height = person(0.3, 1.0), np.array([1.7])
    bare = with_worn(parts, height, np.zeros((1, len(figure.WORN)), bool))
    full = with_worn(parts, height, np.ones((1, len(figure.WORN)), bool))
    assert (np.abs(bare.offset[:, figure.LIMB_PARTS :] - parts.offset[:, :1]) < 0.1).all()
    assert (bare.half[:, figure.LIMB_PARTS :] == 0.001).all()
    hat = full.offset[0, -1, 2] + full.half[0, -1, 2]
    assert hat == pytest.approx(parts.offset[0, 1, 2] + 1.7 * 0.073)


@pytest.mark.parametrize("kind", range(len(figure.THINGS)), ids=figure.THINGS)
def test_things_stand_on_the_ground(kind: int) -> None:
    parts = things(np.array([kind]), np.ones(1), np.zeros(1))
    low = lowest(parts)
    held = figure.THINGS[kind] == "umbrella"
    assert (0.9 < low.min() < 1.1) if held else (-0.08 < low.min() < 0.02)
    assert figure.TOPS[kind] >= (parts.offset[0, 0, 2] + parts.half[0, 0, 2])
