"""The classes of the guide "Trackers of other libraries", around stand-ins of these libraries, or the libraries.

The stand-ins have the same modules, classes and fields, as their documentation describes them, and answer with what is
written below, in the libraries' own formats. Tests of the libraries themselves are skipped where these are absent;
`python -m benchmarks peers` installs them into folders, which PYTHONPATH may name.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from datetime import datetime
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from benchmarks.peers.__main__ import BOXES
from benchmarks.peers.adapters import PEERS
from scenarios import load
from sim.sequence import simulate
from sim.types import Detections, Frame, Sequence, Tracks
from tests.tracking.app.test_guides import BLOCK, GUIDES, SAVED, follow
from tracking.running.run import track
from tracking.scoring import evaluate

FPS = 5.0
# frame: (id, left, top, right, bottom, confidence); person 2 is confirmed in frame 2, person 1 is lost in frame 3
RECORDED = {
    1: [(1, 10, 20, 30, 80, 0.9)],
    2: [(1, 12, 20, 32, 80, 0.8), (2, 100, 20, 120, 70, 0.7)],
    3: [(2, 101, 20, 121, 70, 0.6)],
}
UUIDS = {1: "5b3c1c9e-5d0a-4e8b-8b0e-7d5f0b0c1a11", 2: "0a6f2f0e-91f0-4a4e-b8b7-2f9b3c4d5e6f"}


class Answers:
    """Gives what was recorded for the first call, the second, …; nothing after that."""

    def __init__(self, *_, **__) -> None:
        self.frame = 0
        self.given: list[object] = []

    def next(self, given: object) -> np.ndarray:
        self.frame += 1
        self.given.append(given)
        return np.array(RECORDED.get(self.frame, []), float).reshape(-1, 6)


class BoxDetections:
    """As supervision.Detections."""

    def __init__(self, xyxy, confidence=None, class_id=None, tracker_id=None) -> None:
        assert xyxy.shape == (len(confidence), 4)
        assert len(class_id) == len(xyxy)
        self.xyxy, self.confidence, self.class_id, self.tracker_id = xyxy, confidence, class_id, tracker_id


class ByteTrackTracker(Answers):
    """As trackers.ByteTrackTracker: detections that belong to no confirmed track have the id -1."""

    def update(self, detections: BoxDetections) -> BoxDetections:
        found = np.concatenate([self.next(detections), [[-1, 0, 0, 5, 5, 0.3]]])
        return BoxDetections(found[:, 1:5], found[:, 5], np.zeros(len(found), int), found[:, 0].astype(int))


class ByteTrack(Answers):
    """As boxmot.ByteTrack: rows x1, y1, x2, y2, id, confidence, class, index of the detection."""

    def update(self, rows: np.ndarray) -> np.ndarray:
        assert rows.ndim == 2
        assert rows.shape[1] == 6
        found = self.next(rows)
        if not len(found):
            return np.array([])
        return np.c_[found[:, 1:5], found[:, [0, 5]], np.zeros((len(found), 2))]


class NorfairTracker(Answers):
    """As norfair.Tracker: objects that coast have no live points."""

    def update(self, detections: list[SimpleNamespace]) -> list[SimpleNamespace]:
        assert all(one.points.shape == (2, 2) for one in detections)
        found = [
            SimpleNamespace(
                id=int(id), estimate=np.array(box).reshape(2, 2), live_points=np.array([True, True]),
                last_detection=SimpleNamespace(scores=np.full(2, score)),
            )
            for id, *box, score in self.next(detections)
        ]  # fmt: skip
        coasting = SimpleNamespace(id=9, estimate=np.zeros((2, 2)), live_points=np.array([False, False]))
        return [*found, coasting]


class MultiTargetTracker(Answers):
    """As stonesoup.tracker.simple.MultiTargetTracker: pulls from its detector, gives the time and a set of tracks."""

    def __init__(self, initiator, deleter, detector, data_associator, updater) -> None:
        super().__init__()
        self.detector = detector

    def __iter__(self):
        return self

    def __next__(self):
        time, detections = next(iter(self.detector))
        assert all(one.timestamp == time for one in detections)
        return time, {self._track(time, int(row[0]), row[1:3]) for row in self.next(detections)}

    def _track(self, time: datetime, id: int, place: np.ndarray):
        x, y = place / 10
        state = SimpleNamespace(state_vector=np.array([[x], [0.5], [y], [-0.5]]), covar=np.diag([1.0, 2.0, 3.0, 4.0]))
        return Hashable(id=UUIDS[id], state=state, timestamp=time)


class Hashable(SimpleNamespace):
    __hash__ = object.__hash__


class Part(Hashable):
    """Any part of a tracker, which keeps its arguments."""

    def __init__(self, *args, **fields) -> None:
        super().__init__(args=args, **fields)


STONE_SOUP = {
    "dataassociator.neighbour": ["GNNWith2DAssignment"], "deleter.time": ["UpdateTimeStepsDeleter"],
    "hypothesiser.distance": ["DistanceHypothesiser"], "initiator.simple": ["SimpleMeasurementInitiator"],
    "measures": ["Mahalanobis"], "models.measurement.linear": ["LinearGaussian"],
    "models.transition.linear": ["CombinedLinearGaussianTransitionModel", "ConstantVelocity"],
    "predictor.kalman": ["KalmanPredictor"], "types.detection": ["Detection"], "types.state": ["GaussianState"],
    "updater.kalman": ["KalmanUpdater"],
}  # fmt: skip


@pytest.fixture
def adapters(guide_files: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """The guide's files in an empty folder, and the stand-ins as modules."""

    def module(name: str, **content) -> None:
        made = ModuleType(name)
        made.__dict__.update(content)
        monkeypatch.setitem(sys.modules, name, made)

    module("supervision", Detections=BoxDetections)
    module("trackers", ByteTrackTracker=ByteTrackTracker)
    module("boxmot", ByteTrack=ByteTrack)
    module("norfair", Tracker=NorfairTracker, Detection=Part)
    for path, names in STONE_SOUP.items():
        module(f"stonesoup.{path}", **dict.fromkeys(names, Part))
    module("stonesoup.tracker.simple", MultiTargetTracker=MultiTargetTracker)


