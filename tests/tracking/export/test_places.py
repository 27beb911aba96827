"""Lines and zones: who passes them, by an oracle that loops over the rows of a person, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.errors import InputError
from tracking.export.places import depth, inside, parse_places, passages, zone_distance

DOOR = np.array([[0.0, 0.0], [2.0, 0.0]])  # who looks from its first to its second end has +y on the left
SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
CORNER = np.array([[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]], float)  # an L
MARGIN = 0.25


def passed(way: list[tuple[float, float]], corners=DOOR, margin=MARGIN, downwards=False) -> list[tuple[int, bool]]:
    """Row and direction of the passages of one person."""
    pos = np.array(way, float)
    found = passages(np.zeros(len(way), np.int64), pos, corners, np.full(len(way), margin), downwards)
    return [*zip(found.row.tolist(), found.forward.tolist(), strict=True)]


THROUGH = [(1, -1), (1, -0.1), (1, 0.1), (1, 1)]
WAYS = {
    "through": (THROUGH, [(3, True)]),
    "back through": (THROUGH[::-1], [(3, False)]),
    "there and back": ([*THROUGH, *THROUGH[::-1]], [(3, True), (7, False)]),
    "unseen for a while": ([(1, -3), (1, 3)], [(1, True)]),
    "by way of the line itself": ([(1, -1), (1, 0), (1, 1)], [(2, True)]),
    "stands on it, then goes on": ([(1, -1), *[(1, 0.2), (1, -0.2)] * 5, (1, 1)], [(11, True)]),
    "stands on it, then goes back": ([(1, -1), *[(1, 0.2), (1, -0.2)] * 5, (1, -1)], []),
    "walks along it": ([(0.5, 0.1), (1, -0.1), (1.5, 0.1)], []),
    "turns back on it": ([(1, -1), (1, 0.2), (1, -1)], []),
    "appears on it": ([(1, -0.1), (1, 0.1), (1, 1)], []),
    "disappears on it": ([(1, -1), (1, 0.1)], []),
    "past its end": ([(3, -1), (3, 1)], []),
    "in, and out past its end": ([(1, -1), (1, 0.1), (2.5, 0.1), (2.5, -0.1), (3, -1)], []),
    "along it, then past its end": ([(1, -1), (1, -0.1), (3, -0.1), (3, 0.1), (1, 1)], []),
    "round its end and back through": ([(3, -1), (3, 1), (1, 1), (1, -1)], [(3, False)]),
    "on the margin": ([(1, -0.25), (1, 0.25)], []),
    "nobody": (np.zeros((0, 2)), []),
}


@pytest.mark.parametrize("name", WAYS)
def test_ways_at_a_line(name):
    way, expected = WAYS[name]
    assert passed(way) == expected
    turned = [(row, not forward) for row, forward in expected]
    assert passed(way, DOOR[::-1]) == turned, "the line from its other end"
    assert passed(way, downwards=True) == turned, "in the image y points down"


def test_who_is_inside_stays_so_within_the_margin():
    way = [(1, -0.1), (1, 0.1), (1, 0.3), (1, 0.1), (1, -0.1), (1, -0.3), (1, 0.2)]
    found = passages(np.zeros(7, np.int64), np.array(way), SQUARE, np.full(7, MARGIN), False)
    assert found.inside.tolist() == [True] * 5 + [False] * 2, "at first as later, then as before"
    alone = passages(np.array([4, 4, 5, 5]), np.array([(1, 0.1), (1, -0.1)] * 2)[[0, 1, 1, 0]], SQUARE,
                     np.full(4, MARGIN), False)  # fmt: skip
    assert alone.inside.tolist() == [True, True, False, False], "who never leaves the margin: as at first"


def oracle(way, margin, distance, through):
    """Row and direction of the passages of one person, row by row."""
    side, net, found = 0, 0, []
    for k in range(len(way)):
        net += through(way[k - 1], way[k]) if k else 0
        now = 1 if distance[k] > margin[k] else -1 if distance[k] < -margin[k] else 0
        if now and side == -now and net * now > 0:
            found.append((k, now > 0))
        if now:
            side, net = now, 0
    return found


def through_door(a, b) -> int:
    """1 for a step through the DOOR to its left, -1 to its right, else 0."""
    if (a[1] > 0) == (b[1] > 0):
        return 0
    x = a[0] + (b[0] - a[0]) * a[1] / (a[1] - b[1])
    return (1 if b[1] > 0 else -1) if 0 <= x <= 2 else 0


def walks(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ids, positions and margins of people who walk at random round the door and the square."""
    rng = np.random.default_rng(seed)
    length = rng.integers(1, 40, 6)
    pos = [rng.uniform(-1, 3, 2) + np.cumsum(rng.normal(0, 0.4, (n, 2)), axis=0) for n in length]
    return np.repeat(np.arange(6) * 3, length), np.concatenate(pos), rng.choice([0.0, 0.1, 0.5], length.sum())


