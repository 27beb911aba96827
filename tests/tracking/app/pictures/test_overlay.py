"""The overlay: every picture in its slot, boxes where they belong, what a frame lacks, what cannot be drawn."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.geometry.hull_kernels import convex_hull
from sim.scene.camera import project
from sim.types import Frame, GroupEvent, Groups, Sequence, Tracks, Truth
from tests.coded_pictures import SIZE, coded, number, sequence
from tests.groups_as_wholes import wholes
from tests.reference_polygons import contains
from tracking.app.pictures.overlay import overlay_pictures, write_overlay
from tracking.drawing.canvas import colour
from tracking.drawing.layers import layer_of_tracks

STRIP = 32


def answer(index: int, boxes: dict[int, list[float]], group: int = -1, events: tuple[GroupEvent, ...] = ()) -> Tracks:
    box = np.array(list(boxes.values()), float).reshape(-1, 4)
    n = len(box)
    return Tracks(
        index, 0.0, "image", "person", np.array(list(boxes), np.int64), np.full(n, group), box[:, :2] + box[:, 2:] / 2,
        np.zeros((n, 2)), np.tile(np.diag([4.0, 1.0, 1.0, 1.0]), (n, 1, 1)), box, np.ones(n), events=events,
    )  # fmt: skip


def frames_of(path: Path) -> list[np.ndarray]:
    video, found = cv2.VideoCapture(str(path)), []
    while True:
        done, picture = video.read()
        if not done:
            return found
        found.append(picture)


def test_every_frame_in_its_slot(tmp_path: Path) -> None:
    tracks = [answer(k, {3: [40, 30, 10, 20]}) for k in range(1, 13)]
    steps: list[str] = []
    path = write_overlay(sequence(12), tracks, tmp_path / "new" / "o.mp4", step=steps.append)
    found = frames_of(path)
    assert [number(picture, STRIP, 2) for picture in found] == list(range(1, 13))
    assert found[0].shape == (STRIP + 2 * SIZE[1], 2 * SIZE[0], 3)
    assert len(steps) == 12


def test_boxes_are_where_they_belong() -> None:
    """At twice its size: the left edge of a box at u = 40 is drawn at 80, in the colour of its id, the id above it."""
    side = layer_of_tracks([answer(1, {3: [40, 30, 10, 20]})], None, None)
    (picture,) = overlay_pictures(sequence(1), [side])
    edges = np.argwhere(np.abs(picture[STRIP:].astype(int) - colour(3)).max(axis=2) < 12)
    box = edges[edges[:, 0] > 61]
    (_, left), (bottom, right) = box.min(axis=0), box.max(axis=0)
    assert (left, right, bottom) == pytest.approx((80, 100, 100), abs=2)
    assert 40 < edges[:, 0].min() < 58


def test_the_truth_stands_over_or_alone(tmp_path: Path) -> None:
    truth = Truth(
        "coded", 10.0, 3, 20.0, np.arange(1, 4), np.ones(3, np.int64), np.full(3, -1), None, None,
        np.tile([10.0, 30, 10, 20], (3, 1)), np.ones(3),
    )  # fmt: skip
    labelled = dataclasses.replace(sequence(3), load_truth=lambda: truth)
    tracks = [answer(k, {3: [40, 30, 10, 20]}) for k in range(1, 4)]
    wide = [
        frames_of(write_overlay(labelled, given, tmp_path / "o.mp4", how))[0].shape[1]
        for given, how in ((tracks, None), (tracks, "over"), (None, None))
    ]
    assert wide == [166, 166, 166]
    for given, how, word in ((tracks, "over", "without labels"), (None, None, "neither tracks nor labels")):
        with pytest.raises(InputError, match=word):
            write_overlay(sequence(3), given, tmp_path / "x.mp4", how)
    assert not (tmp_path / "x.mp4").exists()


def test_what_a_frame_lacks_is_told() -> None:
    """A label in red at the right of the banner; the picture before is shown again."""

    def frames():
        yield from (Frame(1, 0.0, coded(1)), Frame(2, 0.1, None), Frame(3, 0.2, coded(3)))

    case = dataclasses.replace(sequence(3), frames=frames)
    side = layer_of_tracks([answer(k, {}) for k in (1, 2, 3)], None, None)
    made = list(overlay_pictures(case, [side]))
    red = [(np.abs(p[:STRIP].astype(int) - colour(6)).max(axis=2) < 4).sum() > 50 for p in made]
    assert red == [False, True, False]
    assert [number(p, STRIP, 2) for p in made] == [1, 1, 3]


def test_people_on_the_ground_stand_upright_in_the_picture(sequence: Sequence, tracks: list[Tracks]) -> None:
    """Without boxes of their own; ellipses lie on the ground round their feet."""
    plain = [t.replace(box=None) for t in tracks]
    seen = layer_of_tracks(plain, sequence.camera, sequence.scene).at(1)
    np.testing.assert_allclose(seen.box, tracks[0].box, atol=25)
    wide = seen.ellipse[..., 0].max(axis=1) - seen.ellipse[..., 0].min(axis=1)
    assert (wide > seen.box[:, 2]).all()
    assert (np.abs(seen.ellipse.mean(axis=1) - seen.at) < 60).all()
    assert np.isnan(layer_of_tracks(plain, None, None).at(1).box).all()


def coloured(picture: np.ndarray, group: int) -> np.ndarray:
    """(V, 2) u, v of what has a group's colour, at the picture's own size."""
    rows = np.argwhere(np.abs(picture[STRIP:].astype(int) - colour(group)).max(axis=2) < 12)
    return rows[:, ::-1] / 2


def a_group(place: tuple[float, float], plane: str = "image", camera_scale: float = 1.0) -> Tracks:
    """Group 4 of three people, of 3 x 1 units (times the scale) across."""
    at, one = np.array([place]), np.array([4])
    square = at + camera_scale * np.array([[-3, -1], [3, -1], [3, 1], [-3, 1.0]])
    extent = camera_scale**2 * np.diag([9.0, 1.0])[None]
    vel = np.zeros((1, 2))
    groups = Groups(one, (), at, vel, extent, np.array([3.04]), (square,))
    return Tracks(1, 0.0, plane, "group", one, one, at, vel, np.tile(np.eye(4), (1, 1, 1)), groups=groups)


def test_a_group_has_its_extent_and_its_size() -> None:
    """9.21 by its extent round its place; as wide in the picture."""
    side = layer_of_tracks([a_group((40, 30))], None, None)
    (region,) = side.at(1).groups
    offset = region.extent - [40, 30]
    np.testing.assert_allclose((offset**2 / [9.0, 1.0]).sum(axis=1), 9.21, rtol=1e-6)
    np.testing.assert_allclose(side.at(1).at, [[40, 30]])
    assert region.size == 3.04
    (picture,) = overlay_pictures(sequence(1), [side])
    drawn = coloured(picture, 4)
    drawn = drawn[drawn[:, 1] <= 30]  # above its name
    reach = 3 * np.sqrt(9.21)
    assert (drawn[:, 0].min(), drawn[:, 0].max()) == pytest.approx((40 - reach, 40 + reach), abs=1.5)


def test_a_group_without_an_extent_has_its_name_at_its_place() -> None:
    side = layer_of_tracks([a_group((40, 20)).replace(groups=None)], None, None)
    (picture,) = overlay_pictures(sequence(1), [side])
    assert np.ptp(coloured(picture, 4), axis=0).min() > 8  # the disc alone has 5


def test_groups_on_the_ground_lie_there_in_the_picture(sequence: Sequence) -> None:
    """Projected as people are; nothing of them where no camera is known, or all is behind it."""
    tracks = wholes(sequence, "ground")
    seen = layer_of_tracks(tracks, sequence.camera, sequence.scene).at(1)
    for region, at, pos in zip(seen.groups, seen.at, tracks[0].pos, strict=True):
        (uv,), _ = project(sequence.camera, np.array([[*pos, 0.0]]))
        np.testing.assert_allclose(at, uv)
        assert contains(convex_hull(region.hull), uv[None]).all()
        assert contains(convex_hull(region.extent), region.hull).all()
    blind = layer_of_tracks(tracks, None, None).at(1)
    assert np.isnan(blind.at).all()
    assert not any(len(part) for r in blind.groups for part in (r.hull, r.extent))
    behind = layer_of_tracks([a_group((8.0, -40.0), "ground")], sequence.camera, None).at(1)
    assert not any(len(part) for r in behind.groups for part in (r.hull, r.extent))
