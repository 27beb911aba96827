"""What every registered tracker promises, on every scenario of the catalogue (contract, section 3).

A tracker returns finite, well-shaped tracks; it never looks at the truth or at later frames; it changes no input; the
same seed and input give the same bytes, after a reset as in a new instance.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scenarios.loading.resolve import load
from scenarios.loading.toml_files import names as scenario_names
from sim.sequence import simulate
from sim.types import DetectionMode, Frame, Sequence, Tracks, Truth
from tracking.grouping.grouped_tracks import with_groups
from tracking.recordings.source import open_source
from tracking.running.prepare import PreparedTracker, prepare
from tracking.running.run import track
from tracking.running.tracker_registry import find, names

FPS = 5
# Frames tracked, by kind of detections.
LENGTHS = {"file": 15, "image": 12, "both": 12}
WITH_PICTURES = ("image", "both")


def forbidden_truth() -> Truth:
    raise AssertionError("a tracker looked at the truth")


@cache
def recorded(scenario: str, mode: str) -> tuple[Sequence, tuple[Frame, ...]]:
    """The sequence of a scenario without its truth, and its first frames, made once for all trackers."""
    streams = ("left", "right", "background") if mode in WITH_PICTURES else ()
    settings = [f"camera.fps={FPS}"] + (["camera.image=[160,120]"] if mode in WITH_PICTURES else [])
    sequence = simulate(load(scenario, settings), 40_001, 0, streams)
    return replace(sequence, load_truth=forbidden_truth), tuple(islice(sequence, LENGTHS[mode]))


def cut(scenario: str, mode: str, length: int) -> Sequence:
    """The first frames of a scenario as a sequence of its own."""
    sequence, frames = recorded(scenario, mode)
    return replace(sequence, frames=lambda: iter(frames[:length]), bare=None, length=length)


def run(ready: PreparedTracker) -> list[Tracks]:
    ready.reset(0)
    return [ready.step(frame) for frame in ready.frames()]


def arrays(value: Any) -> Iterator[np.ndarray]:
    """All arrays in a value made of dataclasses, tuples and arrays."""
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple):
        for item in value:
            yield from arrays(item)
    elif is_dataclass(value):
        for field in fields(value):
            yield from arrays(getattr(value, field.name))


def content(tracks: list[Tracks]) -> list[bytes]:
    """The bytes of each frame's tracks, groups and events."""
    return [b"".join(a.tobytes() for a in arrays(t)) + repr([repr(e) for e in t.events]).encode() for t in tracks]


