"""The contact sheet: which frames, where things are, and what cannot be drawn."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.errors import InputError
from sim.types import GroupEvent, Sequence, Truth
from tests.coded_pictures import SIZE, number, sequence
from tracking.app.pictures import contact_sheet
from tracking.drawing.canvas import FLOOR, colour
from tracking.drawing.layers import Layer, layer_of_tracks, layer_of_truth
from tracking.grouping.known_people import people_as_tracks
from tracking.running.run import grouped

NO_LAYER = Layer("true", "G", {})


def bare(length: int, starts: dict[int, str]) -> Truth:
    events = tuple(GroupEvent(kind, k, k, None, (1,), (1,), (1,), (0.0, 0.0)) for k, kind in sorted(starts.items()))
    none = np.zeros(0, np.int64)
    return Truth("t", 10.0, length, 60.0, none, none, none, None, None, None, np.zeros(0), events=events)


def test_onsets_come_first_and_gaps_are_filled() -> None:
    layer = layer_of_truth(bare(200, {50: "merge", 120: "split", 60: "enter"}))
    chosen = contact_sheet.choose_frames(layer, 200, 10.0, 8)
    assert {50, 120} <= set(chosen)
    assert max(np.diff([1, *chosen, 200])) < 45
    assert chosen == sorted(chosen)


def test_events_of_all_parts_are_shown_and_titles_have_whole_ones() -> None:
    layer = layer_of_truth(bare(1000, dict.fromkeys(range(20, 1000, 20), "merge")))
    assert max(np.diff([1, *contact_sheet.choose_frames(layer, 1000, 10.0, 8), 1000])) < 300
    assert contact_sheet.fitting_title("1.0 s" + "   split G1 -> G2" * 4) == "1.0 s" + "   split G1 -> G2" * 3 + " ..."


@settings(deadline=None)
@given(
    length=st.integers(1, 300),
    frames=st.integers(1, 12),
    starts=st.dictionaries(st.integers(1, 300), st.sampled_from(["merge", "split", "cross", "enter"])),
)
def test_frames_are_distinct_and_inside(length: int, frames: int, starts: dict[int, str]) -> None:
    chosen = contact_sheet.choose_frames(layer_of_truth(bare(length, starts)), length, 10.0, frames)
    assert len(chosen) == len(set(chosen)) == min(frames, length)
    assert 1 <= chosen[0] <= chosen[-1] <= length


@pytest.mark.parametrize("moved", [None, 0.5])
def test_people_are_drawn_where_they_are(sequence: Sequence, truth: Truth, tmp_path: Path, moved: float | None) -> None:
    """moved: the tracks are, and are drawn in place of the truth."""
    tracks = None if moved is None else [t.replace(pos=t.pos + moved) for t in people_as_tracks(truth)]
    path = contact_sheet.write_sheet(sequence, tmp_path / "new" / "sheet.png", 1, tracks)
    plan = layer_of_tracks(grouped(tracks, sequence), None, None, True) if tracks else layer_of_truth(truth, True)
    (index,) = contact_sheet.choose_frames(plan, truth.length, truth.fps, 1)
    (part,) = contact_sheet.views(sequence, [plan, plan], [index])
    picture = cv2.imread(str(path))
    scale = contact_sheet.WIDTH / 2 / (part.high - part.low)[0]
    ((x, y),) = truth.at(index).pos[truth.at(index).id == 7] + (moved or 0.0)
    u, v = 10 + (x - part.low[0]) * scale, (contact_sheet.HEAD + contact_sheet.TITLE) / 2 + (part.high[1] - y) * scale
    np.testing.assert_allclose(picture[round(v), round(u)], colour(7), atol=12)
    np.testing.assert_allclose(picture[round(v) + 30, round(u) + 30], FLOOR, atol=12)


def test_without_people_there_is_no_sheet(sequence: Sequence, tmp_path: Path) -> None:
    nobody = bare(10, {}).replace(box=np.zeros((0, 4)))
    for load in (None, lambda: bare(10, {}), lambda: nobody):
        with pytest.raises(InputError, match="no labelled people"):
            contact_sheet.write_sheet(Sequence("none", 10.0, 10, sequence.frames, load), tmp_path / "none.png")
    assert not (tmp_path / "none.png").exists()


def test_points_in_an_image_without_size_are_in_view_however_far_they_go() -> None:
    truth = bare(10, {})
    tracks = [t.replace(plane="image") for t in people_as_tracks(truth.replace(
        frame=np.arange(1, 11), id=np.ones(10, np.int64), group=np.full(10, -1), visibility=np.ones(10),
        pos=np.array([[200.0, 400.0 * k] for k in range(10)]),
    ))]  # fmt: skip
    unknown = Sequence("t", 10.0, 10, lambda: iter(()))
    (part,) = contact_sheet.views(unknown, [layer_of_tracks(tracks, None, None, False)], [5])
    area = np.zeros((part.height(), contact_sheet.WIDTH, 3), np.uint8)
    part.draw(area, 5, 10.0)
    assert part.height() <= 1.2 * contact_sheet.WIDTH
    assert len(np.unique(area.reshape(-1, 3), axis=0)) > 1


def test_each_panel_shows_its_frame(tmp_path: Path) -> None:
    """Without labels too: frames spread over the recording."""
    bare = sequence(60)
    chosen = contact_sheet.choose_frames(NO_LAYER, 60, 10.0, 4)
    (part,) = contact_sheet.views(bare, [NO_LAYER], chosen)
    for index in chosen:
        area = np.zeros((SIZE[1] * 4, SIZE[0] * 4, 3), np.uint8)
        part.draw(area, index, 10.0)
        assert number(area, 0, 4) == index
    read = cv2.imread(str(contact_sheet.write_sheet(bare, tmp_path / "s.png", 4)))
    shrunk = contact_sheet.WIDTH / 2 / SIZE[0]
    top = (contact_sheet.HEAD + contact_sheet.TITLE) // 2
    first = cv2.resize(read[top : top + round(SIZE[1] * shrunk), 10 : 10 + contact_sheet.WIDTH // 2], SIZE)
    assert number(first) == chosen[0]