@given(st.integers(0, 10_000))
def test_passages_equal_those_of_a_loop(seed):
    id, pos, margin = walks(seed)
    cases = (
        (DOOR, pos[:, 1], through_door),
        (SQUARE, zone_distance(pos, SQUARE), lambda a, b: int(inside(b[None], SQUARE)[0]) - inside(a[None], SQUARE)[0]),
    )
    for corners, distance, through in cases:
        found = passages(id, pos, corners, margin, False)
        expected = [
            (row + int(np.argmax(id == who)), forward)
            for who in np.unique(id)
            for row, forward in oracle(pos[id == who], margin[id == who], distance[id == who], through)
        ]
        assert [*zip(found.row.tolist(), found.forward.tolist(), strict=True)] == expected
        if corners is SQUARE:
            step = np.diff(found.inside.astype(int)) * (np.diff(id) == 0)
            assert step.sum() == found.forward.sum() - (~found.forward).sum(), "who enters and does not leave is inside"
            assert np.flatnonzero(step).tolist() == (found.row - 1).tolist()


@given(st.integers(0, 10_000), st.floats(-3, 3), st.floats(-9, 9))
def test_moving_and_turning_everything_changes_nothing(seed, angle, shift):
    id, pos, margin = walks(seed)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    for corners in (DOOR, SQUARE, CORNER):
        before = passages(id, pos, corners, margin, False)
        after = passages(id, pos @ turn + shift, corners @ turn + shift, margin, False)
        assert np.array_equal(before.row, after.row)
        assert np.array_equal(before.forward, after.forward)


def test_zones_may_have_any_shape():
    points = np.array([[0.5, 3.0], [3.0, 0.5], [3.0, 3.0], [-1.0, 0.5], [5.0, 0.5], [0.5, 0.5]])
    distance = [0.5, 0.5, -2.0, -1.0, -1.0, 0.5]
    for zone in (CORNER, CORNER[::-1], np.roll(CORNER, 3, axis=0), np.repeat(CORNER, 2, axis=0)):
        assert inside(points, zone).tolist() == [True, True, False, False, False, True]
        assert zone_distance(points, zone) == pytest.approx(distance)


@given(st.integers(0, 10_000))
def test_depth_is_at_most_the_distance_of_some_point_from_the_edges(seed):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 7))
    star = rng.uniform(0.5, 3, 7)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    x, y = np.meshgrid(np.linspace(-3, 3, 121), np.linspace(-3, 3, 121))
    innermost = zone_distance(np.stack([x.ravel(), y.ravel()], axis=1), star).max()
    assert depth(star) <= innermost + 0.05
    assert depth(SQUARE) == 0.5


NO_PLACES = [
    (["door=1,2,3"], []), (["door=1,2,3,4,5,6"], []), (["1,2,3,4"], []), (["door=1,2,3,x"], []),
    (["a b=1,2,3,4"], []), (["a=1,2,3,inf"], []), ([], ["hall=1,2,3,4"]), ([], ["hall=1,2,3,4,5,6,7"]),
    (["a=1,2,3,4"], ["a=0,0,1,0,1,1"]),
]  # fmt: skip


@pytest.mark.parametrize(("lines", "zones"), NO_PLACES)
def test_what_is_no_place_is_refused(lines, zones):
    with pytest.raises(InputError, match="NAME="):
        parse_places(lines, zones)


THIN = [
    (["a=1,1,1,1"], [], "of length 0"), (["a=1,1,1,1.0000000001"], [], "of length 0"),
    ([], ["a=0,0,1,1,2,2"], "of area 0"), ([], ["a=0,0,0,0,0,0"], "of area 0"), ([], ["a=0,0,4,0,4,0"], "of area 0"),
    ([], ["a=0,0,2,2,2,0,0,2"], "edges cross"), ([], ["a=0,0,9,0,9,9,5,-1"], "edges cross"),
]  # fmt: skip


@pytest.mark.parametrize(("lines", "zones", "fault"), THIN)
def test_what_nobody_can_cross_or_be_in_is_refused(lines, zones, fault):
    """The remedy works: its own examples are read."""
    with pytest.raises(InputError, match=fault) as caught:
        parse_places(lines, zones)
    words = caught.value.remedy.replace(";", "").split()
    assert [*parse_places([words[2]], [words[5]])] == ["door", "hall"]


@pytest.mark.parametrize("text", ["a=0,0,4,0,4,1,1,1,1,4,0,4", "a=0,0,4,0,4,4,0,0", "a=0,0,2,0,2,2,2,2,0,2"])
def test_zones_that_are_one_round_are_read(text):
    """An L, one that repeats its first corner, and one that repeats another."""
    assert len(parse_places([], [text, text.replace("a", "b")])) == 2
