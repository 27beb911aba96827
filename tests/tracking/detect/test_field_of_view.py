"""Which places the camera's picture shows."""

from __future__ import annotations

import numpy as np

from sim.scene.camera import camera_rotation
from sim.types import Camera, Context
from tracking.detect.field_of_view import inside

TOP = Camera(
    "top", (200, 100), (1.0, 1.0), (100.0, 50.0), np.array([5.0, 2.0, 10.0]), camera_rotation(np.pi / 2, 0.0), 0.0, 20.0
)
"""Shows 10 by 5 m about (5, 2)."""


def test_on_the_ground_the_camera_decides():
    context = Context(10.0, 20.0, TOP)
    pos = np.array([[[0.1, 2.0], [-0.1, 2.0]], [[9.9, 4.4], [5.0, 4.6]]])
    assert inside(pos, "ground", context, 1.0).tolist() == [[True, False], [True, False]]


def test_the_middle_of_the_body_is_what_counts():
    """A camera 1.7 m above the ground that looks ahead shows no feet nearby, but people."""
    camera = Camera(
        "pinhole", (200, 200), (100.0, 100.0), (100.0, 100.0), np.array([0, 0, 1.7]), camera_rotation(0.0, 0.0)
    )
    context = Context(10.0, 20.0, camera)
    pos = np.array([[0.0, 1.0], [0.0, 0.5], [0.0, -1.0], [1.5, 1.0]])
    assert inside(pos, "ground", context, 1.0).tolist() == [True, False, False, False]


def test_in_the_image_its_size_decides():
    pos = np.array([[0.0, 0.0], [9.9, 4.9], [10.1, 1.0], [-0.1, 1.0]])
    known, unknown = (Context(10.0, 20.0, image_size=size) for size in ((200, 100), None))
    assert inside(pos, "image", known, 20.0).tolist() == [True, True, False, False]
    assert inside(pos, "image", unknown, 20.0).all()


def test_without_a_camera_everybody_is_inside():
    assert inside(np.full((3, 2), 1e6), "ground", Context(10.0, 20.0, image_size=(1, 1)), 1.0).all()
