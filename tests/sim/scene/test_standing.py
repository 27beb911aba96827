"""The places of people by their boxes, against the places from which the boxes were made."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.scene.body import person_boxes
from sim.scene.camera import project, to_ground
from sim.scene.standing import standing_points, stature_doubt
from sim.scene.terrain import height_at
from sim.sequence import simulate
from sim.types import Array, Camera, Scene, Stairs, Truth
from tests.reference_sense import above, pinhole
from tracking.recordings.source import open_source


def people(camera: Camera, seed: int, count: int = 200) -> tuple[Array, Array, Array, Array]:
    """Returns places, headings, heights and boxes of people whose feet are in the image, within 60 m."""
    r = np.random.default_rng(seed)
    pos = to_ground(camera, r.uniform(0, camera.image, (count, 2)))
    pos = pos[np.hypot(*(pos - camera.position[:2]).T) < 60]
    heading, height = r.uniform(-np.pi, np.pi, len(pos)), r.uniform(1.5, 1.95, len(pos))
    box = person_boxes(camera, np.column_stack([pos, np.zeros(len(pos))]), heading, height)
    known = np.isfinite(box).all(axis=1)
    return pos[known], heading[known], height[known], box[known]


@pytest.mark.parametrize("tilt", [0, 5, 15, 30, 45, 60, 75])
def test_exact_boxes_give_exact_places_but_for_the_side_to_which_a_body_is_turned(tilt: float) -> None:
    off = []
    for seed in range(10):
        r = np.random.default_rng(30_000 + seed)
        camera = pinhole(tilt, r.uniform(-180, 180), (*r.uniform(-9, 9, 2), r.uniform(3, 12)))
        pos, _, _, box = people(camera, seed)
        off.append(np.linalg.norm(standing_points(box, camera) - pos, axis=1))
    assert np.median(np.concatenate(off)) < 0.003
    assert np.quantile(np.concatenate(off), 0.99) < 0.03


@pytest.mark.parametrize("tilt", [10, 40, 70])
@pytest.mark.parametrize("turn", [0.0, np.pi / 2])
def test_bodies_that_face_along_or_across_the_line_of_sight_are_placed_exactly(tilt: float, turn: float) -> None:
    camera, h = pinhole(tilt, 0.0, (0.0, 0.0, 6.0)), np.array([1.5, 1.7, 1.95])
    away = np.array([to_ground(camera, np.array([[camera.centre_px[0], v]]))[0] for v in (240.0, 300.0, 420.0)])
    box = person_boxes(camera, np.column_stack([away, np.zeros(3)]), np.full(3, np.pi / 2 + turn), h)
    assert np.abs(standing_points(box, camera) - away).max() < 1e-6


@pytest.mark.parametrize("camera", [above(), above(25), pinhole(90, 0, (8, 5, 9))])
def test_places_from_straight_above_are_exact(camera: Camera) -> None:
    pos, _, _, box = people(camera, 1)
    off = np.hypot(*(standing_points(box, camera) - pos).T)
    assert np.quantile(off, 0.95) < 1e-6
    assert off.max() < 0.05  # just below the camera, where body and head are one blot


def test_places_on_stairs_follow_from_boxes() -> None:
    scene = Scene(np.array([20.0, 12.0]), stairs=(Stairs(np.array([8.0, 6]), np.array([12.0, 6]), 5.0, 1.6, 10, 6.0),))
    camera = pinhole(25.0, -90.0, (0.0, 6.0, 5.0))
    r = np.random.default_rng(0)
    pos = r.uniform([6, 4], [16, 8], (300, 2))
    feet = np.column_stack([pos, height_at(scene, pos)])
    box = person_boxes(camera, feet, np.zeros(300), r.uniform(1.5, 1.95, 300))
    off = np.hypot(*(standing_points(box, camera, scene) - pos).T)
    assert (feet[:, 2] > 0).sum() > 100
    assert np.quantile(off, 0.95) < 0.01
    assert off.max() < 0.4  # a tread: a place behind the edge of a step


def test_a_scenario_is_put_back_on_its_ground() -> None:
    sequence = simulate(load("crowd"), 30_000)
    truth = sequence.truth
    assert sequence.camera is not None
    assert truth is not None
    assert truth.pos is not None
    assert truth.box is not None
    off = np.hypot(*(standing_points(truth.box, sequence.camera, sequence.scene) - truth.pos).T)
    assert np.median(off) < 0.002
    assert off.max() < 0.03


def test_a_box_that_no_body_has_keeps_its_foot_and_one_above_the_horizon_has_no_place() -> None:
    camera = pinhole(20.0, 0.0, (0.0, 0.0, 5.0))
    box = np.array([[300.0, 200, 200, 40], [300, 200, 2, 80], [300, 100, 40, 1e-9], [300, -400, 40, 90]])
    found = standing_points(box, camera)
    assert np.isfinite(found[:3]).all()
    assert np.isnan(found[3]).all()
    uv, _ = project(camera, np.column_stack([found[:3], np.zeros(3)]))
    assert np.abs(uv[:, 1] - (box[:3, 1] + box[:3, 3])).max() < 0.2 * 200


def test_no_boxes_have_no_places() -> None:
    assert standing_points(np.zeros((0, 4)), pinhole()).shape == (0, 2)


def test_the_lens_bends_place_and_box_alike() -> None:
    camera = pinhole(30.0, 0.0, (0.0, 0.0, 6.0)).replace(radial=-0.05)
    ideal = camera.replace(radial=0.0)
    pos, _, _, box = people(ideal, 2)
    shifted = project(camera, np.column_stack([pos, np.zeros(len(pos))]))[0]
    moved = box.copy()  # as the lens moves the place, it moves the box
    moved[:, :2] += shifted - project(ideal, np.column_stack([pos, np.zeros(len(pos))]))[0]
    off = np.hypot(*(standing_points(moved, camera) - pos).T)
    assert np.quantile(off, 0.99) < 0.05


@pytest.mark.parametrize("tilt", [5, 15, 45, 75])
@pytest.mark.parametrize(("wrong", "size"), [(1.0, ""), (0.3048, "under 1 m tall"), (1 / 0.3048, "over 2.4 m tall")])
def test_a_camera_in_another_unit_makes_people_too_small_or_too_tall(tilt: float, wrong: float, size: str) -> None:
    """A camera `wrong` times as high sees people `wrong` times as tall."""
    camera = pinhole(tilt, 20, (1, 2, 6))
    _, _, _, box = people(camera, 3)
    doubt = stature_doubt(box, camera.replace(position=wrong * camera.position))
    assert bool(doubt) == bool(size)
    assert size in doubt


@pytest.mark.parametrize("labelled", [True, False])
def test_a_translation_in_place_of_the_position_is_warned_of(labelled: bool, tmp_path: Path) -> None:
    camera = pinhole(40, 20, (1, 2, 6))
    _, _, _, box = people(camera, 3)
    rows = [",".join(map(str, (1, k if labelled else -1, *each.tolist(), 1))) for k, each in enumerate(box)]
    (tmp_path / "a.txt").write_text("\n".join(rows))
    moved = camera.replace(position=np.abs(camera.rotation @ camera.position) / 2)

    def seen(by: Camera) -> Truth | None:
        return open_source(tmp_path / "a.txt", fps=10, camera=by)[0].truth

    assert (seen(camera) is not None) == labelled
    with pytest.warns(UserWarning, match="position, which is no translation"):
        seen(moved)
