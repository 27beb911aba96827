"""Tracks that hardly match because they are read wrongly: the warning names the right reading, and its remedy helps."""

import numpy as np
import pytest

from sim.types import Tracks, Truth
from tests.recordings import mot_folder
from tracking.app.cli import run
from tracking.scoring.misreading import likely_misreading

SIZE = (1920, 1080)
FRAMES, PEOPLE = 40, 7


def walk(seed=0):
    """Rows frame, id, left, top, width, height of people who walk in a picture of 1920 × 1080."""
    rng = np.random.default_rng(seed)
    start, step = rng.uniform((100, 300), (1700, 800), (PEOPLE, 2)), rng.uniform(-6, 6, (PEOPLE, 2))
    frame, who = (a.ravel() for a in np.meshgrid(np.arange(1, FRAMES + 1), np.arange(PEOPLE), indexing="ij"))
    foot = start[who] + step[who] * frame[:, None]
    height = foot[:, 1] * 0.3
    return np.c_[frame, who + 1, foot[:, 0] - height * 0.2, foot[:, 1] - height, height * 0.4, height]


def truth_of(rows, pos=None):
    frame, id = rows[:, 0].astype(int), rows[:, 1].astype(int)
    return Truth(
        "x", 25.0, int(frame.max()), 40.0, frame, id, np.full(len(rows), -1), pos, None,
        None if pos is not None else rows[:, 2:6], np.ones(len(rows)),
    )  # fmt: skip


def tracks_of(frame, id, box=None, pos=None):
    found = []
    for k in range(1, int(frame.max()) + 1):
        r = frame == k
        n, here = int(r.sum()), box[r, :2] + box[r, 2:] / 2 if pos is None else pos[r]
        found.append(Tracks(
            k, k / 25, "image" if pos is None else "ground", "person", id[r].astype(int), np.full(n, -1), here,
            np.full((n, 2), np.nan), np.full((n, 4, 4), np.nan), None if box is None else box[r], np.ones(n),
        ))  # fmt: skip
    return found


def seen(rows):
    """The walk with the errors of a detector, and without one person."""
    rows = rows[rows[:, 1] > 1]
    return np.c_[rows[:, :2], rows[:, 2:] + np.random.default_rng(5).normal(0, 2, (len(rows), 4))]


def corners(box):
    return np.c_[box[:, :2], box[:, :2] + box[:, 2:]]


def centres(box):
    return np.c_[box[:, :2] + box[:, 2:] / 2, box[:, 2:]]


WRITTEN = {
    "x1,y1,x2,y2": corners, "cx,cy,width,height": centres, "y1,x1,y2,x2": lambda box: corners(box)[:, [1, 0, 3, 2]],
    "x1,x2,y1,y2": lambda box: corners(box)[:, [0, 2, 1, 3]],
    "top,left,height,width": lambda box: box[:, [1, 0, 3, 2]], "left,top,width,height": lambda box: box,
}  # fmt: skip
# Factors that make the boxes pixels again, and the value of --box-scale.
SCALES = {
    (1.0, 1.0): "", (2.0, 2.0): "2", (1.5, 1.5): "1.5", (0.5, 0.5): "0.5", (3.0, 1.6875): "3,1.6875",
    (2.25, 2.25): "2.25", (1.92, 1.08): "1.92,1.08", (1 / 3, 1 / 3): "0.33333",
}  # fmt: skip


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("columns", WRITTEN)
def test_columns_and_scales(columns, scale):
    rows = walk()
    found = seen(rows)
    wrong = WRITTEN[columns](found[:, 2:] / np.tile(scale, 2))
    text = likely_misreading(truth_of(rows), tracks_of(found[:, 0], found[:, 1], wrong), size=SIZE)
    usual = columns == "left,top,width,height"
    assert bool(text) == (not usual or scale != (1.0, 1.0))
    assert (f"read as {columns}" in text) == (not usual)
    assert (f"frame,id,{columns}," in text) == (not usual)
    assert (f"--box-scale {SCALES[scale]}" in text) == (scale != (1.0, 1.0))


@pytest.mark.parametrize(("share", "named"), [(0.2, False), (0.4, True)])
def test_a_reading_is_named_only_if_it_matches_many_more_boxes(share, named):
    rows = walk()
    away = (np.random.default_rng(3).random((len(rows), 1)) > share) * (3000, 3000, 3000, 3000)
    found = corners(rows[:, 2:]) + away
    text = likely_misreading(truth_of(rows), tracks_of(rows[:, 0], rows[:, 1], found), size=SIZE)
    assert text
    assert ("read as x1,y1,x2,y2" in text) == named


