"""What a moving camera has shown waits beside the window of the background model."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Array, Image
from tracking.detect.background import Background
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.camera_motion import shifted
from tracking.detect.mosaic import LARGEST, Mosaic, extent, on_one_picture

SIZE = (8, 6)  # width, height


def numbered(at: tuple[int, int] = (0, 0)) -> Mosaic:
    """A mosaic as large as its window, one plane: 100 v + u of the place, from `at`."""
    v, u = np.mgrid[: SIZE[1], : SIZE[0]]
    return Mosaic((100.0 * (v + at[1]) + u + at[0])[None].astype(np.float32), np.ones((6, 8), bool), (0, 0), SIZE)


def test_a_window_that_comes_back_finds_what_it_left() -> None:
    mosaic = numbered()
    before = mosaic.window()[0]
    for right, down in ((3, 2), (-5, 1), (0, -7), (2, 4)):
        mosaic.move(right, down)
    planes, known = mosaic.window()
    assert known.all()
    assert np.array_equal(planes, before)


def test_what_comes_into_view_is_unknown_until_it_is_stored() -> None:
    mosaic = numbered()
    mosaic.move(3, -2)
    planes, known = mosaic.window()
    assert known.tolist() == [[v >= 2 and u < 5 for u in range(8)] for v in range(6)]
    assert planes[0, 2, :5].tolist() == [3, 4, 5, 6, 7]
    planes[0, 0, 7], known[0, 7] = 77, True
    mosaic.store(planes, known)
    mosaic.move(-3, 2)
    mosaic.move(3, -2)
    again, where = mosaic.window()
    assert again[0, 0, 7] == 77
    assert where.tolist() == known.tolist()


@pytest.mark.parametrize("way", [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_a_mosaic_stays_bounded_and_keeps_what_is_near(way: tuple[int, int]) -> None:
    mosaic = numbered()
    for k in range(1, 60):
        mosaic.move(*way)
        planes, known = mosaic.window()
        planes[:, ~known] = k
        mosaic.store(planes, np.ones_like(known))
    assert mosaic.known.shape[0] <= LARGEST * 6
    assert mosaic.known.shape[1] <= LARGEST * 8
    last = mosaic.window()[0]
    for step in (-5, 5):
        mosaic.move(step * way[0], step * way[1])
    assert np.array_equal(mosaic.window()[0], last)


def test_a_mosaic_bends_about_its_window() -> None:
    mosaic = numbered()
    mosaic.move(2, 0)
    mosaic.bend(shifted(1.0, 0.0))
    planes, known = mosaic.window()
    assert known[:, :7].all()
    assert planes[0, 0, :7] == pytest.approx([1, 2, 3, 4, 5, 6, 7])


def test_the_extent_holds_every_picture_up_to_a_bound() -> None:
    assert extent([np.eye(3), shifted(-3.5, 2.0)], SIZE) == (-4, 0, 12, 8)
    left, top, width, height = extent([np.eye(3), shifted(1000.0, -1000.0)], SIZE)
    assert (left, width) == (0, 8 + 12)
    assert (top, height) == (-9, 6 + 9)


def sample() -> tuple[Image, list[Array | None]]:
    """Pictures of a place whose colour is 10 times the column, one px further to the right in each; one is lost."""
    columns = np.arange(20)
    pictures = np.stack([np.broadcast_to(10 * columns[k : k + 8, None], (6, 8, 3)) for k in range(12)])
    poses: list[Array | None] = [shifted(k - 6.0, 0.0) for k in range(12)]
    poses[4] = None
    return pictures.astype(np.uint8), poses


def test_each_place_has_the_colours_of_the_pictures_that_show_it() -> None:
    pictures, poses = sample()
    pictures[2] += 5
    laid, known, at = on_one_picture(pictures, poses)
    assert laid.shape == (11, 6, 19, 3)
    assert at == (6, 0)
    assert known.all()
    place = laid[:, 0, :, 0]
    assert set(place[:, 0].tolist()) == {0}
    assert set(place[:, 12].tolist()) == {120}
    # Column 8 is seen by pictures 1, 2, 3, 5, 6, 7, 8, again and again.
    assert place[:, 8].tolist() == [80, 85, 80, 80, 80, 80, 80, 80, 85, 80, 80]


def test_a_model_looks_at_a_window_and_moves_it() -> None:
    pictures, poses = sample()
    laid, _, at = on_one_picture(pictures, poses)
    model = Background(laid, 10.0, BackgroundSettings())
    model.look_at(at, SIZE)
    assert model.valid.shape == (6, 8)
    assert model.mean[0, 0] == pytest.approx(np.maximum(10.0 * np.arange(6, 14), 1), abs=1)
    model.carry(shifted(4.0, 0.0), whole=True)
    assert model.mean[0, 0] == pytest.approx(np.maximum(10.0 * np.arange(2, 10), 1), abs=1)
    model.carry(shifted(-4.0, 0.0), whole=True)
    model.carry(shifted(-7.0, 0.0), whole=True)
    assert model.valid[0].tolist() == [True] * 6 + [False] * 2
