"""Texts whose columns 3 to 6 are no left, top, width and height in pixels."""

import re

import numpy as np
import pytest

from scenarios.errors import InputError
from tracking.recordings.options import parse_box_scale
from tracking.recordings.source import open_source
from tracking.recordings.track_texts import read_track_text

FRAMES, PEOPLE = 12, 4


def people(ids=True):
    """Rows frame, id, left, top, width, height of people who walk, as from a street camera."""
    rows = [
        (f, k if ids else -1, 150 + 200 * k + 7 * f, 40 * k + 2 * f, 40 + 5 * k, 100 + 12 * k)
        for f in range(1, FRAMES + 1)
        for k in range(1, PEOPLE + 1)
    ]
    return np.array(rows, float)


def written(tmp_path, rows, name="a.txt"):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    np.savetxt(path, rows, fmt="%.6g", delimiter=",")
    return path


def without_ids(score):
    rows = people()
    return np.c_[rows[:, 0], rows[:, 2:], np.resize(score, len(rows))]


@pytest.mark.parametrize("score", [(0.3, 0.9), (1,), (0, 1), (55.5, 90.5, 20)])
def test_rows_without_ids_are_no_guess(tmp_path, score):
    with pytest.raises(InputError, match="frame,left,top,width,height,score without an id") as error:
        open_source(written(tmp_path, without_ids(score)), fps=10)
    assert "as the first line" in error.value.remedy


@pytest.mark.parametrize("columns", [4, 6])
def test_ids_in_the_place_of_frames_are_refused(tmp_path, columns):
    rows = people()[:, [1, 0, 2, 3, 4, 5]]
    rows[:, 2] += 9 * rows[:, 0] ** 2  # people at unequal distances
    with pytest.raises(InputError, match=r"steps of .*, but of 7\.28 if frame and id change places"):
        open_source(written(tmp_path, rows[:, :columns]), fps=10)


def test_people_side_by_side_may_walk_further_in_a_frame_than_they_are_apart(tmp_path):
    rows = people()[:, :4] * (1, 1, 0, 0) + people()[:, [1, 0, 1, 0]] * (0, 0, 0.6, 2.6)
    (sequence,) = open_source(written(tmp_path, rows), fps=0.5)
    assert sequence.truth.pos[:PEOPLE] == pytest.approx(np.c_[0.6 * np.arange(1, 5), np.full(4, 2.6)])


@pytest.mark.parametrize("size", [(1920, 1080), (70, 70)])
def test_shares_of_the_picture_and_metres_are_refused_and_scaled(tmp_path, size):
    rows = people(ids=False)
    scaled = written(tmp_path, np.c_[rows[:, :2], rows[:, 2:] / (*size, *size)])
    with pytest.raises(InputError, match=r"heights of .* expected pixels; .*--box-scale WIDTH,HEIGHT"):
        open_source(scaled, fps=10)
    (sequence,) = open_source(scaled, fps=10, box_scale="{},{}".format(*size))
    box = np.concatenate([frame.detections.box for frame in sequence])
    assert box == pytest.approx(rows[:, 2:], rel=1e-5)


def test_tracks_are_scaled(tmp_path):
    path = written(tmp_path, people())
    plain, doubled = (read_track_text(path, 10, None, None, scale) for scale in (None, (2, 3)))
    assert doubled[3].box.tolist() == (plain[3].box * (2, 3, 2, 3)).tolist()
    assert doubled[3].pos.tolist() == (plain[3].pos * (2, 3)).tolist()


@pytest.mark.parametrize("text", ["0", "-1", "a", "1,2,3", "", "1,", "nan", "1e9", "1_0"])
def test_wrong_scales(text):
    with pytest.raises(InputError, match="--box-scale: got"):
        parse_box_scale(text)


def test_labels_are_not_scaled(tmp_path):
    written(tmp_path / "gt", people(), "gt.txt")
    with pytest.raises(InputError, match="none for a recording without det"):
        open_source(tmp_path, fps=10, box_scale="2")


OTHER_SIZES = [
    (0.5, "all 160 boxes lie in the upper left 500 × 500 px of the pictures of 1000 × 1000"),
    (2, "[67].% of the boxes lie beyond the pictures of 1000 × 1000"), (1, ""),
]  # fmt: skip


@pytest.mark.filterwarnings("always")
@pytest.mark.parametrize(("factor", "words"), OTHER_SIZES)
def test_boxes_of_pictures_of_another_size(tmp_path, recwarn, factor, words):
    """The warning is gone with the right --box-scale."""
    (tmp_path / "seqinfo.ini").write_text("[Sequence]\nframeRate=10\nseqLength=9\nimWidth=1000\nimHeight=1000\n")
    spread = np.linspace(0, 950, 160)
    box = np.c_[spread, np.random.default_rng(1).permutation(spread), np.full((160, 2), 50)]
    written(tmp_path / "det", np.c_[1 + np.arange(160) % 9, np.full(160, -1), box * factor], "det.txt")
    open_source(tmp_path)
    assert len(recwarn) == bool(words)
    assert re.search(words, str(recwarn.pop().message) if words else "")
    open_source(tmp_path, box_scale=str(1 / factor))
    assert not recwarn


@pytest.mark.filterwarnings("always")
@pytest.mark.parametrize("ids", [True, False])
def test_corners(tmp_path, ids):
    rows = people(ids)
    rows[:, 4:] += rows[:, 2:4]
    with pytest.warns(UserWarning, match="all 48 boxes look like x1,y1,x2,y2, but are read as left,top,width,height"):
        _ = open_source(written(tmp_path, rows), fps=10)[0].truth
    if ids:
        written(tmp_path / "gt", rows, "gt.txt")
        with pytest.warns(UserWarning, match="look like x1,y1,x2,y2"):
            _ = open_source(tmp_path, fps=10)[0].truth


FAULTS_OF_ALL_LINES = [
    (5, -5, "check the columns, which are frame,id,left,top,width,height"),
    (0, 5000, "check that this text belongs to this recording"),
]


@pytest.mark.parametrize(("column", "value", "remedy"), FAULTS_OF_ALL_LINES)
def test_a_fault_of_every_line_is_no_fault_of_a_line(tmp_path, column, value, remedy):
    rows = people()
    rows[:, column] = value
    with pytest.raises(InputError, match=f"like {len(rows)} of {len(rows)} lines") as error:
        read_track_text(written(tmp_path, rows), 10, FRAMES)
    assert remedy in error.value.remedy
    rows = people()
    rows[7, column] = value
    with pytest.raises(InputError, match="line 8: ") as error:
        read_track_text(written(tmp_path, rows), 10, FRAMES)
    assert "correct" in error.value.remedy


def test_detections_are_no_tracks(tmp_path):
    with pytest.raises(InputError, match="these are detections: `flockscope track` them first"):
        read_track_text(written(tmp_path, people(ids=False)), 10, FRAMES)
