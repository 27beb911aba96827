"""Rays against a world that is solid or not at each point: what they meet first, and which way it faces."""

from __future__ import annotations

import numpy as np
import pytest

from sim.scene import raycast
from sim.scene.raycast import HIT_INDEX, HIT_KIND, HIT_PLACE, HIT_SLOTS, NORMAL_X, NORMAL_Z, Solids, solids_of
from sim.scene.raycast_kernels import first_hit
from sim.types import Array, Bools, Scene, Stairs

UP = Stairs(np.array([2.0, 1.0]), np.array([4.0, 2.5]), 1.6, 1.0, 4, 1.0)
DOWN = Stairs(np.array([-2.0, -1.0]), np.array([-4.0, -2.0]), 2.0, -1.2, 5, 0.8)
PILLARS = np.array([[-2.0, 2.0, 0.5], [0.5, -2.5, 0.3]])
SCENE = Scene(np.array([9.0, 9.0]), pillars=PILLARS, pillar_height=1.8, stairs=(UP, DOWN))


def ground(x: Array, y: Array) -> Array:
    """The height of the drawn steps, 0 beside them."""
    z = np.zeros_like(x)
    for s in (UP, DOWN):
        length = np.linalg.norm(s.head - s.foot)
        (ux, uy), dx, dy = (s.head - s.foot) / length, x - s.foot[0], y - s.foot[1]
        along, across = dx * ux + dy * uy, dy * ux - dx * uy
        tread = np.clip(np.floor(along / length * s.steps + 0.5), 0, s.steps)
        there = (tread > 0) & (along <= length + s.landing) & (np.abs(across) <= s.width / 2)
        z = np.where(there, s.rise / s.steps * tread, z)
    return z


def solid(points: Array) -> Bools:
    """Whether points (..., 3) are inside of something, (...)."""
    x, y, z = np.moveaxis(points, -1, 0)
    inside = z < ground(x, y)
    for px, py, r in PILLARS:
        inside |= (np.hypot(x - px, y - py) < r) & (z < SCENE.pillar_height)
    return np.asarray(inside)


def test_rays_end_where_the_world_begins_and_surfaces_face_them() -> None:
    r, solids, seen = np.random.default_rng(0), solids_of(SCENE), set[int]()
    o = np.column_stack([r.uniform(-5, 5, (400, 2)), r.uniform(-0.8, 3.0, 400)])
    o = o[~solid(o)]
    for start, d in zip(o, r.standard_normal((len(o), 3)), strict=True):
        hit = np.zeros(HIT_SLOTS)
        t = first_hit(start, d, solids, hit)
        seen.add(int(hit[HIT_KIND]))
        free = start + np.linspace(0, min(t, 12.0) - 1e-6, 1000)[:, None] * d
        assert not solid(free).any()
        if np.isinf(t):
            assert hit[HIT_KIND] == raycast.NOTHING
            continue
        end, normal = start + t * d, hit[NORMAL_X : NORMAL_Z + 1]
        assert np.linalg.norm(normal) == pytest.approx(1)
        assert normal @ d < 0
        assert solid(end - 1e-6 * normal)
        assert not solid(end + 1e-6 * normal)
        if hit[HIT_KIND] == raycast.PILLAR and normal[2] == 0:
            x, y, radius = PILLARS[int(hit[HIT_INDEX])]
            angle = hit[HIT_PLACE] / radius
            assert end[:2] == pytest.approx([x + radius * np.cos(angle), y + radius * np.sin(angle)])
        elif hit[HIT_KIND] in (raycast.TREAD, raycast.RISER):
            flight = (UP, DOWN)[int(hit[HIT_INDEX])]
            axis = (flight.head - flight.foot) / np.linalg.norm(flight.head - flight.foot)
            across = abs(normal[:2] @ axis) > 0.5
            along = [-axis[1], axis[0]] if across else axis
            assert hit[HIT_PLACE] == pytest.approx((end[:2] - flight.foot) @ along)
    assert seen == {raycast.NOTHING, raycast.GROUND, raycast.PILLAR, raycast.TREAD, raycast.RISER}


@pytest.mark.parametrize(
    ("start", "direction", "expected"),
    [
        ([0.0, -1.0, 1.0], [0.3, 1.0, 0.0], [1.0, 0.0, -1.0, 0.0, 1.3]),
        ([0.0, 2.0, 1.0], [0.25, -0.5, 0.0], [4.0, 0.0, 1.0, 0.0, 2.0]),
        ([0.0, -1.0, 1.0], [0.0, 1.0, 1.5], None),
        ([0.0, -1.0, 1.0], [0.0, 1.0, -1.5], None),
        ([0.0, -1.0, 1.0], [-1.2, 1.0, 0.0], None),
        ([0.0, -1.0, 1.0], [3.2, 1.0, 0.0], None),
        ([0.0, -1.0, 1.0], [1.0, 0.0, 0.0], None),
        ([0.0, -1.0, 1.0], [0.3, -1.0, 0.0], None),
    ],
)
def test_a_wall_is_hit_between_its_ends_and_below_its_top(start, direction, expected) -> None:
    """It leads from (-1, 0) to (3, 0), 2 m high."""
    solids = Solids(np.array([[-1.0, 0.0, 3.0, 0.0]]), 2.0, np.zeros((0, 3)), 0.0, np.zeros((0, 9)), np.zeros((0, 22)))
    hit = np.zeros(HIT_SLOTS)
    t = first_hit(np.array(start), np.array(direction), solids, hit)
    if expected is None:
        assert hit[HIT_KIND] != raycast.WALL
    else:
        assert hit[HIT_KIND] == raycast.WALL
        assert [t, *hit[NORMAL_X : NORMAL_Z + 1], hit[HIT_PLACE]] == pytest.approx(expected)
