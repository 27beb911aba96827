"""Groups of sub-groups: a class in pairs walks behind its teacher, is one group in the truth, and knows its pairs."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import Entry, load
from scenarios.loading.toml_files import dump, toml_value
from scenarios.loading.validation import validate
from scenarios.reading import parse_toml
from scenarios.schema.scenario import Scenario
from sim.crowd.forces import (
    COHERE,
    END,
    GROUP,
    MODE,
    PROCESSION,
    WANTED_VX,
    GroupArrays,
    Obstacles,
    PeopleArrays,
)
from sim.crowd.forces_goal_kernels import accelerate
from sim.crowd.formation import procession, walking
from sim.crowd.navigation import scene_of
from sim.crowd.population import EnteringGroup, draw_population
from sim.crowd.world import run
from sim.dataset.generate import generate
from sim.sequence import simulate
from sim.store.sequence_folder import open_sequence
from sim.truth.label import label
from sim.types import Array, Motion

TEACHER, PAIRS = {"id": "teacher", "size": 1}, {"id": "pair", "size": 2, "repeat": 6}
CLASS = {"id": "class", "start": [6, 3], "goal": [20, 14], "via": [[18, 3]], "groups": [TEACHER, PAIRS]}
TABLE = {
    "schema": 1,
    "duration": 25,
    "world": {"size": [26, 16]},
    "camera": {"kind": "top", "crop": True, "px_per_m": 20},
}


def scene(*others: dict[str, Any], **keys: Any) -> Scenario:
    """Returns the class with some keys of its group, or of the scenario, changed, and with other groups."""
    table = TABLE | {key: keys.pop(key) for key in ("world", "event", "duration", "crowd") if key in keys}
    return validate(table | {"group": [CLASS | keys, *others]}, model=Scenario)


@cache
def walk() -> Motion:
    return run(scene(), 90001)


def middles(motion: Motion) -> Array:
    """Returns the middles (T, 7, 2), m, of teacher and pairs."""
    parts = [motion.pos[:, [0]], *np.split(motion.pos[:, 1:13], 6, axis=1)]
    return np.stack([part.mean(axis=1) for part in parts], axis=1)


def test_places_are_rows_behind_each_other_about_one_middle() -> None:
    places, gaps = procession([1, 2, 2], 0.8)
    np.testing.assert_allclose(gaps, [0, 0.92, 0.92])
    np.testing.assert_allclose(np.concatenate(places).mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(places[2], walking(2, 0.8) + places[2].mean(axis=0))
    assert places[0][0, 0] > places[1][0, 0] > places[2][0, 0]
    np.testing.assert_array_equal(procession([5], 0.8)[0][0], walking(5, 0.8))


def test_sub_groups_keep_their_distance_and_their_order_round_a_corner() -> None:
    gaps = np.linalg.norm(np.diff(middles(walk()), axis=1), axis=2)
    assert gaps.min() > 0.5
    assert gaps.max() < 1.7
    turned = [np.argmax(way[:, 1] > 6) for way in middles(walk()).swapaxes(0, 1)]
    assert turned == sorted(turned)
    assert len(set(turned)) == 7


def test_every_sub_group_walks_the_way_of_the_first() -> None:
    ways = middles(walk()).swapaxes(0, 1)
    off = [np.linalg.norm(way[::5, None] - ways[0][None], axis=2).min(axis=1)[8:].max() for way in ways[1:]]
    assert max(off) < 1.5


def paces(*x: float, cohesion: float = 0.5) -> list[float]:
    """Returns the wanted velocities along x, m/s, of people of one procession at these x, m, 1 m apart if they may."""
    state = np.array([[place, 0.0, 1.0, 0.0] for place in x])
    people, groups, out = PeopleArrays.empty(len(x)), GroupArrays.empty(len(x), 1), np.zeros((len(x), 2))
    people.tag[:, GROUP], people.tag[:, MODE], people.tag[:, PROCESSION] = np.arange(len(x)), 0, 0
    groups.head[:], groups.gap[1:], groups.speed[:], groups.boids[:, COHERE] = 0, 1.0, 1.2, cohesion
    groups.route[:, 0], groups.kind[:], groups.length[:] = (100.0, 0.0), END, 1
    nothing = Obstacles.of(np.zeros((0, 10)), np.zeros((0, 4)), np.zeros((0, 3)))
    assert accelerate(state, *people, *groups, *nothing, 0.01, out)
    return [float(pace) for pace in groups.status[:, WANTED_VX]]


def test_each_takes_up_the_speed_ahead_and_corrects_its_distance() -> None:
    assert paces(0, -1.2) == pytest.approx([1.2, 1.0 + 0.5 * 0.2])
    assert paces(0, -0.6) == pytest.approx([1.2, 1.0 - 0.5 * 0.4])
    assert paces(0, -0.6, cohesion=0.0) == pytest.approx([1.2, 1.0])
    assert paces(0, 5.0) == [1.2, 0.0], "who has come to be in front waits"


def test_nobody_runs_and_those_ahead_wait() -> None:
    assert paces(0, -3.0) == pytest.approx([1.38 - 0.5 * 1.0, 1.38])
    assert paces(0, -30.0, -31.0) == pytest.approx([0.4 * 1.38, 1.38, 1.0])


def test_it_stands_behind_the_first_at_the_goal() -> None:
    motion = walk()
    last = middles(motion)[-1]
    assert np.linalg.norm(last[0] - (20, 14)) < 0.5
    assert np.linalg.norm(motion.vel[-1], axis=1).max() < 0.3
    assert motion.never_arrive == motion.immobile == ()
    away = np.linalg.norm(last - last[0], axis=1)
    assert (np.diff(away) > 0.4).all(), "each pair stands behind the one before"


def test_the_truth_has_one_group_and_the_pairs_in_it() -> None:
    truth = label(walk(), None)
    assert set(truth.group.tolist()) == {1}
    assert truth.events == ()
    assert truth.near is not None
    assert not len(truth.near.a), "pairs of one class are no strangers"
    assert truth.subgroup is not None
    assert truth.subgroup[truth.frame == 9].tolist() == [-1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7]


def test_a_person_left_alone_is_in_no_sub_group() -> None:
    motion = walk()
    present = motion.present.copy()
    present[100:, 1] = False
    truth = label(motion.replace(present=present, measured=None, subgroup=np.where(present, motion.subgroup, -1)), None)
    assert truth.subgroup is not None
    assert truth.subgroup[truth.id == 3][[99, 100]].tolist() == [2, -1]


def test_scenes_without_sub_groups_say_nothing_of_them() -> None:
    motion = run(
        validate(TABLE | {"group": [{"id": "a", "size": 2, "start": [2, 2], "goal": [9, 2]}]}, model=Scenario), 1
    )
    assert motion.subgroup is None
    assert label(motion, None).subgroup is None


def test_one_more_in_a_sub_group_changes_nobody_else() -> None:
    def people(*groups: dict[str, Any]) -> dict[str, EnteringGroup]:
        made = scene(groups=groups)
        return {g.part: g for g in draw_population(made, scene_of(made.world), 7, 0)}

    first, other = people(TEACHER, PAIRS), people(TEACHER | {"size": 3}, PAIRS | {"repeat": 7})
    assert len({m.height for g in first.values() for m in g.members}) == 13
    drawn = people(PAIRS | {"size": {"uniform": (0.5, 9.0)}})
    assert len({len(g.members) for g in drawn.values()}) > 2
    assert list(first) == ["class.teacher", *(f"class.pair-{k}" for k in range(1, 7))]
    for name in list(first)[1:]:
        assert [m.height for m in first[name].members] == [m.height for m in other[name].members]
        assert [m.phase for m in first[name].members] == [m.phase for m in other[name].members]


def test_what_a_sub_group_leaves_open_is_as_in_the_group() -> None:
    made = scene(groups=[TEACHER | {"height": 1.8}, PAIRS | {"clothes": ["red"]}], height=1.2, clothes=["blue"])
    teacher, pair, *_ = draw_population(made, scene_of(made.world), 7, 0)
    assert (teacher.members[0].height, pair.members[0].height) == (1.8, 1.2)
    assert teacher.members[0].clothes[0, 2] > teacher.members[0].clothes[0, 0]
    assert pair.members[0].clothes[0, 0] > pair.members[0].clothes[0, 2]
    assert teacher.speed == pair.speed


def test_it_stops_passes_a_door_and_leaves() -> None:
    walls = {"size": [26, 16], "walls": [[13, 0, 13, 16]], "doors": [{"at": [13, 5], "width": 1.2}]}
    way: dict[str, Any] = {"via": [], "stops": [{"at": [11, 8], "stay": 14}], "at_goal": "leave"}
    motion = run(scene(world=walls, duration=70, **way), 90001)
    assert motion.never_arrive == motion.immobile == ()
    assert not motion.present[-1].any()
    standing = (np.linalg.norm(motion.vel[:, :13], axis=2) < 0.3).sum(axis=0) / motion.fps
    assert (standing > 10).all(), "all stand while the first ones stand at the stop"


def test_all_follow_to_the_free_place_beside_a_stop() -> None:
    others = {"id": "b", "size": 3, "start": [17, 8], "goal": [17, 8]}
    way: dict[str, Any] = {"start": [6, 8], "goal": [24, 8], "via": [], "stops": [{"at": [17, 8], "stay": 6}]}
    gaps = np.linalg.norm(np.diff(middles(run(scene(others, **way), 90001)), axis=1), axis=2)
    assert gaps[60:160].max() < 2.4


def test_a_standing_class_stays_where_it_is() -> None:
    motion = run(scene(goal=[6, 3], via=[]), 90001)
    assert np.linalg.norm(middles(motion)[-1] - middles(motion)[0], axis=1).max() < 0.5


def test_all_start_further_back_or_nobody() -> None:
    motion = run(scene(world={"size": [26, 16], "walls": [[2, 0, 2, 16]]}), 90001)
    gaps = np.linalg.norm(np.diff(middles(motion)[0], axis=0), axis=1)
    assert gaps.max() < 1.5, "only the last pairs have a wall behind them"


def test_it_enters_as_one_when_all_have_room() -> None:
    blocker = {"id": "b", "size": 1, "start": [3.2, 3], "goal": [3.2, 3]}
    motion = run(scene(blocker, enter=2.0), 90001)
    assert not motion.present[:, :13].any(), "somebody stands where the last pair would"
    first = np.argmax(run(scene(enter=2.0), 90001).present, axis=0)
    assert first.tolist() == [20] * 13


def order(**keys: Any) -> list[dict[str, Any]]:
    return [{"id": "e", "when": {"time": 3.0}} | keys]


def test_orders_end_sub_groups() -> None:
    parts = [{"id": "some", "size": 4, "goal": [24, 3]}, {"id": "rest", "goal": [18, 15]}]
    motion = run(scene(event=order(type="split", group="class", parts=parts)), 90001)
    assert motion.subgroup is not None
    assert (motion.subgroup[20, :13] >= 0).all()
    assert (motion.subgroup[40, :13] == -1).all()
    assert [len(part) for part in motion.orders[0].after] == [4, 9]
    other = {"id": "b", "size": 2, "start": [14, 6], "goal": [14, 6]}
    merged = run(scene(other, event=order(type="merge", groups=["class", "b"], into="all")), 90001)
    assert [len(part) for part in merged.orders[0].before] == [13, 2]
    assert len(set(merged.intent[-1].tolist())) == 1


def test_sub_groups_queue_one_after_the_other() -> None:
    queue = order(type="queue", groups=["class"], at=[16, 8], direction_deg=180, service=1.0, goal=[24, 8])
    motion = run(scene(event=queue, duration=60), 90001)
    assert [len(part) for part in motion.orders[0].before] == [13]
    served = [np.argmax(~motion.present[:, c]) for c in range(13)]
    assert min(served) > 0
    assert served[1] == pytest.approx(served[2], abs=15)
    assert set(motion.intent[100, :13].tolist()) == {0}


def test_a_stored_sequence_has_its_sub_groups(tmp_path: Path) -> None:
    made = scene(duration=2)
    assert validate(parse_toml(dump(made), tmp_path), model=Scenario) == made
    (folder,) = generate([Entry("class", made)], range(90001, 90002), tmp_path, streams=())
    sequence, truth = open_sequence(folder), label(run(made, 90001), None)
    assert sequence.truth is not None
    assert sequence.truth.subgroup is not None
    assert truth.subgroup is not None
    np.testing.assert_array_equal(sequence.truth.subgroup, truth.subgroup)
    load_people = simulate(made, 90001).load_people
    assert load_people is not None
    people = load_people()
    assert people["class.pair-2"] == (4, 5)
    assert people["class"] == tuple(range(1, 14))


@pytest.mark.parametrize(
    ("change", "got"),
    [
        ({"size": 12}, "size beside groups"),
        ({"formation": "none"}, "formation beside groups"),
        ({"stops": [{"at": [9, 3], "stay": 3, "members": 2}]}, "stops.members beside groups"),
        ({"groups": [TEACHER, TEACHER]}, "a second group named 'class.teacher'"),
        ({"groups": [TEACHER | {"groups": [PAIRS]}]}, "unknown key 'groups'"),
        ({"groups": [PAIRS | {"size": 0}]}, "0"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, change: dict[str, Any], got: str) -> None:
    keys = "".join(f"{key} = {toml_value(v)}\n" for key, v in (CLASS | change).items())
    (tmp_path / "class.toml").write_text("schema = 1\nworld = { size = [26, 16] }\n[[group]]\n" + keys)
    with pytest.raises(InputError) as error:
        load(tmp_path / "class.toml")
    assert got in str(error.value)
