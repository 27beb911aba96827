"""Statistics of a run without truth: known values on hand-made frames, and bounds on any input."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sim.types import Detections, Frame, Groups, Tracks
from tracking.running.signals import NAMES, STATISTICS, Signals

FPS = 10.0


def tracks(
    index: int, places: Any, vel: Any = (1.0, 0.0), ids: Any = None, plane: Any = "ground", **more: Any
) -> Tracks:
    """People at places (N, 2); the variance of the prediction of a frame later is 0.05 along each axis."""
    pos = np.array(places, float).reshape(-1, 2)
    n = len(pos)
    id = np.arange(n) if ids is None else np.array(ids, np.int64)
    group = np.array(more.pop("group", np.full(n, -1)), np.int64)
    cov = np.tile(np.diag([0.04, 0.04, 1.0, 1.0]), (n, 1, 1)) if "cov" not in more else more.pop("cov")
    return Tracks(
        index,
        (index - 1) / FPS,
        plane,
        "person",
        id,
        group,
        pos,
        np.broadcast_to(np.array(vel, float), (n, 2)),
        cov,
        **more,
    )


def frame(index: int, places: Any = (), score: Any = None, plane: Any = "ground", box: Any = None) -> Frame:
    pos = np.array(places, float).reshape(-1, 2)
    score, t = np.zeros(0) if score is None else np.array(score, float), (index - 1) / FPS
    return Frame(index, t, detections=Detections(index, t, plane, pos, None, box, score))


def values(signals: Signals, px_per_m: float = float("nan")) -> dict[str, float]:
    """The statistics before they are squashed, by name."""
    halves = {s.name: s.half for s in STATISTICS}
    seen = dict(zip(NAMES, signals.statistics(px_per_m).astype(float).tolist(), strict=True))
    return {k: v if halves[k] is None else halves[k] * v / (1 - v) for k, v in seen.items()}


def looked(pairs: Any, px_per_m: float = float("nan")) -> dict[str, float]:
    signals = Signals(FPS)
    for one, answer in pairs:
        signals.add(one, answer)
    return values(signals, px_per_m)


def expect(seen: dict[str, float], **wanted: float) -> None:
    assert {key: seen[key] for key in wanted} == pytest.approx(wanted, rel=1e-5, abs=1e-6)


def walk(k: int, n: int = 2) -> Any:
    return [[0.1 * k, 2.0 * i] for i in range(n)]


def test_two_people_who_are_predicted_well() -> None:
    seen = looked([(frame(k, walk(k), [0.5, 1.0]), tracks(k, walk(k))) for k in range(1, 6)])
    expect(
        seen, time=0.5, since=0.5, rate=10, observed=1, detections=2, tracks=2, associated=0.8, found=1, coasting=0,
        gap=0, residual=0, nis=0, shift=0, births=0, deaths=0, brief=0, speed=1, grouped=0, regrouped=0,
    )  # fmt: skip


def test_covariances_that_a_tracker_does_not_tell_give_no_nis() -> None:
    for told in (False, True):
        signals = Signals(FPS)
        for k in range(1, 4):
            one, off = frame(k, np.array(walk(k)) + 0.2), {"cov": np.tile(0.5 * np.eye(4), (2, 1, 1))} if told else {}
            signals.add(one, Tracks.of_points(one, [1, 2], walk(k), **off))
        seen = values(signals)
        assert seen["residual"] > 0.1
        assert (seen["nis"] > 0) == told


def test_frames_are_forgotten_after_a_decision_but_not_the_tracks() -> None:
    signals = Signals(FPS)
    for k in range(1, 6):
        signals.add(frame(k, walk(k)), tracks(k, walk(k)))
    values(signals)
    for k in range(6, 9):
        signals.add(frame(k, walk(k)), tracks(k, walk(k)))
    expect(values(signals), time=0.8, since=0.3, associated=1, found=1, births=0, residual=0)
    assert not signals.statistics(1.0).any(), "no frame since"


def test_quantiles_of_scores() -> None:
    signals = Signals(FPS)
    for k in (1, 2):
        signals.add(frame(k, np.zeros((11, 2)), np.linspace(0, 1, 11)), tracks(k, []))
    expect(values(signals), score_low=0.1, score=0.5, score_high=0.9)
    signals.add(frame(3, [[0, 0]]), tracks(3, []))
    expect(values(signals), score_low=1, score=1, score_high=1)
    signals.add(frame(4), tracks(4, []))
    expect(values(signals), score_low=0, score=0, score_high=0, detections=0, observed=0)


def test_detections_off_their_predictions() -> None:
    """One is 0.1 m ahead: its normalised square is 0.01 / 0.05 along one of two axes. The other is 0.3 m ahead."""
    pair = [(frame(1), tracks(1, walk(1))), (frame(2, [[0.3, 0], [0.5, 2]]), tracks(2, walk(2)))]
    expect(looked(pair), residual=np.sqrt((0.01 + 0.09) / 2), nis=(0.1 + 0.9) / 2, shift=0)


def test_a_covariance_of_place_and_velocity_counts() -> None:
    cov = np.tile(np.diag([0.04, 0.04, 1.0, 1.0]), (1, 1, 1))
    cov[0, 0, 2] = cov[0, 2, 0] = 0.15
    pair = [(frame(1), tracks(1, walk(1, 1), cov=cov)), (frame(2, [[0.4, 0]]), tracks(2, walk(2, 1)))]
    expect(looked(pair), nis=0.04 / (0.04 + 0.03 + 0.01) / 2)


def test_a_movement_common_to_all_is_told_from_errors_of_each() -> None:
    """A camera that moves shifts all by one vector; noise does not."""
    people, off = np.array(walk(1, 4)), np.array([[0.1, 0], [-0.1, 0], [0, 0.1], [0, -0.1]])
    common = [(frame(1), tracks(1, people, 0)), (frame(2, people + np.array([0.3, 0.4])), tracks(2, people))]
    expect(looked(common), shift=0.5, residual=0.5)
    expect(looked([common[0], (frame(2, people + off), tracks(2, people))]), shift=0, residual=0.1)
    two = [(frame(1), tracks(1, people[:2], 0)), (frame(2, people[:2] + np.array([0.3, 0.4])), tracks(2, people[:2]))]
    expect(looked(two), shift=0, residual=0.5)


def test_detections_belong_to_the_nearest_track_alone() -> None:
    """Of three detections one is the second at its track, one is too far away; of three tracks one has none."""
    places = [[0.0, 0], [5, 0], [9, 0]]
    found = [[0.1, 0], [0.2, 0], [5, 1.1], [9, 0.99]]
    pair = [(frame(1), tracks(1, places, 0)), (frame(2, found), tracks(2, places, 0))]
    expect(looked(pair), associated=2 / 4, found=2 / 3, residual=np.sqrt((0.01 + 0.99**2) / 2))
    none = [(frame(1), tracks(1, places)), (frame(2), tracks(2, places))]
    expect(looked(none), associated=0, found=0, observed=0)


def test_tracks_that_begin_and_end() -> None:
    """Of 20 frames: one stays, one lives 0.3 s, one 1.5 s, one is born last."""
    lives = {1: range(1, 21), 2: range(2, 5), 3: range(1, 16), 4: range(20, 21)}
    signals = Signals(FPS)
    for k in range(1, 21):
        ids = [id for id, life in lives.items() if k in life]
        signals.add(frame(k, [[0, 0]]), tracks(k, np.zeros((len(ids), 2)), ids=ids))
    expect(values(signals), births=2 / 2.0, deaths=2 / 2.0, brief=0.5, tracks=(20 + 3 + 15 + 1) / 20)


def test_the_gap_is_the_time_since_a_detection() -> None:
    signals = Signals(FPS)
    for k in range(1, 5):
        signals.add(frame(k, walk(k)), tracks(k, walk(k)))
    values(signals)
    for k in range(5, 9):  # the second person is detected no more
        signals.add(frame(k, walk(k)[:1]), tracks(k, walk(k)))
    expect(values(signals), gap=(0.1 + 0.2 + 0.3 + 0.4) / 8, found=0.5, associated=1)


def test_what_the_tracker_says_it_only_predicted() -> None:
    seen = [[True, True], [True, False], [False, False]]
    pairs = [(frame(k, walk(k)), tracks(k, walk(k), seen=np.array(seen[k - 1]))) for k in (1, 2, 3)]
    expect(looked(pairs), coasting=0.5)


def test_frames_without_a_look() -> None:
    """A detector that looks at each second frame; then frames that were lost, of which nothing is known."""
    signals = Signals(FPS)
    for k in range(1, 5):
        signals.add(frame(k, walk(k) if k % 2 else ()), tracks(k, walk(k)))
    expect(values(signals), observed=0.5, detections=2, found=1, residual=0, gap=0.05)
    for k in (5, 6):
        signals.add(Frame(k, (k - 1) / FPS), tracks(k, walk(k)))
    expect(values(signals), observed=0, detections=0, found=0, tracks=2, gap=(0.2 + 0.3) / 2)
    signals.add(Frame(7, 0.6, image=np.zeros((4, 4, 3), np.uint8)), tracks(7, walk(7)))
    signals.add(Frame(8, 0.7), tracks(8, walk(8)))
    expect(values(signals), observed=0.5, detections=0, score=0, associated=0, residual=0)


def test_a_prediction_reaches_over_missing_frames() -> None:
    pairs = [(frame(1), tracks(1, walk(1))), (frame(4, walk(4)), tracks(4, walk(4)))]
    expect(looked(pairs), residual=0, found=1)


def boxes(places: Any, height: float = 50.0) -> Any:
    middle = np.array(places, float).reshape(-1, 2)
    size = np.tile([20.0, height], (len(middle), 1))
    return np.column_stack([middle - size / 2, size])


def test_in_the_image_lengths_are_heights_of_people() -> None:
    at = np.array([[100.0, 100], [300, 100]])
    cov = np.tile(np.diag([25.0, 25.0, 0.0, 0.0]), (2, 1, 1))
    before = tracks(1, at, (100, 0), plane="image", box=boxes(at), cov=cov)
    after = tracks(2, at + np.array([10, 0]), (100, 0), plane="image", box=boxes(at + np.array([10, 0])))
    pair = [
        (frame(1, plane="image"), before),
        (frame(2, at + np.array([10, 5]), plane="image", box=boxes(at + np.array([10, 5]))), after),
    ]
    expect(looked(pair, 50.0), residual=0.1, nis=0.5, found=1, speed=2)
    expect(looked(pair), speed=0)
    expect(looked(pair, 0.0), speed=0)
    bare = [(one, answer.replace(box=None)) for one, answer in pair]
    expect(looked(bare, 50.0), residual=0, found=0, tracks=2, speed=2)
    unknown = [(one, answer.replace(box=np.full((2, 4), np.nan))) for one, answer in pair]
    expect(looked(unknown), residual=0, found=0)


def test_tracks_on_the_ground_are_compared_with_boxes_by_their_own() -> None:
    """Without predictions: a box that stands still is where it was. There is no variance of it."""
    at = np.array([[100.0, 100], [300, 100]])
    answers = [tracks(k, walk(k), box=boxes(at)) for k in (1, 2)]
    seen = looked(
        [
            (frame(1), answers[0]),
            (frame(2, at + np.array([0, 5]), plane="image", box=boxes(at + np.array([0, 5]), 60.0)), answers[1]),
        ]
    )
    expect(seen, residual=0.1, nis=0, found=1, speed=1)
    points = looked([(frame(1), answers[0]), (frame(2, at, plane="image"), answers[1])])
    expect(points, residual=0, found=0, associated=0, detections=2)


def test_groups_that_the_tracker_names() -> None:
    named = [[3, 3, -1, -1], [3, 3, 5, 5], [4, 4, 5, 5], [5, 5, -1, -1]]
    pairs = [(frame(k), tracks(k, walk(k, 4), group=named[k - 1])) for k in (1, 2, 3, 4)]
    expect(looked(pairs), grouped=(2 + 4 + 4 + 2) / 16, regrouped=(2 + 2 + 4) / 0.4)
    pairs[1] = (frame(2), tracks(2, walk(2, 4), ids=[7, 8, 9, 10]))  # others: nobody's group changed
    expect(looked(pairs), regrouped=4 / 0.4)


def test_groups_as_wholes() -> None:
    two = np.array([[0.0, 0.0], [9.0, 0.0]])
    none = (np.zeros(0, np.int64),) * 2
    shape = np.tile(np.eye(2), (2, 1, 1)), np.array([3.0, 1.0]), (np.zeros((0, 2)),) * 2
    groups = Groups(np.arange(2), none, two, two * 0, *shape)
    answer = [tracks(k, two, (0, 0), group=[0, 1], groups=groups).replace(unit="group") for k in (1, 2)]
    seen = looked([(frame(k, two), answer[k - 1]) for k in (1, 2)])
    expect(seen, grouped=0.5, regrouped=0, tracks=2, associated=0, found=0, residual=0, births=0)
    bare = answer[0].replace(groups=None)
    expect(looked([(frame(1, two), bare)]), grouped=0, tracks=2)


def test_nothing_at_all() -> None:
    assert not Signals(FPS).statistics(float("nan")).any()
    for one in (frame, lambda k: Frame(k, (k - 1) / FPS)):
        seen = looked([(one(k), tracks(k, [])) for k in (1, 2, 3)])
        assert {k for k, v in seen.items() if v} == {"time", "since", "rate"}


def test_what_is_unknown_is_left_out() -> None:
    """Velocities that are nan, variances of 0, and places that are nan."""
    cov = np.zeros((2, 4, 4))
    pair = [(frame(1), tracks(1, walk(1), np.nan, cov=cov)), (frame(2, walk(1)), tracks(2, walk(1), np.nan))]
    expect(looked(pair), residual=0, nis=0, speed=0, found=1)
    lost = tracks(1, [[np.nan, np.nan], [0, 2]], 0)
    expect(looked([(frame(1), lost), (frame(2, [[0, 2], [np.nan, 5]]), lost)]), residual=0, found=0.5, associated=0.5)


@pytest.mark.parametrize("plane", ["ground", "image"])
def test_bounds_and_kind(plane: Any) -> None:
    rng, signals = np.random.default_rng(3), Signals(FPS)
    for k in range(1, 200):
        n, m = rng.integers(0, 6, 2)
        at, ids = rng.normal(0, 5, (n, 2)), rng.choice(20, n, replace=False)
        vel = rng.normal(0, rng.choice([1.0, 1e9]), 2) * rng.choice([1.0, np.nan], p=[0.9, 0.1])
        cov = rng.choice([0.0, 1e-12, 1.0, np.nan]) * np.tile(np.eye(4), (n, 1, 1))
        tall = rng.choice([0.0, 1.0, 90.0, np.nan])
        label = rng.integers(-1, 3, n)
        answer = tracks(
            k, at, vel, ids=ids, plane=plane, group=label, cov=cov, box=boxes(at, tall), seen=rng.random(n) < 0.5
        )
        found = rng.normal(0, rng.choice([5.0, 1e9]), (m, 2))
        one = frame(k, found, rng.uniform(0, 1, m), rng.choice(["ground", "image"]), boxes(found))
        signals.add(one if rng.random() < 0.9 else Frame(k, (k - 1) / FPS), answer)
        if k % 3 == 0:
            seen = signals.statistics(rng.choice([40.0, 0.0, np.nan]))
            assert seen.dtype == np.float32
            assert seen.shape == (len(STATISTICS),)
            assert ((seen >= 0) & (seen <= 1)).all()


def test_a_covariance_near_zero_is_a_very_unlikely_residual() -> None:
    """The NIS overflows; its statistic is the greatest there is, and no nan."""
    signals = Signals(FPS)
    for k in (1, 2):
        signals.add(frame(k, [[0.1, 0.0]]), tracks(k, [[0.0, 0.0]], (0.0, 0.0), cov=1e-314 * np.eye(4)[None]))
    assert dict(zip(NAMES, signals.statistics(float("nan")).tolist(), strict=True))["nis"] == 1.0