@pytest.mark.parametrize("mode", ["file", *(pytest.param(mode, marks=pytest.mark.slow) for mode in WITH_PICTURES)])
@pytest.mark.parametrize("tracker", names())
@pytest.mark.parametrize("scenario", scenario_names())
def test_contract(scenario: str, tracker: str, mode: str) -> None:
    needs = find(tracker).needs
    if mode == "image" and not {"pixels", "stereo", "boxes"} & set(needs):
        pytest.skip(f"{tracker} takes no pictures")
    if mode == "both" and "pixels and boxes" not in needs:
        pytest.skip(f"{tracker} does not take both at once")
    length = LENGTHS[mode]
    whole = cut(scenario, mode, length)
    before = [[a.copy() for a in arrays(frame)] for frame in whole]
    ready = prepare(tracker, whole, detections=mode)
    tracks = run(ready)

    assert [t.index for t in tracks] == list(range(1, length + 1))
    reports_groups = {t.unit for t in tracks} == {"group"}
    for t in tracks:
        n, d = t.pos.shape
        assert t.vel.shape == (n, d)
        assert t.cov.shape == (n, 2 * d, 2 * d)
        assert all(np.isfinite(a).all() for a in (t.pos, t.vel, t.cov, t.score))
        assert np.allclose(t.cov, t.cov.transpose(0, 2, 1))
        assert (np.linalg.eigvalsh(t.cov) > -1e-9).all()
        assert (t.id >= 0).all()
        assert len(set(t.id.tolist())) == n
        if reports_groups:
            assert np.array_equal(t.group, t.id)
        assert all(e.emitted == t.index and e.start <= t.index for e in t.events)

    after = [list(arrays(frame)) for frame in whole]
    assert all(
        np.array_equal(a, b, equal_nan=True)
        for x, y in zip(before, after, strict=True)
        for a, b in zip(x, y, strict=True)
    )

    prefix = prepare(tracker, cut(scenario, mode, length // 2), detections=mode)
    assert content(run(prefix)) == content(tracks)[: length // 2], "a sequence cut short gives other tracks"
    assert content(run(ready)) == content(tracks), "after a reset the same input gives other tracks"
    if mode in ("file", "both"):
        assert same_answers(tracks, run(prepare(tracker, reordered(whole, 1), detections=mode))) == ""


@pytest.mark.parametrize("tracker", names())
@pytest.mark.parametrize("scenario", ["cross", "queue", "split"])
def test_derived_groups_and_events_do_not_look_ahead(scenario: str, tracker: str) -> None:
    """Groups and events, reported or derived, of a sequence cut short are those of the whole one.

    The last frame is left out: crossings and queues that are not over by then are reported there, but not by trackers
    of whole groups.
    """
    sequence = simulate(load(scenario, [f"camera.fps={FPS}"]), 40_001, 0, ())
    tracks = run(prepare(tracker, first(sequence, 120), detections="file"))
    whole = with_groups(tracks, FPS, 1.0)
    assert any(t.events for t in whole) or tracks[0].unit == "group"
    for length in range(15, len(tracks), 15):
        assert content(list(with_groups(tracks[:length], FPS, 1.0)))[:-1] == content(list(whole))[: length - 1]


def reordered(sequence: Sequence, seed: int) -> Sequence:
    """The same sequence with the detections of each frame in another order."""

    def frames() -> Iterator[Frame]:
        for frame in sequence:
            d, order = frame.detections, np.random.default_rng([seed, frame.index]).permutation
            k = order(len(d.pos))
            box = None if d.box is None else d.box[k]
            yield frame.replace(detections=d.replace(pos=d.pos[k], box=box, score=d.score[k]))

    return replace(sequence, frames=frames, bare=None)


def same_answers(first: list[Tracks], second: list[Tracks]) -> str:
    """Why two runs differ by more than the names of ids, "" if they do not.

    Of two equal groups that merge, or are made by a split, the one with the smaller id keeps its id: a tie.
    """
    ids, groups = dict[int, int](), dict[int, int]()
    for a, b in zip(first, second, strict=True):
        if len(a.id) != len(b.id):
            return f"frame {a.index}: {len(a.id)} and {len(b.id)} tracks"
        i, j = np.lexsort(a.pos.T.round(5)), np.lexsort(b.pos.T.round(5))
        for name in ("pos", "vel", "cov"):
            if not np.allclose(getattr(a, name)[i], getattr(b, name)[j], atol=1e-6):
                return f"frame {a.index}: {name} differ"
        for known, x, y in ((ids, a.id[i], b.id[j]), (groups, a.group[i], b.group[j])):
            for p, q in zip(x.tolist(), y.tolist(), strict=True):
                if a.unit == "group" and a.events:
                    known[p] = q
                if known.setdefault(p, q) != q:
                    return f"frame {a.index}: {p} was {known[p]}, now {q}"
        if sorted((e.kind, e.start) for e in a.events) != sorted((e.kind, e.start) for e in b.events):
            return f"frame {a.index}: events differ"
    return ""


def without_calibration(sequence: Sequence) -> Sequence:
    """The same people as boxes in the image of a camera that nobody knows."""

    def frames() -> Iterator[Frame]:
        for frame in sequence:
            d = frame.detections
            yield frame.replace(detections=d.replace(plane="image", pos=d.box[:, :2] + d.box[:, 2:] / 2))

    return replace(sequence, frames=frames, bare=None, camera=None, scene=None, px_per_m=float("nan"))


def first(sequence: Sequence, length: int) -> Sequence:
    """The first frames of a sequence as a sequence of its own."""
    return replace(sequence, frames=lambda: islice(sequence.frames(), length), bare=None, length=length)


@pytest.mark.parametrize("tracker", names())
@pytest.mark.parametrize("scenario", ["merge", "party"])
def test_no_look_ahead_without_a_calibration(scenario: str, tracker: str) -> None:
    """From the frame on that the run declares, a sequence cut short gives the same tracks."""
    whole = without_calibration(recorded(scenario, "file")[0])
    ready = prepare(tracker, whole, detections="file")
    assert 1 < ready.scale_frames < 40
    tracks = run(ready)
    for length in (ready.scale_frames, ready.scale_frames + 7):
        short = prepare(tracker, first(whole, length), detections="file")
        assert short.context.px_per_m == ready.context.px_per_m
        assert content(run(short)) == content(tracks)[:length]


@pytest.mark.slow
@pytest.mark.parametrize("tracker", names())
@pytest.mark.parametrize("mode", ["file", "truth"])
def test_no_look_ahead_in_a_recording(shared_data: Path, tracker: str, mode: DetectionMode) -> None:
    """The first 110 frames of PETS09-S2L1, whose scale nobody states, have the answers of the whole recording."""
    (pets,) = open_source(shared_data / "mot" / "PETS09-S2L1-first200", images=False)
    whole = track(tracker, pets, detections=mode)
    truth, columns = pets.truth, ("frame", "id", "group", "box", "visibility")
    cut = truth.replace(length=110, labelled=None, **{c: getattr(truth, c)[truth.frame <= 110] for c in columns})
    short = track(tracker, replace(first(pets, 110), load_truth=lambda: cut), detections=mode)
    assert whole.info["px_per_m_frames"] <= min(30, whole.info["causal_from"])
    assert whole.info["causal_from"] <= 110
    assert content(list(short))[:109] == content(list(whole))[:109]
