"""Looks of a motion: gait, what people carry, and distractors."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from scenarios.schema.looks import Carry, Distractors, LooksSpec
from scenarios.schema.values import Distribution
from sim.clock import every_nth
from sim.looks import with_looks
from sim.scene.figure import HELD, THINGS, WORN
from sim.sequence import simulate
from sim.types import Looks, Motion, Scene
from tests.reference_sense import crowd, walkers


def looks(motion: Motion, **spec: object) -> Looks:
    found = with_looks(motion, LooksSpec(**spec)).looks  # type: ignore[arg-type]
    assert found is not None
    return found


def test_without_the_table_nothing_is_added() -> None:
    motion = crowd(1)
    assert with_looks(motion, None) is motion


def test_one_stride_of_a_walker_is_half_its_height_and_a_quarter_of_its_speed() -> None:
    motion = walkers(np.array([[2.0, 5.0], [3.0, 2.0]]), np.array([[1.2, 0.0], [0.0, 0.0]]), frames=60, height=1.8)
    found = looks(motion, figure="limbs")
    turns = np.unwrap(found.phase[:, 0])[-1] - found.phase[0, 0]
    assert turns / (2 * np.pi) == pytest.approx(1.2 * 5.9 / (1.8 * (0.5 + 0.25 * 1.2)))
    assert found.swing[:, 0] == pytest.approx((1.2 - 0.2) / 1.2)
    assert (found.swing[:, 1] == 0).all()
    assert (np.diff(found.phase[:, 1]) == 0).all()


def test_shares_are_those_of_the_people() -> None:
    found = looks(crowd(2, people=800, frames=3), carry=Carry(rucksack=0.3, umbrella=0.1))
    assert found.worn.mean(axis=0) == pytest.approx([0, 0, 0.3, 0], abs=0.05)
    assert set(found.kind.tolist()) == {THINGS.index("umbrella")}
    assert len(found.kind) / 800 == pytest.approx(0.1, abs=0.03)


def test_a_held_thing_goes_with_its_holder() -> None:
    motion = crowd(4, people=20)
    found = looks(motion, carry=Carry(**dict.fromkeys(HELD, 0.3)))
    assert len(found.number) > 5
    np.testing.assert_array_equal(found.place, motion.pos[:, found.number - 1])
    np.testing.assert_array_equal(found.turn, motion.heading[:, found.number - 1])


def test_a_further_person_or_share_changes_nobody_elses_looks() -> None:
    motion = crowd(5, people=30)
    fewer = motion.replace(
        **{name: getattr(motion, name)[:, :29] for name in ("pos", "vel", "heading", "present", "intent")},
        **{name: getattr(motion, name)[:29] for name in ("height", "width", "depth", "free_speed")},
    )
    half = Carry(**dict.fromkeys(WORN, 0.5))
    many, few = looks(motion, carry=half), looks(fewer, carry=half)
    np.testing.assert_array_equal(many.worn[:29], few.worn)
    np.testing.assert_array_equal(many.phase[:, :29], few.phase)
    more = looks(motion, carry=half.model_copy(update={"pram": 1.0}), figure="limbs")
    np.testing.assert_array_equal(more.worn, many.worn)


def test_distractors_come_in_their_mean_number_and_stay_away_from_people_and_walls() -> None:
    wall = np.array([[[0.0, 5.0], [16.0, 5.0]]])
    numbers, rooms, from_wall = [], [], []
    for seed in range(30):
        motion = crowd(seed, people=8, scene=Scene(np.array([16.0, 10.0]), walls=wall)).replace(seed=seed)
        found = looks(motion, distractors=Distractors(bin=1.5, bollard=Distribution(uniform=(0, 2))))
        numbers.append([(found.kind == THINGS.index(name)).sum() for name in ("bin", "bollard")])
        rooms.append(np.linalg.norm(found.place[:, :, None] - motion.pos[:, None], axis=-1).min(initial=9.0))
        from_wall.append(np.abs(found.place[..., 1] - 5.0).min(initial=9.0))
    assert np.mean(numbers, axis=0) == pytest.approx([1.5, 1.0], abs=0.35)
    assert set(np.array(numbers)[:, 0].tolist()) == {1, 2}
    assert min(rooms) > 0.8
    assert min(from_wall) > 0.8


def test_dogs_and_cars_move_on_straight_lines_and_others_stand() -> None:
    found = looks(crowd(1), distractors=Distractors(dog=9, car=9, poster=3))
    moved = np.linalg.norm(found.place[-1] - found.place[0], axis=1) / (29 / 10.0)
    for name, speed in (("dog", 1.2), ("car", 5.0)):
        assert set(np.round(moved[found.kind == THINGS.index(name)], 6).tolist()) == {0.0, speed}
    assert (moved[found.kind == THINGS.index("poster")] == 0).all()


def test_any_colours_are_of_the_share_and_leave_given_ones() -> None:
    motion = crowd(1, people=400, frames=3)
    clothes = np.full((400, 2, 3), np.nan)
    clothes[:100] = 50.0
    found = with_looks(motion.replace(clothes=clothes), LooksSpec(colours=0.4)).clothes
    assert found is not None
    assert (found[:100] == 50.0).all()
    assert np.isfinite(found[100:]).all(axis=2).mean() == pytest.approx(0.4, abs=0.05)


def test_a_stride_shows_the_same_people() -> None:
    motion = with_looks(crowd(6), LooksSpec(figure="limbs", distractors=Distractors(dog=2)))
    whole, third = motion.looks, every_nth(motion, 3).looks
    assert whole is not None
    assert third is not None
    np.testing.assert_array_equal(third.phase, whole.phase[::3])
    np.testing.assert_array_equal(third.place, whole.place[::3])


def test_a_scenario_switches_it_on_and_draws_its_numbers() -> None:
    drawn = load("merge", ["looks.figure=limbs", "looks.carry.hat={ uniform = [0.2, 0.4] }", "looks.distractors.dog=1"])
    plain, looked = (simulate(one, 3).truth for one in (load("merge"), drawn))
    assert plain.box is not None
    assert looked.box is not None
    np.testing.assert_array_equal(plain.pos, looked.pos)
    assert (plain.box != looked.box).any()
    again = simulate(drawn, 3).truth
    np.testing.assert_array_equal(again.box, looked.box)


@pytest.mark.parametrize(
    ("setting", "place", "expected"),
    [
        ("looks.figure=robots", "looks.figure", "limbs"),
        ("looks.carry.hat=1.5", "looks.carry.hat", "1"),
        ("looks.distractors.cat=1", "looks.distractors.cat", ""),
        ("looks.distractors.dog=-1", "looks.distractors.dog", "from 0 to 200"),
    ],
)
def test_wrong_keys_and_values_are_refused(setting: str, place: str, expected: str) -> None:
    with pytest.raises(InputError, match=place) as caught:
        load("merge", [setting])
    assert expected in str(caught.value)
