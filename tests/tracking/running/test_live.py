"""A live run is the run of the recording, frame by frame, to the last bit."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tracking
from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.pictures.background_sample import BackgroundChoice, GivenSample
from sim.sequence import simulate
from tracking.recordings.source import open_source
from tracking.running.tracker_registry import names

LEARNED = 30


@pytest.fixture(scope="module")
def scene():
    sequence = simulate(load("mixed"), 20000, streams=("left",))
    frames = list(sequence)[:90]
    pictures = np.array([frames[k - 1].image for k in BackgroundChoice("learn", LEARNED).indices(LEARNED)])
    load_background = GivenSample(BackgroundChoice("learn", LEARNED), pictures)
    return replace(sequence, frames=lambda: iter(frames), bare=None, length=90, load_background=load_background), frames


def content(tracks):
    return [
        (
            t.index, t.plane, t.id.tolist(), t.group.tolist(), t.pos.tolist(), np.nan_to_num(t.vel, nan=1e9).tolist(),
            None if t.box is None else t.box.tolist(), [repr(e) for e in t.events],
            None if t.groups is None else (t.groups.id.tolist(), [h.tolist() for h in t.groups.hull]),
        )
        for t in tracks
    ]  # fmt: skip


def played(live, frames, given, again=None):
    """The completed tracks of a live run, which is pickled before frame `again`, and what run.json says."""
    found = []
    for frame in frames:
        if frame.index == again:
            live = pickle.loads(pickle.dumps(live))
        now = live.step(**given(frame))
        assert now.index == frame.index
        found += now.completed
    for t in live.finish().completed:
        found = [*found[:-1], t] if found and found[-1].index == t.index else [*found, t]
    return found, live.info()


KINDS = {
    "pixels": ("image", lambda f: {"image": f.image}),
    "both": (
        "both",
        lambda f: {
            "image": f.image,
            "boxes": f.detections.box,
            "points": f.detections.pos,
            "scores": f.detections.score,
        },
    ),
    "boxes": ("file", lambda f: {"boxes": f.detections.box, "points": f.detections.pos, "scores": f.detections.score}),
}


@pytest.mark.parametrize(
    ("name", "kind"),
    [(name, kind) for name in names() if name != "stereo" for kind in ("pixels", "boxes")] + [("blob", "both")],
)
def test_every_tracker_says_live_what_it_says_of_the_recording(scene, name, kind):
    sequence, frames = scene
    mode, given = KINDS[kind]
    run = tracking.track(name, sequence, detections=mode)
    live = tracking.Live(
        name, fps=sequence.fps, camera=sequence.camera, scene=sequence.scene, image_size=sequence.image_size,
        background=f"learn:{LEARNED}",
    )  # fmt: skip
    found, info = played(live, frames, given, again=50)
    assert content(found) == content(run)
    assert any(len(t.id) for t in found)
    assert {k: info[k] for k in ("plane", "px_per_m", "causal", "frames")} == {
        k: run.info[k] for k in ("plane", "px_per_m", "causal", "frames")
    }
    if kind == "pixels":
        assert not any(len(t.id) for t in found[:LEARNED]), "nobody is tracked while a background is learned"


def walkers(count=400, lost=()):
    """Boxes of two people who walk side by side, and of a third one, in a picture without a camera."""
    r = np.random.default_rng(0)
    for k in range(1, count + 1):
        foot = np.array([[3 * k % 600, 300.0], [3 * k % 600 + 30, 300.0], [620 - 3 * k % 600, 420.0]])
        height = foot[:, 1:] * 0.4
        box = np.hstack([foot - [15, 0] - height * [0, 1], np.full((3, 1), 40.0), height])
        box += r.normal(0, 0.5, box.shape)
        if k not in lost:
            yield k, box


def test_scale_and_ground_are_learned_from_the_first_boxes_as_of_a_recording(tmp_path):
    text = tmp_path / "det.txt"
    rows = [(k, -1, *box, 1) for k, boxes in walkers() for box in boxes.tolist()]
    text.write_text("".join(",".join(map(str, row)) + "\n" for row in rows))
    (sequence,) = open_source(text, fps=10)
    run = tracking.track("blob", sequence)
    live = tracking.Live("blob", fps=10)
    learns, found = [], []
    for k, boxes in walkers():
        now = live.step(boxes=boxes, scores=np.ones(3), t=(k - 1) / 10)
        learns.append(now.learns)
        found += now.completed
    found += [t for t in live.finish().completed if t.index > found[-1].index]
    assert content(found[:-1]) == content(run)[:-1]
    assert learns[0] == "scale"
    assert "ground" in learns
    assert learns[-1] == ""
    assert live.info()["ground"] == run.info["ground"] == "boxes"


def test_lost_frames_are_frames_without_measurement():
    lost = {*range(100, 104), 200}
    live, whole = (tracking.Live("blob", fps=10, px_per_m=60, image_size=(640, 480)) for _ in range(2))
    found, expected = [], []
    for k, boxes in walkers(300):
        expected += whole.step(**({} if k in lost else {"boxes": boxes})).completed
    for k, boxes in walkers(300, lost):
        found += live.step(boxes=boxes, t=(k - 1) / 10).completed
    assert content(found) == content(expected)
    assert live.unobserved == [(100, 103), (200, 200)]


def test_a_clock_that_does_not_begin_at_zero():
    live = tracking.Live("blob", fps=10, px_per_m=60)
    for k, boxes in walkers(20):
        now = live.step(boxes=boxes, t=1.7e9 + k / 10)
    assert now.index == 20


def test_times_that_are_not_exact_lose_no_frame():
    live = tracking.Live("blob", fps=10, px_per_m=60)
    for k, boxes in walkers(40):
        now = live.step(boxes=boxes, t=k / 10 + 0.04 * (-1) ** (k // 2))
    assert abs(now.index - 41) <= 1
    assert sum(last - first + 1 for first, last in live.unobserved) <= 2


@pytest.mark.parametrize("t", [40.0, 400.0])
def test_a_long_time_without_frames_is_warned_of(t):
    """As if milliseconds, or the seconds since the machine started, were given."""
    live = tracking.Live("blob", fps=10, px_per_m=60)
    live.step(boxes=[], t=0.0)
    with pytest.warns(UserWarning, match="t is in seconds from 0"):
        live.step(boxes=[], t=t)


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        ([{}], "nothing"),
        ([{"boxes": [[1, 2, 3]]}], "boxes"),
        ([{"boxes": "x"}], "boxes"),
        ([{"boxes": [[1, 2, 3, 4]], "scores": [1, 1]}], "2 scores"),
        ([{"boxes": []}, {"boxes": [], "t": 0.0}], "0.1 s or later"),
        ([{"boxes": []}, {"image": np.zeros((4, 4, 3), np.uint8)}], "picture"),
        ([{"image": np.zeros((4, 4), np.uint8)}], "image"),
        ([{"boxes": [], "t": float("nan")}], "t: got nan"),
        ([{"boxes": [], "t": 1.7e12}], "divide milliseconds by 1000"),
    ],
)
def test_a_wrong_frame_is_named(steps, words):
    live = tracking.Live("blob", fps=10, px_per_m=60)
    *before, last = steps
    for step in before:
        live.step(**step)
    with pytest.raises(InputError, match=words):
        live.step(**last)


@pytest.mark.parametrize("options", [{"fps": 0}, {"fps": 10, "px_per_m": -1}, {"fps": 10, "background": "first:50"}])
def test_a_wrong_option_is_named(options):
    with pytest.raises(InputError):
        tracking.Live("blob", **options)


def test_wrong_parameters_are_refused_at_once(tmp_path: Path) -> None:
    """A camera would be opened first otherwise."""
    (tmp_path / "p.toml").write_text('tracker = "blob"\n[policy.gate]\nresidul = 1.0\n')
    for params, words in (
        (tmp_path / "p.toml", "did you mean residual"),
        ({"gaet": 1}, "gate"),
        ("nofile.toml", "nofile"),
    ):
        with pytest.raises(InputError, match=words):
            tracking.Live("blob", fps=10, params=params)


def test_boxes_of_negative_size_are_refused() -> None:
    with pytest.raises(InputError, match="negative width or height"):
        tracking.Live("blob", fps=10, px_per_m=40).step(boxes=[[1, 2, -30, 80]])
