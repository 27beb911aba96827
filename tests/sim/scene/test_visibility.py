import numpy as np
import pytest

from sim.scene.body import ellipsoids, person_boxes
from sim.scene.camera import rays
from sim.scene.visibility import BodyVisibility, measure_visibility
from sim.scene.visibility_kernels import COLUMNS, visible_span
from sim.types import Array, Camera, Scene, Stairs
from tests import reference_render as slow
from tests.reference_sense import pinhole

OPEN = Scene(np.array([16.0, 10.0]))


def see(
    camera: Camera, scene: Scene, xy: Array, heading: Array | None = None, height: Array | None = None
) -> BodyVisibility:
    pos3 = np.column_stack([xy, np.zeros(len(xy))])
    heading = np.zeros(len(xy)) if heading is None else heading
    height = np.full(len(xy), 1.7) if height is None else height
    frame = np.ones(len(xy), np.int64)
    return measure_visibility(camera, scene, frame, pos3, height, ellipsoids(pos3, heading, height))


def crowded(seed: int, people: int = 14) -> tuple[Array, Array, Array]:
    r = np.random.default_rng(seed)
    return r.uniform([5, 2], [11, 7], (people, 2)), r.uniform(0, 6, people), r.uniform(1.5, 1.95, people)


def ray_visibility(camera: Camera, scene: Scene, pos3: Array, heading: Array, height: Array, n: int = 60) -> Array:
    """Share of each person's silhouette that is visible, (N,): n × n rays over the amodal box, nearest surface wins."""
    shapes, out = ellipsoids(pos3, heading, height), []
    for i, (left, top, width, tall) in enumerate(person_boxes(camera, pos3, heading, height)):
        u, v = np.meshgrid(left + (np.arange(n) + 0.5) / n * width, top + (np.arange(n) + 0.5) / n * tall)
        uv = np.column_stack([u.ravel(), v.ravel()])
        o, d = rays(camera, uv)
        hits = np.array([
            np.minimum(*(slow.ball(o, d, *part) for part in zip(shapes.centre[j], shapes.shape[j], strict=True)))
            for j in range(len(pos3))
        ])  # fmt: skip
        first = np.minimum(np.delete(hits, i, axis=0).min(axis=0), slow.still(o, d, scene)[0])
        seen = (hits[i] < first) & ((uv >= 0) & (uv < camera.image)).all(axis=1)
        out.append(seen.sum() / np.isfinite(hits[i]).sum())
    return np.array(out)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("camera", [pinhole(), pinhole(10, 0, (8, -6, 1.6)), pinhole(60, 0, (8, 0, 4))])
def test_people_against_rays(seed: int, camera: Camera) -> None:
    """Order by the axes' distance and a grid of 512 cells differ from the nearest surface of 3600 rays by < 0.03."""
    xy, heading, height = crowded(seed)
    apart = np.linalg.norm(xy[:, None] - xy[None], axis=2) + np.eye(len(xy))
    keep = ~((apart < 0.5) & (np.arange(len(xy))[:, None] > np.arange(len(xy)))).any(axis=1)  # nobody inside another
    xy, heading, height = xy[keep], heading[keep], height[keep]
    pos3 = np.column_stack([xy, np.zeros(len(xy))])
    expected = ray_visibility(camera, OPEN, pos3, heading, height)
    assert see(camera, OPEN, xy, heading, height).visibility == pytest.approx(expected, abs=0.03)
    assert expected.min() < 0.9  # somebody is hidden at all


@pytest.mark.parametrize("seed", range(3))
def test_walls_and_pillars_against_rays(seed: int) -> None:
    r = np.random.default_rng(seed)
    scene = Scene(
        np.array([16.0, 10.0]), walls=np.array([[[5.0, 4.0], [8.0, 4.6]], [[9.0, 3.0], [9.5, 6.0]]]),
        pillars=np.array([[8.2, 2.0, 0.4], [6.0, 6.0, 0.3]]), wall_height=1.2, pillar_height=2.5,
    )  # fmt: skip
    xy = r.uniform([5, 1], [11, 9], (10, 2))
    for wall in scene.walls:  # nobody stands in a wall
        along = (wall[1] - wall[0]) / np.linalg.norm(wall[1] - wall[0])
        s = np.clip((xy - wall[0]) @ along, 0, np.linalg.norm(wall[1] - wall[0]))
        xy = xy[np.linalg.norm(xy - wall[0] - s[:, None] * along, axis=1) > 0.3]
    xy = xy[(np.linalg.norm(xy[:, None] - scene.pillars[:, :2], axis=2) > 0.75).all(axis=1)]
    pos3, heading, height = np.column_stack([xy, np.zeros(len(xy))]), r.uniform(0, 6, len(xy)), np.full(len(xy), 1.7)
    camera = pinhole(25, 0, (8, -4, 3.5))
    expected = ray_visibility(camera, scene, pos3, heading, height, n=24)
    fast = see(camera, scene, xy, heading, height).visibility
    assert fast == pytest.approx(expected, abs=0.04)
    assert (see(camera, OPEN, xy, heading, height).visibility > fast + 0.2).any()  # they hide somebody


