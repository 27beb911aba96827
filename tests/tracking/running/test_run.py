"""`track`: modes, what a tracker may know, strangers, and that truth is not looked at."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from scenarios.errors import InputError, WorkError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Context, Detections, Frame, GroupEvent, Groups, Sequence, Tracks, Truth
from tracking.grouping.link_rule import LinkRule
from tracking.papers.blob.config import BlobConfig
from tracking.running.prepare import prepare
from tracking.running.run import TrackingRun, track

FPS, LENGTH = 10.0, 30


def poisoned() -> Truth:
    raise AssertionError("a tracker looked at the truth")


def boxes_at(k):
    return np.array([[100 + 4.0 * k, 200, 28, 68], [600 - 4.0 * k, 300, 28, 68]])


def frames():
    for k in range(LENGTH):
        box = boxes_at(k)
        box.flags.writeable = False
        found = Detections(k + 1, k / FPS, "image", box[:, :2] + box[:, 2:] / 2, None, box, np.ones(2))
        yield Frame(k + 1, k / FPS, detections=found)


def truth():
    frame, id = np.repeat(np.arange(1, LENGTH + 1), 2), np.tile([4, 9], LENGTH)
    box = np.concatenate([boxes_at(k) for k in range(LENGTH)])
    alone, ones = np.full(2 * LENGTH, -1), np.ones(2 * LENGTH)
    return Truth("made", FPS, LENGTH, 40.0, frame, id, alone, None, None, box, ones)


def source(**changes):
    given = {"has_detections": True, "load_truth": poisoned, "image_size": (1000, 600), **changes}
    return Sequence("made", FPS, LENGTH, frames, **given)


class Stranger:
    """Reports every detection under its row number."""

    needs = ("boxes", "points")

    def reset(self, context: Context, seed: int) -> None:
        self.context = context

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        n = len(detections.pos)
        vel, cov, alone = np.zeros((n, 2)), np.tile(np.eye(4), (n, 1, 1)), np.full(n, -1)
        plane, id, pos = detections.plane, np.arange(n), detections.pos
        return Tracks(frame.index, frame.t, plane, "person", id, alone, pos, vel, cov, groups=Groups.none())


def test_file_mode_never_looks_at_the_truth():
    run = track("blob", source())
    assert isinstance(run, TrackingRun)
    assert [t.index for t in run] == list(range(1, LENGTH + 1))
    assert run.info["detections"] == "file"
    assert run.info["px_per_m"] == pytest.approx(68 / 1.7)
    assert run.info["boxes"] == "measured"
    assert run.info["plane"] == "image"
    assert run.info["config"] == BlobConfig().as_dict()
    assert len({int(i) for t in run for i in t.id}) == 2


def test_truth_mode_takes_the_labels():
    run = track("blob", source(load_truth=truth), detections="truth")
    assert run.info["detections"] == "truth"
    assert len({int(i) for t in run for i in t.id}) == 2
    first = run[-1].pos[run[-1].pos[:, 0].argmin()]
    assert first == pytest.approx(boxes_at(LENGTH - 1)[0, :2] + [14, 34], abs=1.0)


def test_sensor_overrides_degrade_the_labels():
    made = [track("blob", source(load_truth=truth), detections="truth", sensor={"detect_prob": p}) for p in (1.0, 0.0)]
    assert [sum(len(t.id) for t in run) > 0 for run in made] == [True, False]
    assert made[1].info["sensor"] == {"detect_prob": 0.0}
    with pytest.raises(InputError, match=r"sensor\.detect_prob"):
        track("blob", source(load_truth=truth), detections="truth", sensor={"detect_prob": 2.0})


def test_pictures_and_stored_boxes_at_once():
    settings = ["camera.fps=5", "camera.image=[160,120]", "duration=4"]
    scene = simulate(load("side-by-side", settings), 40_001, streams=("left", "background"))
    run = track("blob", scene, detections="both")
    assert run.info["input"] == "pixels and boxes"
    assert run.info["detections_hash"] == track("blob", scene, detections="file").info["detections_hash"]
    assert run.info["background"]
    frames = list(prepare("blob", scene, detections="both").frames())
    assert all(f.image is not None and f.detections.box is not None for f in frames)
    with pytest.raises(InputError, match=r"--detections both: got a tracker that needs pixels or points or boxes"):
        track("relational", scene, detections="both")


def hidden(group):
    return {"hide": [{"start": 1.0, "end": 2.0, "group": group}]}


def test_hiding_a_group_by_its_name():
    """The script's own groups, and those that its orders made."""
    import sim
    from scenarios import load

    live = sim.simulate(load("merge"), seed=3, streams=())
    people = live.load_people()
    assert set(people["ab"]) == set(people["a"]) | set(people["b"])
    for frame in prepare("blob", live, detections="truth", sensor=hidden("a")).frames():
        there = set(live.truth.at(frame.index).id) - (set(people["a"]) if 1.0 <= frame.t < 2.0 else set())
        assert len(frame.detections.pos) == len(there)
    for sequence, name, words in (
        (live, "x", r"sensor\.hide\.0\.group: got 'x'; expected a group of the script \(a, "),
        (source(load_truth=truth), "a", "none is known here"),
    ):
        with pytest.raises(InputError, match=words):
            prepare("blob", sequence, detections="truth", sensor=hidden(name))


def test_image_mode_hides_the_files_detections():
    class Eyes(Stranger):
        needs = ("pixels", "boxes")

        def step(self, frame, detections):
            assert detections is None
            none = Detections(frame.index, frame.t, "image", np.zeros((0, 2)))
            return super().step(frame, none)

    run = track(Eyes, source(has_images=True))
    assert run.info["detections"] == "image"


