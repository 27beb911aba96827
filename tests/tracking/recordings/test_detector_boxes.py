"""Boxes of a detector beside a video: both forms give the same tracks, and what does not fit is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Frame
from tests.recordings import mot_folder
from tests.small_videos import picture, write_video
from tracking.app.cli import run
from tracking.recordings.detector_boxes import with_boxes
from tracking.recordings.options import BoxOptions
from tracking.recordings.source import open_source

ROWS = [(k, 10.0 + 2 * k, 20.0, 12.0, 30.0, 0.9) for k in range(1, 13)]


@pytest.fixture
def video(tmp_path):
    return write_video(tmp_path / "street.mp4", [picture(k) for k in range(12)])


@pytest.fixture
def plain(video):
    return open_source(video)[0]


def mot(path, rows=ROWS):
    path.write_text("".join(f"{k},-1,{x},{y},{w},{h},{s}\n" for k, x, y, w, h, s in rows))
    return path


def results(rows, **other):
    return json.dumps([{"image_id": k, "category_id": 1, "bbox": box, "score": s, **other} for k, *box, s in rows])


def coco(path, rows=ROWS, **other):
    path.write_text(results(rows, **other))
    return path


def test_both_forms_are_the_same_detections(tmp_path, plain):
    one, other = (
        with_boxes(plain, path)
        for path in (mot(tmp_path / "det.txt"), coco(tmp_path / "det.json", [*ROWS[6:], *ROWS[:6]]))
    )
    assert one.has_images
    assert one.has_detections
    for a, b, frame in zip(one, other, plain, strict=True):
        assert a.t == a.detections.t == frame.t
        assert (a.image == frame.image).all()
        for name in ("pos", "box", "score"):
            np.testing.assert_array_equal(getattr(a.detections, name), getattr(b.detections, name))
        assert a.detections.box.tolist() == [list(ROWS[a.index - 1][1:5])]
    assert [f.image for f in one.without_pictures()] == [None] * 12


def test_tracks_of_boxes_on_a_video(tmp_path, video, capsys):
    boxes = coco(tmp_path / "det.json", category_id=3)
    command = ["track", "blob", str(video), "--boxes", str(boxes), "--px-per-m", "18"]
    assert run([*command, "--out", str(tmp_path / "a")]) == 2  # nobody is of category 1
    assert run([*command, "--class", "3", "--out", str(tmp_path / "both")]) == 0
    info = json.loads((tmp_path / "both" / "run.json").read_text())
    assert (info["detections"], info["input"]) == ("both", "pixels and boxes")
    assert info["detections_hash"]
    assert info["background"]
    capsys.readouterr()
    assert run([*command, "--class", "3", "--detections", "file", "--out", str(tmp_path / "a")]) == 0
    assert "12 frames, 1 track, 0 groups" in capsys.readouterr().out
    assert json.loads((tmp_path / "a" / "run.json").read_text())["detections"] == "file"
    assert run(["track", "relational", *command[2:], "--class", "3", "--out", str(tmp_path / "other")]) == 0
    assert json.loads((tmp_path / "other" / "run.json").read_text())["detections"] == "file"
    assert run(["overlay", str(video), str(tmp_path / "a"), "--out", str(tmp_path / "a.mp4")]) == 0
    assert run([*command, "--detections", "image", "--out", str(tmp_path / "b")]) == 2


def timed(path, times, name="t"):
    rows = [f"{t},{x},{y},{w},{h}" for t, (_, x, y, w, h, _) in zip(times, ROWS, strict=True)]
    path.write_text("\n".join([f"{name},left,top,width,height", *rows]))
    return path


@pytest.mark.parametrize("name", ["t", "time", "timestamp"])
def test_times_belong_to_the_nearest_frame(tmp_path, plain, name):
    times = [frame.t + off / plain.fps for frame, off in zip(plain, [0.4, -0.4] * 6, strict=True)]
    for frame in with_boxes(plain, timed(tmp_path / "det.csv", times, name)):
        assert frame.detections.box.tolist() == [list(ROWS[frame.index - 1][1:5])]


def test_times_of_frames_at_a_varying_rate(tmp_path, plain):
    times = (np.arange(12) + np.arange(12) ** 2 / 8) / plain.fps
    varying = replace(plain, bare=lambda: (Frame(k, t) for k, t in enumerate(times, 1)))
    for frame in with_boxes(varying, timed(tmp_path / "det.csv", times)):
        assert frame.detections.box.tolist() == [list(ROWS[frame.index - 1][1:5])]


def test_times_of_no_frame_are_left_out(tmp_path, plain):
    step = 1 / plain.fps
    # before and after the video, and a second picture of frame 5
    times = [-step, *(k * step for k in range(1, 10)), 4.3 * step, 20 * step]
    with pytest.warns(UserWarning, match="3 of 12 boxes have times of no frame, or of one that has nearer"):
        found = with_boxes(plain, timed(tmp_path / "det.csv", times))
    assert [len(frame.detections.box) for frame in found] == [0, *[1] * 9, 0, 0]
    with pytest.warns(UserWarning, match="are taken as ms"):
        found = with_boxes(plain, timed(tmp_path / "det.csv", np.arange(12) * 1000 * step))
    assert [len(frame.detections.box) for frame in found] == [1] * 12
    with pytest.raises(InputError, match=r"\d+ of 12 boxes have times of no frame.* expected times of 12 frames"):
        with_boxes(plain, timed(tmp_path / "det.csv", 1e9 + np.arange(12) * step))  # of the clock


def test_of_more_pictures_than_frames_the_nearest_count(tmp_path, plain):
    with pytest.warns(UserWarning, match="8 of 12 boxes have times of no frame, or of one that has nearer"):
        found = with_boxes(plain, timed(tmp_path / "det.csv", np.arange(12) / 4 / plain.fps))
    assert sum(len(frame.detections.box) for frame in found) == 4


def test_frames_are_used_if_there_are_times_too(tmp_path, plain):
    path = tmp_path / "det.csv"
    path.write_text("t,frame,left,top,width,height\n99,3,10,20,12,30\n")
    with pytest.warns(UserWarning, match="not used: t"):
        found = with_boxes(plain, path)
    assert [len(frame.detections.box) for frame in found] == [0, 0, 1, *[0] * 9]


@pytest.mark.filterwarnings("ignore:.*are taken as frames")
@pytest.mark.parametrize("numbers", [(1, 2, 3), (4, 10, 16)])
def test_boxes_may_be_numbered_like_the_pictures(tmp_path, numbers):
    shown = {f"img1/{k:06d}.jpg": picture(k) for k in (4, 10, 16)}
    (plain,) = open_source(mot_folder(tmp_path, None, None, "frameRate=10\n", shown))
    rows = [(n, *row[1:]) for n, row in zip(numbers, ROWS, strict=False)]
    found = with_boxes(plain, mot(tmp_path / "det.txt", rows))
    assert [frame.detections.box.tolist() for frame in found] == [[list(row[1:5])] for row in ROWS[:3]]


MISFITS = [
    ("det.json", results([(13, *ROWS[0][1:])]), "frame 13"),
    ("det.json", results([(k, 400.0, y, w, h, s) for k, _, y, w, h, s in ROWS]), "boxes that end at"),
    ("det.json", results([(0, *ROWS[0][1:])]), "result 1: got 0,.* expected frames from 1"),
    ("det.json", results([(1, 10.0, 20.0, 0.0, 30.0, 0.9)]), "result 1: .* width and height above 0"),
    ("det.json", results([ROWS[0], (1, 1e12, 20.0, 9.0, 30.0, 0.9)]), r"result 2: .* numbers within 1e\+06"),
    ("det.json", results([(1e300, *ROWS[0][1:])]), "result 1: .* a whole number"),
    ("det.json", results([("1.jpg", *ROWS[0][1:])]), 'result 1: got {"image_id": "1.jpg"'),
    ("det.json", results([(k, x / 320, y / 240, w / 320, h / 240, s) for k, x, y, w, h, s in ROWS]), "expected pixels"),
    ("det.json", "[]", "no box"), ("det.txt", "", "no box"), ("det.csv", "t,left,top,width,height\n", "no box"),
    ("det.json", "[" * 100_000, "deeper nesting"),
    ("det.json", '[{"image_id": NaN}]', "NaN, which is no number of JSON"),
    ("det.json", "{}", "no list"),
    ("det.json", '[{"image_id": 1', "line 1: got no JSON"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "got"), MISFITS)
def test_what_does_not_fit_is_refused(tmp_path, plain, name, text, got):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=got):
        with_boxes(plain, tmp_path / name)


NO_CLASSES = [
    (-1, lambda path, plain: with_boxes(plain, path, BoxOptions(person_class=("1",)))),
    (-1, lambda path, _: open_source(path, fps=10, person_class=1)),
    (1, lambda path, _: open_source(path, fps=10, person_class=1)[0].truth),
]


@pytest.mark.parametrize(("id", "read"), NO_CLASSES, ids=["boxes", "detections", "people"])
def test_a_class_of_a_text_without_classes_is_refused(tmp_path, plain, id, read):
    (tmp_path / "a.txt").write_text(f"1,{id},10,20,12,30,0.9\n2,{id},11,20,12,30,0.9\n")
    with pytest.raises(InputError, match="--class: got no classes; expected a column class"):
        read(tmp_path / "a.txt", plain)


def test_boxes_of_another_picture_size(tmp_path, plain):
    large = [(k, 4 * x, 4 * y, 4 * w, 4 * h, s) for k, x, y, w, h, s in ROWS]
    found = with_boxes(plain, coco(tmp_path / "det.json", large), BoxOptions(box_scale=(0.25, 0.25)))
    assert next(iter(found)).detections.box.tolist() == [list(ROWS[0][1:5])]


@pytest.mark.filterwarnings("ignore:.*mapped into 0 to 1")
def test_least_score_is_that_of_the_file(tmp_path, plain):
    rows = [(*row[:5], score) for row in ROWS for score in (-2.0, 4.0, 9.0)]  # which are mapped into 0 to 1
    for path in (mot(tmp_path / "det.txt", rows), coco(tmp_path / "det.json", rows)):
        every, some = (with_boxes(plain, path, BoxOptions(min_score=least)) for least in (None, 4.0))
        for all_of, kept in zip(every, some, strict=True):
            np.testing.assert_array_equal(kept.detections.score, all_of.detections.score[1:])
        with pytest.raises(InputError, match="at most 9, the greatest score"):
            with_boxes(plain, path, BoxOptions(min_score=10.0))


def test_scores_of_other_classes_do_not_count(tmp_path, plain):
    path = tmp_path / "det.csv"
    lines = [f"{k},{x},{y},{w},{h},{s},{c}" for k, x, y, w, h, _ in ROWS for s, c in ((0.3, 1), (9.0, 3))]
    path.write_text("frame,left,top,width,height,score,class\n" + "\n".join(lines))
    assert {s for f in with_boxes(plain, path, BoxOptions(("1",))) for s in f.detections.score.tolist()} == {0.3}
    with pytest.raises(InputError, match=r"at most 0\.3, the greatest score"):
        with_boxes(plain, path, BoxOptions(("1",), min_score=0.5))


def test_least_score_of_a_recording(tmp_path):
    (tmp_path / "det").mkdir()
    mot(tmp_path / "det" / "det.txt", [(*row[:5], score) for row in ROWS for score in (0.3, 0.8)])
    (sequence,) = open_source(tmp_path, fps=10, min_score=0.5)
    assert [frame.detections.score.tolist() for frame in sequence] == [[0.8]] * 12
    with pytest.raises(InputError, match="--class: got no classes"):
        open_source(tmp_path, fps=10, person_class=1)
    with pytest.raises(InputError, match="--min-score"):
        open_source(write_video(tmp_path / "street.mp4", [picture(0)]), min_score=0.5)
