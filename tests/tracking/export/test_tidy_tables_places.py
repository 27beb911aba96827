"""Lines and zones: who crosses to which side, who is inside, and the columns of counts."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from tests.tracking.export.test_tidy_tables import rows, walk
from tracking.export.tidy_tables import crossings, inside, parse_places, run_tables

DOOR = np.array([[0.0, 0.0], [2.0, 0.0]])  # who looks from its first to its second corner has +y on the left
WAYS = {  # by id (frame, x, y)
    1: [(1, 1, -1), (2, 1, 1)],  # through the door, to the left
    2: [(1, 1, 1), (2, 1, 0.5), (5, 1, -1)],  # to the right, unseen for some frames
    3: [(1, 3, -1), (2, 3, 1)],  # beside the door
    4: [(1, 1, 1), (2, 1.5, 2)],  # along it
    5: [(1, 1, -1), (2, 1, 0), (3, 1, 1)],  # by way of the line itself: once
}


def counted(line: np.ndarray, downwards: bool = False) -> tuple[list[int], list[int]]:
    table = np.array([(frame, who, x, y) for who, way in WAYS.items() for frame, x, y in way], float)
    table = table[np.random.default_rng(0).permutation(len(table))]
    left, right = crossings(table[:, 0].astype(int), table[:, 1].astype(int), table[:, 2:], line, downwards)
    return sorted(left.tolist()), sorted(right.tolist())


def test_crossings_have_a_side():
    left, right = counted(DOOR)
    assert (len(left), right) == (2, [5])
    assert counted(DOOR[::-1])[0] == [5], "the line from its other end"
    assert counted(DOOR, downwards=True)[0] == [5], "in the image y points down"


def test_zones_may_have_any_shape():
    corner = np.array([[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]], float)  # an L
    points = np.array([[0.5, 3.0], [3.0, 0.5], [3.0, 3.0], [-1.0, 0.5], [5.0, 0.5], [0.5, 0.5]])
    for zone in (corner, corner[::-1], np.roll(corner, 3, axis=0)):
        assert inside(points, zone).tolist() == [True, True, False, False, False, True]


def test_counts_have_columns_of_places():
    places = parse_places(["door=3.5,-1,3.5,5"], ["hall=4.5,-1,20,-1,20,20,4.5,20"])
    first, second = rows(run_tables(walk(), 2.0, places).counts)
    assert (first["door_to_left"], first["door_to_right"]) == (0, 2), "two people walk along +x over it"
    assert (first["hall_people"], second["hall_people"]) == (2, 1)
    assert second["hall_people_mean"] == 1.0
    with pytest.warns(UserWarning, match="far lies outside all positions, which have x from"):
        assert rows(run_tables(walk(), 2.0, parse_places(["far=90,-1,90,5"], [])).counts)[0]["far_to_left"] == 0


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
