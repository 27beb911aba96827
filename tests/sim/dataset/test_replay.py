"""Replays: whose motion they show, what is true of them, what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sim
from scenarios.errors import InputError
from scenarios.loading.resolve import load, load_observation
from scenarios.schema.scenario import ObservationSpec
from sim.dataset.replay import Cut, replay
from sim.sequence import simulate
from sim.types import Sequence
from tests.recordings import mot_folder
from tracking.recordings.biwi import open_folder
from tracking.recordings.source import open_source


@pytest.fixture
def walk(tmp_path: Path) -> Sequence:
    """Two friends who come together at 2 s and a stranger who passes, as BIWI has it."""
    lines, step = [], 10
    for k in range(40):
        t = k * 0.4
        apart = max(0.7, 4.0 - 1.6 * t)
        for id, x, y in ((3, 1.2 * t, 0.0), (5, 1.2 * t, apart), (9, 16.0 - 1.3 * t, -3.0)):
            if id != 5 or k >= 2:  # who enters together is together from then on, by the rule
                lines.append(f"{780 + step * k} {id} {x:.6f} 0 {y:.6f} 0 0 0")
    (tmp_path / "walk").mkdir()
    (tmp_path / "walk" / "obsmat.txt").write_text("\n".join(lines))
    (tmp_path / "walk" / "groups.txt").write_text("3 5\n")
    return open_folder(tmp_path / "walk")


def test_real_motion_with_perfect_labels(walk: Sequence) -> None:
    made = sim.replay(walk, ObservationSpec(), 20_001, streams=())
    truth, labels = made.truth, walk.truth
    assert made.fps == 10.0
    assert made.length == 157
    origin = made.source["origin"]
    assert origin["people"] == (3, 5, 9)
    at = truth.rows(41)  # 4 s: frame 11 of the recording
    assert truth.pos[at] - origin["shift"] == pytest.approx(labels.pos[labels.rows(11)], abs=0.05)
    assert truth.pos.min() == pytest.approx(1.0)
    forms = [e for e in truth.events or () if e.kind == "form"]
    assert [e.members for e in forms] == [(1, 2)]
    assert forms[0].start / 10 == pytest.approx(2.0, abs=0.6)
    assert set(truth.group[truth.id == 3].tolist()) == {-1}
    heading = np.array(truth.heading)[truth.id == 3]
    assert np.cos(heading[20:]) == pytest.approx(-1.0, abs=0.01)
    assert (truth.box[:, 0] > 0).all()
    assert sum(len(f.detections.pos) for f in made if f.detections is not None) > 300


def test_bodies_come_from_the_seed_and_nothing_else(walk: Sequence) -> None:
    one, same, other = (replay(walk, ObservationSpec(), seed, streams=()).truth for seed in (20_001, 20_001, 20_002))
    assert np.array_equal(one.pos, same.pos)  # type: ignore[arg-type]
    assert np.array_equal(one.box, same.box)  # type: ignore[arg-type]
    assert np.array_equal(one.pos, other.pos)  # type: ignore[arg-type]
    assert not np.array_equal(one.height, other.height)  # type: ignore[arg-type]
    part = replay(walk, ObservationSpec(), 20_001, cut=Cut(4.0, 5.0), streams=()).truth
    assert part.length == 50
    assert set(np.unique(part.height)) == set(np.unique(one.height))  # type: ignore[arg-type]


def test_groups_that_nobody_labelled_are_not_labelled(walk: Sequence, tmp_path: Path) -> None:
    (tmp_path / "walk" / "groups.txt").unlink()
    truth = replay(open_folder(tmp_path / "walk"), ObservationSpec(), streams=()).truth
    assert truth.groups is None
    assert truth.events is None
    assert not truth.labelled.any()
    assert (truth.group == -1).all()


def test_our_own_motion_keeps_its_world_and_bodies() -> None:
    own = simulate(load("merge"), 3, streams=())
    made = replay(own, load_observation(set=["camera.kind=top", "camera.fps=20"]), 4, streams=())
    assert made.scene == own.scene or made.scene.size.tolist() == own.scene.size.tolist()  # type: ignore[union-attr]
    assert made.truth.pos[made.truth.rows(101)] == pytest.approx(own.truth.pos[own.truth.rows(51)], abs=0.01)  # type: ignore[index]
    assert np.unique(made.truth.height).tolist() == np.unique(own.truth.height).tolist()  # type: ignore[arg-type]
    kinds = [[(e.kind, e.members, round(e.start / t.fps)) for e in t.events or ()] for t in (made.truth, own.truth)]
    assert kinds[0] == kinds[1]


def test_pictures_show_them(walk: Sequence) -> None:
    made = replay(walk, load_observation(set=["camera.image=[160, 120]"]), 20_001, cut=Cut(0.0, 1.0))
    frame = next(iter(made))
    empty = made.background()
    pixels = made.frame_truth(1)
    people = pixels.pixels.ids > 0
    change = np.abs(frame.image.astype(float) - np.median(empty, axis=0)).max(axis=2)
    assert change[people].mean() > 3 * change[~people].mean()


IMPOSSIBLE = [
    (["camera.height=1.0"], Cut(), "out of view"),
    ([], Cut(99.0), "--start"),
    ([], Cut(0.0, 0.01), "--start"),
    (["sensor.hide=[{ start = 0.0, end = 1.0, group = 'a' }]"], Cut(), "sensor.hide.0.group"),
]


@pytest.mark.parametrize(("changes", "cut", "words"), IMPOSSIBLE)
def test_what_cannot_be_is_refused(walk: Sequence, changes: list[str], cut: Cut, words: str) -> None:
    with pytest.raises(InputError) as error:
        list(replay(walk, load_observation(set=changes), cut=cut, streams=()))
    assert words in str(error.value)


def test_boxes_alone_want_a_calibration(tmp_path: Path) -> None:
    own = simulate(load("merge"), 3, streams=())
    truth = own.truth
    lines = [
        f"{f},{i},{x},{y},{w},{h},1,1,1" for f, i, (x, y, w, h) in zip(truth.frame, truth.id, truth.box, strict=True)
    ]
    mot_folder(tmp_path, "\n".join(lines), ini="name=boxes\nframeRate=10\nimWidth=640\nimHeight=480\n")
    with pytest.raises(InputError, match="--calibration"):
        replay(open_source(tmp_path)[0], ObservationSpec(), streams=())
    made = replay(open_source(tmp_path)[0], ObservationSpec(), calibration=own.camera, streams=())
    shift = np.array(made.source["origin"]["shift"])
    away = made.truth.pos[made.truth.rows(51)] - shift - truth.pos[truth.rows(51)]  # type: ignore[index]
    assert np.abs(away).max() < 0.3  # a box's lower edge is the near side of the feet


def test_a_source_of_no_use_is_refused(tmp_path: Path, walk: Sequence) -> None:
    for source, spec, words in (
        (Sequence("empty", 10.0, 5, lambda: iter(())), ObservationSpec(), "no labelled people"),
        (walk, tmp_path / "none.toml", "No such file"),
    ):
        with pytest.raises(InputError, match=words):
            replay(source, spec)
    with pytest.raises(InputError, match="--calibration"):
        replay(walk, ObservationSpec(), calibration=simulate(load("merge"), 3, streams=()).camera)
