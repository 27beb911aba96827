"""Blobs of several people, divided into pieces of a person's size."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.detect import blobs
from tracking.detect.point_detections import divided

TALL, WIDE = 40, 16


class Size:
    """Everybody is 40 px high and 16 px wide; nan: unknown."""

    def __init__(self, tall=float(TALL)):
        self.tall = tall

    def at(self, foot):
        return np.tile([self.tall, WIDE], (len(foot), 1))


def person(u, v=100):
    """The mask of an upright ellipse with its centre at (u, v)."""
    y, x = np.mgrid[:200, :300] + 0.5
    return ((x - u) / (WIDE / 2)) ** 2 + ((y - v) / (TALL / 2)) ** 2 <= 1


def box(u, v=100):
    return [u - WIDE / 2, v - TALL / 2, WIDE, TALL]


def centres(mask, people=(), size=None):
    found = divided(blobs.find(mask, 5), np.array(people, float).reshape(-1, 4), size or Size())
    return sorted((found[:, :2] + found[:, 2:] / 2).round(1).tolist())


def test_a_person_alone_is_one_detection():
    assert centres(person(50)) == [[50, 100]]
    assert centres(person(50), [box(50)]) == [[50, 100]]


@pytest.mark.parametrize("people", [[], [box(50)], [box(52, 98), box(60)], [box(50), box(65), box(58)]])
def test_two_people_side_by_side_are_two(people):
    """Whether or not they are tracked; a third one who is tracked there finds no room."""
    found = centres(person(50) | person(64), people)
    np.testing.assert_allclose(found, [[50, 100], [64, 100]], atol=1.6)


def test_people_who_cover_each_other_are_as_many_as_are_tracked():
    mask = person(50) | person(58)
    assert len(centres(mask)) == 1
    found = centres(mask, [box(50), box(58)])
    np.testing.assert_allclose(found, [[48, 100], [60, 100]], atol=3)


def test_parts_of_people_are_left_out_and_unknown_sizes_are_one_person():
    part = np.zeros((200, 300), bool)
    part[20:28, 20:28] = True
    assert centres(part) == []
    assert len(centres(part, size=Size(np.nan))) == 1
    assert len(centres(person(50) | person(64), size=Size(np.nan))) == 1
    assert centres(np.zeros((200, 300), bool)) == []