def test_a_door_is_an_opening() -> None:
    halves = np.array([[[4.0, 3.0], [7.4, 3.0]], [[8.6, 3.0], [12.0, 3.0]]])
    scene = Scene(np.array([16.0, 10.0]), walls=halves, wall_height=30.0)
    through, beside = see(pinhole(), scene, np.array([[8.0, 4.0], [6.0, 4.0]])).visibility
    assert (through, beside) == (1.0, 0.0)


def test_stairs_hide_who_is_behind_them_and_not_who_is_before_or_beside() -> None:
    """They rise to 3 m between y = 0 and y = 2, before a camera at 1.6 m."""
    stairs = Stairs(np.array([8.0, 0.0]), np.array([8.0, 2.0]), 3.0, 3.0, 6)
    scene, camera = Scene(np.array([16.0, 10.0]), stairs=(stairs,)), pinhole(10, 0, (8, -6, 1.6))
    found = see(camera, scene, np.array([[8.0, 4.0], [8.0, -1.5], [11.0, 4.0]])).visibility
    assert found == pytest.approx([0.0, 1.0, 1.0])


def test_the_image_cuts_people() -> None:
    camera = pinhole()
    xs = np.linspace(0, 8, 60)
    seen = see(camera, OPEN, np.column_stack([xs, np.full(60, 4.0)])[:1])
    for x in xs:
        seen = see(camera, OPEN, np.array([[x, 1.0]]))
        left, _, width, _ = seen.box[0]
        assert seen.visibility[0] == pytest.approx(1 - seen.truncation[0])
        if left >= 0:
            assert seen.truncation[0] == 0
        elif left + width <= 0:
            assert seen.truncation[0] == 1
            assert np.isnan(seen.visible_box[0]).all()
        else:
            assert 0 <= seen.truncation[0] <= 1
            if seen.visibility[0] > 0:
                assert seen.visible_box[0, 0] == pytest.approx(0, abs=width / COLUMNS)
                assert seen.visible_box[0, 2] == pytest.approx(left + width, abs=width / COLUMNS)
    assert seen.box[0, 0] > 0  # the walk led from outside to inside


@pytest.mark.parametrize("seed", range(5))
def test_order_of_rows_and_further_frames_change_nothing(seed: int) -> None:
    xy, heading, height = crowded(seed)
    one = see(pinhole(), OPEN, xy, heading, height)
    order = np.random.default_rng(seed).permutation(len(xy))
    assert see(pinhole(), OPEN, xy[order], heading[order], height[order]).visibility == pytest.approx(
        one.visibility[order]
    )
    pos3 = np.column_stack([xy, np.zeros(len(xy))])
    twice, tall = np.concatenate([pos3, pos3]), np.concatenate([height, height])
    frame = np.repeat([1, 4], len(xy))
    both = measure_visibility(
        pinhole(), OPEN, frame, twice, tall, ellipsoids(twice, np.concatenate([heading, heading]), tall)
    )
    assert both.visibility == pytest.approx(np.concatenate([one.visibility, one.visibility]))
    assert one.box == pytest.approx(person_boxes(pinhole(), pos3, heading, height))


@pytest.mark.parametrize(
    ("start", "low", "high", "expected"),
    [
        (10.0, 3, 6, (13.0, 4.0)),
        (10.0, 1, 6, (10.0, 7.0)),  # the first of the silhouette's cells: to the edge of the box
        (10.0, 3, 8, (13.0, 7.0)),  # the last one
        (-5.0, 3, 8, (0.0, 5.0)),
        (25.0, 1, 8, (25.0, 5.0)),
    ],
)
def test_the_span_of_visible_cells_is_cut_by_the_image(start, low, high, expected) -> None:
    """Ten cells of 1 px, of which the silhouette covers those from 1 to 8, in an image of 30 px."""
    assert visible_span(start, 10.0, 10, low, high, 1, 8, 30.0) == pytest.approx(expected)
