"""Sheets with pictures: each panel shows its own frame; ids and disparities in colours that tell them apart."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import PixelTruth, Sequence, Truth
from tests.coded_pictures import SIZE, number, sequence
from tracking.app.pictures.contact_sheet import (
    HEAD,
    OBJECTS,
    TITLE,
    WIDTH,
    PanelPictures,
    choose_frames,
    coloured_disparity,
    coloured_ids,
    empty_truth,
    sheet_picture,
    write_sheet,
)
from tracking.drawing.canvas import FLOOR, GRID, colour


def pixels(index: int) -> PixelTruth:
    ids = np.zeros(SIZE[::-1], np.int64)
    ids[30:50, 5:15], ids[:10] = index, -2
    disparity = np.full(SIZE[::-1], 2.0)
    disparity[:, :5] = np.nan
    disparity[30:50, 5:15] = 9.0
    one = np.ones(1)
    return PixelTruth(ids, disparity, one, one, np.ones((1, 4)), np.ones(1, np.int64))


def test_each_panel_shows_its_frame(tmp_path: Path) -> None:
    """Without labels too: frames spread over the recording."""
    bare = sequence(60)
    truth = empty_truth(bare)
    chosen = choose_frames(truth, 4)
    pictures = PanelPictures(bare, truth, chosen)
    assert pictures.kinds() == ()
    for index in chosen:
        area = np.zeros((SIZE[1] * 4, SIZE[0] * 4, 3), np.uint8)
        pictures.draw_large(area, index)
        assert number(area, 0, 4) == index
    read = cv2.imread(str(write_sheet(bare, tmp_path / "s.png", 4)))
    shrunk = WIDTH / 2 / SIZE[0]
    top = (HEAD + TITLE) // 2
    first = cv2.resize(read[top : top + round(SIZE[1] * shrunk), 10 : 10 + WIDTH // 2], SIZE)
    assert number(first) == chosen[0]


def test_what_has_neither_pictures_nor_labels_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no labelled people and no pictures"):
        write_sheet(Sequence("bare", 10.0, 5, lambda: iter(())), tmp_path / "s.png")


def test_pictures_stand_above_the_plan(sequence: Sequence, truth: Truth, tmp_path: Path) -> None:
    def frames():
        for frame in sequence.frames():
            yield frame.replace(image=np.full((480, 640, 3), 77, np.uint8))

    low = sheet_picture(sequence, truth, 4)
    seen = dataclasses.replace(sequence, frames=frames, bare=sequence.frames, has_images=True)
    high = sheet_picture(seen, truth, 4)
    assert high.shape[0] - low.shape[0] == pytest.approx(WIDTH * 480 / 640 / 2, abs=1)
    assert ((high == 77).all(axis=2)).mean() > 0.2


def test_small_pictures(tmp_path: Path) -> None:
    """One kind alone has the left picture beside it; ids keep their colours."""
    plain = dataclasses.replace(sequence(3), load_pixels=lambda i: pixels(i).replace(disparity=None))
    assert PanelPictures(plain, empty_truth(plain), [1, 2]).kinds() == ("left", "ids")
    both = dataclasses.replace(plain, load_pixels=pixels)
    pictures = PanelPictures(both, empty_truth(both), [2])
    assert pictures.kinds() == ("ids", "disparity")
    area = np.zeros((SIZE[1], 2 * SIZE[0], 3), np.uint8)
    pictures.draw_small(area, 2)
    np.testing.assert_array_equal(area[45, 10], colour(2))


def test_colours() -> None:
    here = pixels(3)
    ids = coloured_ids(here.ids)
    assert (tuple(ids[40, 10]), tuple(ids[2, 2]), tuple(ids[25, 40])) == (colour(3), OBJECTS, FLOOR)
    shown = coloured_disparity(here.disparity, 2.0, 9.0).astype(int)
    assert tuple(shown[40, 2]) == GRID
    assert shown[40, 10].sum() > shown[25, 40].sum() + 100