def test_shares_of_the_picture():
    rows = walk()
    found = seen(rows)
    shares = tracks_of(found[:, 0], found[:, 1], centres(found[:, 2:]) / np.tile(SIZE, 2))
    text = likely_misreading(truth_of(rows), shares, size=SIZE)
    assert "read as cx,cy,width,height and multiplied by 1920,1080, 100% would" in text
    assert "--box-scale 1920,1080" in text


RENUMBERED = [
    (lambda frame: frame + 1, "with -1 on frame numbers, 100% would"),
    (lambda frame: frame - 1, "with +1 on frame numbers, 100% would"),
    (lambda frame: (frame + 2) % FRAMES + 1, "with -3 on frame numbers"),
    (lambda frame: frame - 20, "with +20 on frame numbers, 100% would"),
    (lambda frame: (frame - 1) / 5 + 1, "with frames numbered 1, 6, 11, …"),
]
SLOW = [(lambda frame: frame + 1, "with -1 on their"), (lambda frame: frame - 4, "with +4 on their")]


@pytest.mark.parametrize(("number", "words", "step"), [*((*r, 60) for r in RENUMBERED), *((*r, 3) for r in SLOW)])
def test_frames_with_other_numbers(number, words, step):
    rows = walk()
    rows[:, 2:4] += rows[:, :1] * (step, 0)
    frame = number(rows[:, 0])
    kept = (frame >= 1) & (frame <= FRAMES) & (frame % 1 == 0)
    assert words in likely_misreading(truth_of(rows), tracks_of(frame[kept], rows[kept, 1], rows[kept, 2:]))


@pytest.mark.parametrize("share", [1, 0.3])
def test_no_warning_for_weak_trackers(share):
    """False alarms and misses alone are no misreading."""
    rows = walk()
    rng = np.random.default_rng(3)
    box = np.where(rng.random((len(rows), 1)) < share, rows[:, 2:], rows[:, 2:] + (200, 0, 0, 0))
    assert likely_misreading(truth_of(rows), tracks_of(rows[:, 0], rows[:, 1], box), size=SIZE) == ""


WRONG_POSITIONS = [
    (lambda p: p * 100, "frame,id,x_cm,y_cm,"), (lambda p: p * 1000, "frame,id,x_mm,y_mm,"),
    (lambda p: p[:, ::-1], "read as y,x"), (lambda p: p * 40, "give positions in m"),
    (lambda p: p / 1000, "frame,id,x_km,y_km,"), (lambda p: p[:, ::-1] * 100, "frame,id,y_cm,x_cm,"),
]  # fmt: skip


@pytest.mark.parametrize(("wrong", "words"), WRONG_POSITIONS)
def test_positions(wrong, words):
    rows = walk()
    pos = np.c_[rows[:, 2] / 50, rows[:, 3] / 30]
    text = likely_misreading(truth_of(rows, pos), tracks_of(rows[:, 0], rows[:, 1], None, wrong(pos)))
    assert "of the tracked positions match labels (1 m)" in text
    assert words in text.replace("Give", "give")


def test_no_unit_is_named_for_positions_that_it_merely_shrinks_to_the_origin():
    rows, rng = walk(), np.random.default_rng(0)
    near, away = rng.uniform(-0.5, 0.5, (len(rows), 2)), rng.normal((80, 90), 2, (len(rows), 2))
    text = likely_misreading(truth_of(rows, near), tracks_of(rows[:, 0], rows[:, 1], None, away))
    assert "x_m" not in text
    assert "by 0," not in text


def score(capsys, *words):
    import json

    capsys.readouterr()
    assert run([*map(str, ("score", *words)), "--json"]) == 0
    printed = capsys.readouterr()
    return json.loads(printed.out)["mean"]["HOTA"]["mean"], printed.err


def test_the_warning_of_score_and_its_remedy(tmp_path, capsys):
    rows = walk()
    ini = f"name=cam\nframeRate=25\nseqLength={FRAMES}\nimWidth=1920\nimHeight=1080\n"
    folder, text = mot_folder(tmp_path / "cam", "", ini=ini), tmp_path / "res.txt"
    np.savetxt(folder / "gt" / "gt.txt", np.c_[rows, np.ones((len(rows), 3))], fmt="%.6g", delimiter=",")
    np.savetxt(text, np.c_[rows[:, :2], corners(rows[:, 2:]) / 2, np.ones(len(rows))], fmt="%.6g", delimiter=",")
    low, told = score(capsys, folder, text)
    assert low < 0.05
    assert told.count("warning:") == 1
    assert "name all columns in a first line of the text: frame,id,x1,y1,x2,y2,… and add --box-scale 2" in told.lower()
    text.write_text("frame,id,x1,y1,x2,y2,score\n" + text.read_text())
    high, told = score(capsys, folder, text, "--box-scale", "2")
    assert (high, told) == (pytest.approx(1, abs=1e-3), "")