@pytest.mark.parametrize("wrong", ["data", load("cross")])
def test_what_is_no_sequence_is_told_how_to_open_one(wrong):
    with pytest.raises(InputError, match="expected a Sequence; open it"):
        track("blob", wrong)


def test_params_by_config_values_and_file(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text("[params]\ngate = 0.95\n")
    runs = [track("blob", source(), params=p) for p in (BlobConfig(gate=0.95), {"gate": 0.95}, path, str(path))]
    assert all(r.info["config"]["gate"] == 0.95 for r in runs)
    with pytest.raises(InputError, match="a tracker with parameters"):
        track(Stranger, source(), params={"gate": 0.9})


def test_combinations_that_cannot_work():
    for words, options in (
        ("needs pixels or boxes, and made with detections, truth", {"detections": "image"}),
        ("sensor", {"sensor": {"detect_prob": 0.5}}),
        ("did you mean gate", {"params": {"gat": 0.9}}),
    ):
        with pytest.raises(InputError, match=words):
            track("blob", source(), **options)


def test_empty_sequences():
    assert len(track("blob", Sequence("none", FPS, 0, lambda: iter(()), has_detections=True))) == 0
    bare = Sequence("bare", FPS, 3, lambda: (Frame(k, k / FPS) for k in (1, 2, 3)), has_detections=True)
    assert [len(t.id) for t in track("blob", bare)] == [0, 0, 0]


def test_one_plane_in_a_run_and_again_in_the_next():
    class Turncoat(Stranger):
        def step(self, frame, detections):
            made = super().step(frame, detections)
            return made.replace(plane="ground") if frame.index == self.turn else made

    tracker = Turncoat()
    tracker.turn = 4
    with pytest.raises(WorkError, match="Turncoat: made, frame 4: got plane 'ground'"):
        track(tracker, source())
    ready = prepare(Turncoat(), source())
    for turn in (1, 0):  # after a reset it may be another one
        ready.reset(0)
        ready.tracker.turn = turn
        ready.step(next(ready.frames()))


def test_a_rule_of_groups_that_has_no_effect_is_said_to_have_none(recwarn):
    made = simulate(load("merge", ["duration=4"]), 0, streams=())
    track("blob", made, detections="file", grouping=LinkRule(near=1.0))
    assert not [w for w in recwarn if "--grouping" in str(w.message)]
    with pytest.warns(UserWarning, match="group-pda names groups itself: --grouping has no effect"):
        track("group-pda", made, detections="file", grouping=LinkRule(near=1.0))


class Naming(Stranger):
    """Two people who stand side by side, whose tracker names them a group and says that they merged from frame 60 on.

    first: the frame from which on groups are named, empty ones where there is none.
    """

    needs = ("points",)
    first = 60
    own_events = ()

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        id, late = np.array([1, 2]), frame.index >= 60
        group, cov = np.full(2, 7 if late else -1), np.zeros((2, 4, 4))
        groups = Groups.none() if self.first <= frame.index < 60 else None
        merge = GroupEvent("merge", frame.index, None, None, (-1, -1), (7,), (1, 2), (0.0, 0.0))
        events = (merge,) if frame.index == 60 else ()
        pos = np.array([[1.0 + 0.1 * frame.index, 1.0], [1.0 + 0.1 * frame.index, 1.7]])
        vel = np.full((2, 2), np.nan)
        return Tracks(
            frame.index, frame.t, "ground", "person", id, group, pos, vel, cov, None, np.ones(2), groups, events,
            own_events=self.own_events,
        )  # fmt: skip


class NamingAlways(Naming):
    first = 1


class NamingDeclared(NamingAlways):
    own_events = ("merge", "split")


def standing(length):
    """Frames with two detections, which `Naming` does not look at."""

    def made():
        for k in range(length):
            yield Frame(k + 1, k / FPS, detections=Detections(k + 1, k / FPS, "ground", np.zeros((2, 2)), None))

    return Sequence("standing", FPS, length, made, has_detections=True)


@pytest.mark.filterwarnings("ignore:Naming")
@pytest.mark.parametrize("tracker", [Naming, NamingAlways, NamingDeclared])
@pytest.mark.parametrize("length", [30, 59, 61, 70])
def test_what_a_tracker_reports_late_changes_no_earlier_frame(tracker, length):
    whole, short = track(tracker, standing(90)), track(tracker, standing(length))
    for a, b in zip(short, whole, strict=False):
        assert a.group.tolist() == b.group.tolist()
        assert a.groups.id.tolist() == b.groups.id.tolist()
        assert [repr(e) for e in a.events] == [repr(e) for e in b.events]


def test_groups_named_late_are_replaced_with_a_warning():
    with pytest.warns(UserWarning, match=r"Naming: names groups from frame 60 on.*Groups\.none\(\)"):
        run = track(Naming, standing(90))
    assert run[40].group.tolist() == run[80].group.tolist() == [1, 1]
    assert "grouping" in run.info


def test_groups_of_one_are_warned_of():
    """A tracker that gives people who are alone a group of their own has no group that counts; its remedy works."""

    class OwnGroup(NamingAlways):
        alone = np.arange(2)

        def step(self, frame, detections):
            return super().step(frame, detections).replace(group=self.alone, groups=None, events=())

    with pytest.warns(UserWarning, match="OwnGroup: each of its groups has one member. Give group -1"):
        track(OwnGroup, standing(20))
    OwnGroup.alone = np.full(2, -1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "grouping" in track(OwnGroup, standing(20)).info
