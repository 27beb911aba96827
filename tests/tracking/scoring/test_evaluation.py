"""evaluate as a whole: truth as tracks is perfect on every scenario, files are memory, beginnings look not ahead."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scenarios
from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import EVENT_KINDS, Tracks, Truth
from tests.hand_made import Scene, event, tracks, truth, with_rows
from tracking import track
from tracking.scoring import evaluate
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import IncomparableError, Scorer, Scores

NAMES = sorted(path.stem for path in Path(scenarios.__file__).parent.glob("*.toml"))
TWO = {1: (0.0, 0.0), 2: (1.0, 0.0)}


def truth_as_tracks(true: Truth, plane: str = "ground", late: int = 0) -> list[Tracks]:
    """What a tracker would say that knows everything, `late` frames late about groups."""
    found = []
    for index in range(1, true.length + 1):
        now, then = true.at(index), true.at(max(index - late, 1))
        n = len(now.id)
        of = dict(zip(then.id.tolist(), then.group.tolist(), strict=True))
        group = np.array([of.get(p, -1) for p in now.id.tolist()], np.int64)
        pos, groups, vel = now.pos, now.groups, now.vel
        if plane == "image":
            pos, groups, vel = now.box[:, :2] + now.box[:, 2:] / 2, now.groups_px, np.full((n, 2), np.nan)
        told = tuple(e for e in true.events or () if e.start == index)
        cov = np.zeros((n, 4, 4))
        answer = Tracks(index, now.t, plane, "person", now.id, group, pos, vel, cov, now.box, np.ones(n), groups, told)
        found.append(answer.replace(groups=None, events=()) if late else answer.replace(own_events=EVENT_KINDS))
    return found


@pytest.mark.parametrize("name", NAMES)
def test_truth_as_tracks_is_perfect(name: str) -> None:
    true = simulate(load(name, ["camera.fps=5"]), 5, streams=()).truth
    for by in ("hull", "members"):
        found = evaluate(true, truth_as_tracks(true), group_match=by)
        assert_perfect(found)
        assert found["objective"] == pytest.approx(1, abs=1e-12)
        assert np.isfinite(found["group_F1"]) == any(len(g.id) for g in true.groups)
        for kind in {e.kind for e in true.events} & {"merge", "split", "cross", "queue"}:
            assert found[f"{kind}_F1"] == 1, kind


@pytest.mark.parametrize("name", NAMES)
def test_true_boxes_are_people_in_their_places(name: str) -> None:
    """A box does not tell to which side a body is turned (some mm), nor on which step of the stairs it is."""
    true = simulate(load(name, ["camera.fps=5"]), 5, streams=()).truth
    found = evaluate(true, truth_as_tracks(true, "image"))
    for key in ("FN", "FP", "IDSW", "group_FN", "group_FP", "group_IDSW"):
        assert not found[key] > 0, key
    assert found["IDF1"] == 1
    assert found["HOTA"] == pytest.approx(1, abs=0.02 if name == "stairs" else 1e-9)
    assert found["RMSE_pos"] < (0.1 if name == "stairs" else 0.01)


def assert_perfect(found: Scores) -> None:
    for key, value in found.items():
        best = {"higher": CATALOGUE[key].high, "lower": 0.0, "neither": np.inf}[CATALOGUE[key].better]
        if np.isfinite(value) and np.isfinite(best):
            assert value == pytest.approx(best, abs=1e-6), (key, found.surface, found.group_match)


def test_every_score_lies_in_its_range() -> None:
    r = np.random.default_rng(1)

    def scene() -> Scene:
        people = {k: tuple(r.uniform(0, 6, 2)) for k in range(1, 9)}
        return Scene(people, {1: ((1, 2, 3), None), 2: ((4, 5), None), 3: ((6, 7), None)})

    kinds = ("merge", "split", "cross", "queue", "enter", "leave")
    happened = [event(kind, int(r.integers(1, 50)), (1, 2, 3)) for kind in kinds]
    said = [event(kind, int(r.integers(1, 50)), (1, 2, 3), emitted=50) for kind in kinds * 3]
    true, est = [scene() for _ in range(50)], [scene() for _ in range(50)]
    for pair in ((true, est), (true, true), (est, true[:3])):
        for key, value in evaluate(truth(pair[0], happened), tracks(pair[1], said)).items():
            score = CATALOGUE[key]
            assert not value < score.low - 1e-9, key
            assert not value > score.high + 1e-9, key


def test_a_beginning_is_scored_as_if_it_were_all() -> None:
    sequence = simulate(load("merge"), 5, streams=())
    run, true = track("blob", sequence), sequence.truth
    for last in (1, 60, 120, true.length):
        kept = true.frame <= last
        cut = with_rows(
            true, kept, length=last, groups=true.groups[:last], groups_px=true.groups_px[:last],
            labelled=true.labelled[:last], events=tuple(e for e in true.events if e.start <= last),
        )  # fmt: skip
        for part in (last, range(1, last + 1)):
            found, expected = evaluate(true, run, frames=part), evaluate(cut, run[:last])
            assert dict(found) == pytest.approx(dict(expected), abs=1e-12, nan_ok=True)
    middle = evaluate(true, run, frames=range(51, 101))
    assert middle["TP"] + middle["FN"] == ((true.frame > 50) & (true.frame <= 100)).sum()


def test_a_beginning_is_not_told_what_comes_later() -> None:
    """Groups that are derived for scoring (a crossing is known 2 s after it) do not look beyond the frames scored."""
    true = simulate(load("cross"), 1).truth
    (crossing,) = (e for e in true.events if e.kind == "cross")
    alone = [np.full(len(true.at(index).id), -1) for index in range(1, true.length + 1)]
    bare = [
        t.replace(group=group, groups=None, events=(), own_events=())
        for t, group in zip(truth_as_tracks(true), alone, strict=True)
    ]
    for last in (crossing.end + 20, crossing.end + 30):
        found, expected = evaluate(true, bare, frames=last), evaluate(true, bare[:last], frames=last)
        assert found["cross_TP"] == 1
        assert dict(found) == pytest.approx(dict(expected), abs=1e-12, nan_ok=True)


def test_nothing_said_and_nothing_there() -> None:
    # Empty output: no false group, all missed.
    scene = [Scene(TWO, {1: ((1, 2), None)})] * 4
    found = evaluate(truth(scene), tracks([Scene({})] * 4))
    assert (found["group_1-FP"], found["group_1-FN"], found["group_GDSR"], found["group_MOTA"]) == (1, 0, 0, 0)
    assert np.isnan(evaluate(truth([Scene(TWO)] * 4), tracks([Scene(TWO)] * 4))["group_HOTA"])  # no groups at all
    assert evaluate(truth([Scene({})] * 4), tracks([Scene({})] * 4))["FP"] == 0


@pytest.mark.parametrize(("similarity", "lacking"), [("boxes", "no boxes"), ("image", "in the image")])
def test_what_is_not_there_cannot_be_compared(similarity: str, lacking: str) -> None:
    with pytest.raises(IncomparableError, match=lacking):
        evaluate(truth([Scene(TWO)]), tracks([Scene(TWO)]), similarity=similarity)


def test_an_id_twice_in_a_frame_is_refused() -> None:
    (told,) = tracks([Scene(TWO)])
    with pytest.raises(ValueError, match="tracks: id 1 is twice in frame 1"):
        evaluate(truth([Scene(TWO)]), [told.replace(id=np.array([1, 1]))])


def test_every_key_of_the_catalogue_is_returned_and_the_other_way_round() -> None:
    scene = [Scene(TWO, {1: ((1, 2), None)})] * 3
    assert set(evaluate(truth(scene), tracks(scene))) == set(CATALOGUE)


@pytest.mark.parametrize("name", ["blob", "group-pda"])
def test_the_objective_alone_is_that_of_all_scores(name: str) -> None:
    sequence = simulate(load("crowd", ["camera.fps=5", "duration=10", "sensor.clutter_rate=2"]), 3, streams=())
    run, true = track(name, sequence), sequence.truth
    unlabelled = true.replace(groups=None, groups_px=None, events=None)
    in_part = true.replace(labelled=np.arange(true.length) % 3 == 0)
    for labels, length in ((true, None), (true, 1), (true, 30), (unlabelled, None), (in_part, None)):
        for answers in (run, [t.replace(groups=None, derived=False) for t in run]):
            (compared,) = Scorer(labels).compare([answers], None, length)
            found, expected = compared.objective_scores(), compared.scores("hull")
            assert found == pytest.approx({key: expected[key] for key in found}, abs=1e-12, nan_ok=True)
            assert list(found) == ["HOTA", "group_F1", "objective"]


def test_what_cannot_be_scored_is_refused():
    true = truth([Scene(TWO, {1: ((1, 2), None)})] * 3)
    told = truth_as_tracks(true)
    with pytest.raises(ValueError, match="two Tracks of one frame"):
        evaluate(true, [*told, told[0]])
    for none in (0, range(0), range(4, 9)):
        with pytest.raises(ValueError, match="expected some of 1 to 3"):
            evaluate(true, told, frames=none)
    with pytest.raises(InputError, match="expected labels"):
        evaluate(None, told)