@pytest.fixture
def guide_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The guide's files in an empty folder, where Python finds them."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    monkeypatch.delitem(sys.modules, "others", raising=False)
    text, end = (GUIDES / "adapters.md").read_text(encoding="utf-8"), 0
    for block in BLOCK.finditer(text):
        if saved := SAVED.findall(text[end : block.start()]):
            Path(saved[-1]).write_text(block[2])
        end = block.end()


def sequence(points: bool) -> Sequence:
    """Five frames with the recorded boxes, or points on the ground, in frames 1 to 3, and nothing after that."""

    def frames():
        for index in range(1, 6):
            found = np.array(RECORDED.get(index, []), float).reshape(-1, 6)
            box = np.c_[found[:, 1:3], found[:, 3:5] - found[:, 1:3]]
            pos, plane = (found[:, 1:3] / 10, "ground") if points else (box[:, :2] + box[:, 2:] / 2, "image")
            t = (index - 1) / FPS
            yield Frame(
                index, t, detections=Detections(index, t, plane, pos, None, None if points else box, found[:, 5])
            )

    return Sequence("recorded", FPS, 5, frames, has_detections=True, px_per_m=40.0, image_size=(200, 100))


def rows_of(tracks: Iterable[Tracks]) -> dict[int, list[tuple[float, ...]]]:
    found = {}
    for t in tracks:
        corners = np.c_[t.box[:, :2], t.box[:, :2] + t.box[:, 2:]]
        rows = [tuple(row) for row in np.c_[t.id, corners, t.score].round(9).tolist()]
        found |= {t.index: rows} if rows else {}
    return found


@pytest.mark.parametrize(
    "name", ["roboflow_adapter.py:Roboflow", "boxmot_adapter.py:BoxMot", "norfair_adapter.py:Norfair"]
)
def test_boxes(name: str, adapters: None) -> None:
    tracks = track(name, sequence(points=False), detections="file")
    assert rows_of(tracks) == RECORDED
    assert all(t.plane == "image" for t in tracks)


def test_points_of_stone_soup(adapters: None) -> None:
    tracks = track("stonesoup_adapter.py:StoneSoup", sequence(points=True), detections="file")
    name = {1: 0, 2: 1}
    for t in tracks:
        expected = sorted((name[id], x / 10, y / 10) for id, x, y, *_ in RECORDED.get(t.index, []))
        assert sorted(zip(t.id.tolist(), *t.pos.T.tolist(), strict=True)) == expected
        assert np.array_equal(t.vel, np.tile([0.5, -0.5], (len(t.id), 1)))
        assert np.array_equal(t.cov, np.tile(np.diag([1.0, 3.0, 2.0, 4.0]), (len(t.id), 1, 1)))


@pytest.mark.slow
def test_the_guide(adapters: None, capsys: pytest.CaptureFixture[str]) -> None:
    follow("adapters", False, capsys)


GUIDE = [
    ("trackers", "roboflow_adapter.py:Roboflow"), ("boxmot", "boxmot_adapter.py:BoxMot"),
    ("norfair", "norfair_adapter.py:Norfair"), ("stonesoup", "stonesoup_adapter.py:StoneSoup"),
]  # fmt: skip


def walkers() -> Sequence:
    """Five people who walk apart from each other, each detected in every frame by a box with small errors."""
    settings = ["camera.fps=10", "sensor.detect_prob=1", "sensor.small_px=0", "sensor.clutter_rate=0"]
    return simulate(load("side-by-side", set=settings), 40_000, streams=())


@pytest.mark.parametrize(("library", "name"), GUIDE)
@pytest.mark.filterwarnings("ignore")
def test_the_guide_with_the_libraries_themselves(library: str, name: str, guide_files: None) -> None:
    pytest.importorskip(library)
    sequence = walkers()
    assert evaluate(sequence.truth, track(name, sequence, detections="file"))["IDF1"] > 0.8


@pytest.mark.parametrize("name", PEERS)
@pytest.mark.filterwarnings("ignore")
def test_adapters_of_the_benchmark(name: str) -> None:
    library, kind = PEERS[name]
    pytest.importorskip({"roboflow": "trackers"}.get(library, library))
    sequence = walkers()
    found = list(track(kind, sequence, detections="file"))
    assert evaluate(sequence.truth, found, similarity="boxes")["IDF1"] > 0.8
    given = [frame.detections.box for frame in sequence.without_pictures()]
    off = [np.abs(t.box[:, None] - box[None]).max(2).min(1) for t, box in zip(found, given, strict=True) if len(t.box)]
    # what the benchmark's column `boxes` says
    assert (np.concatenate(off).max() < 1e-4) == (name not in BOXES)
