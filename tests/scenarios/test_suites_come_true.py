"""The suites come true: those after papers have as many sequences, people, events and frames as the papers say; in
`lines` strangers are near each other for long, and the truth never makes them a group."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from scenarios.loading.resolve import Entry, resolve
from sim.crowd.navigation import scene_of
from sim.crowd.population import draw_population, named_people
from sim.draws import drawn
from sim.sequence import simulate
from sim.types import Array, Ints, Sequence, Truth

FRIENDS = resolve("suite:friends-meet")
HARD = resolve("suite:friends-meet-hard")
LINES = {entry.name: entry for entry in resolve("suite:lines")}
PLAIN = [name for name in LINES if not name.endswith("-dense")]
NEW = [name for name in PLAIN if name != "queue"]  # whose groups may enter and leave at any time
SEEDS = range(90_001, 90_005)
GREEN = 4.0  # s from the first second in which people start at the lights


def people(entry: Entry, seed: int) -> int:
    parties = draw_population(entry.scenario, scene_of(entry.scenario.world), seed, entry.repeat)
    return sum(len(party.members) for party in parties)


@pytest.mark.slow
def test_friends_meet_has_18_simple_and_10_hard_entries() -> None:
    hard = [e for e in FRIENDS if e.name.startswith("friends-hard-")]
    assert (len(FRIENDS), len(hard)) == (28, 10)
    for entry in FRIENDS:
        low, high = (10, 16) if entry in hard else (4, 10)
        assert all(low <= people(entry, seed) <= high for seed in range(10)), entry.name
        orders = len(entry.scenario.event)
        assert orders >= 1 if entry in hard else orders in {1, 2}
        camera = entry.scenario.camera
        assert (camera.kind, camera.image, camera.px_per_m, camera.fps) == ("top", (640, 480), 40, 10)


@pytest.mark.slow
def test_strangers_of_the_hard_suite_are_near_and_alike_for_seconds() -> None:
    for name in ("abreast", "beside", "converge", "brush", "door", "lag"):
        entries = [e for e in HARD if e.name.startswith(f"friends-{name}-")]
        truths = (simulate(e.scenario, 90_001, e.repeat, streams=()).truth for e in entries)
        assert any((t.near.end - t.near.start).max(initial=0) > 30 for t in truths if t and t.near), name


@pytest.mark.slow
@pytest.mark.parametrize("entry", [*FRIENDS, *HARD], ids=lambda e: e.name)
def test_friends_meet_as_ordered(entry: Entry) -> None:
    sequence = simulate(entry.scenario, 90_001, entry.repeat)
    assert sequence.truth is not None  # a WorkError where an order has not come true
    assert (sequence.length, sequence.truth.px_per_m) == (200, pytest.approx(40))
    kinds = [e.kind for e in sequence.truth.events or ()]
    assert len([k for k in kinds if k in {"merge", "split", "form", "dissolve", "queue"}]) >= len(entry.scenario.event)
    assert sequence.truth.visible_box is not None
    assert (sequence.truth.truncation < 0.01).all()


@pytest.mark.slow
@pytest.mark.parametrize(("entry", "frames"), [("cross", 400), ("merge", 400), ("stairs", 500), ("crowded", 400)])
def test_subtraction_stereo(entry: str, frames: int) -> None:
    found = {e.name: e for e in resolve("suite:subtraction-stereo")}[f"stereo-{entry}"]
    sequence = simulate(found.scenario, 90_001)
    assert (sequence.length, sequence.fps) == (frames, 30)
    if entry != "stairs":
        assert sequence.camera.position[2] == pytest.approx(5.1)
    else:
        assert sequence.truth.z.max() == pytest.approx(1.6, abs=0.01)
        assert sequence.truth.z[sequence.truth.frame == 1].max() < 0.3


@pytest.mark.slow
@pytest.mark.parametrize("seed", [957, 961])
def test_everybody_climbs_the_stairs(seed: int) -> None:
    """Members who walk at the outside of their group, too: nobody passes beside the flight or the landing."""
    (found,) = [e for e in resolve("suite:subtraction-stereo") if e.name == "stereo-stairs"]
    truth = simulate(found.scenario, seed, streams=()).truth
    z = truth.z[truth.pos[:, 1] < 5.9]
    assert len(z) > 100
    assert z.min() == pytest.approx(1.6, abs=0.01)


@cache
def played(name: str, seed: int) -> Sequence:
    return simulate(LINES[name].scenario, seed, LINES[name].repeat, streams=())


def truth_of(name: str, seed: int) -> Truth:
    truth = played(name, seed).truth
    assert truth is not None
    assert truth.pos is not None
    assert truth.vel is not None
    return truth


def script_groups(entry: Entry, seed: int) -> dict[int, str]:
    """Returns the name of the script's group of each person, by id."""
    scene = played(entry.name, seed).scene
    assert scene is not None
    names = named_people(drawn(entry.scenario, seed, entry.repeat), scene, seed, entry.repeat, ())
    return {person: name for name, people in names.items() if "." not in name for person in people}


def labels(truth: Truth, person: int) -> set[int]:
    return set(truth.group[truth.id == person].tolist())


def file_on_path(truth: Truth, frame: int) -> tuple[Ints, Array]:
    """Returns ids and x, m, of the people on the path of single-file, who walk along x, from left to right."""
    rows = truth.rows(frame)
    x = truth.pos[rows, 0]
    on = np.flatnonzero((x > 8) & (x < 18))
    on = on[np.argsort(x[on])]
    return truth.id[rows][on], x[on]


def test_each_scenario_is_played_as_it_is_and_denser() -> None:
    assert list(LINES) == [name for plain in PLAIN for name in (plain, f"{plain}-dense")]
    assert PLAIN == ["queue", "waiting", "crossing-lights", "single-file"]
    for name in NEW:
        people, more = (len(np.unique(truth_of(n, SEEDS[0]).id)) for n in (name, f"{name}-dense"))
        assert more > 1.2 * people, name


@pytest.mark.parametrize("name", LINES)
def test_strangers_are_in_no_group_and_groups_stay_whole(name: str) -> None:
    for seed in SEEDS if name in PLAIN else SEEDS[:1]:
        truth, group_of = truth_of(name, seed), script_groups(LINES[name], seed)
        together = {person: {q for q in group_of if group_of[q] == group_of[person]} for person in group_of}
        groups = [truth.group[truth.id == person] for person, mates in together.items() if len(mates) == 1]
        assert (np.concatenate(groups) == -1).all(), f"seed {seed}: a person alone is in a group"
        for people in together.values():
            assert len(set().union(*(labels(truth, q) for q in people)) - {-1}) <= 1, f"seed {seed}: {people}"
        assert {e.kind for e in truth.events or ()} <= {"queue", "cross", "enter", "leave"}, f"seed {seed}"


@pytest.mark.parametrize("name", LINES)
def test_nobody_is_stuck(name: str) -> None:
    for seed in SEEDS if name in PLAIN else SEEDS[:1]:
        assert [n.words for n in (*played(name, seed).never_arrive, *played(name, seed).immobile)] == []


@pytest.mark.parametrize("name", PLAIN)
def test_strangers_are_near_each_other_for_long(name: str) -> None:
    """In each sequence two of them satisfy the merge rule for 6 s or more."""
    for seed in SEEDS:
        truth = truth_of(name, seed)
        assert truth.near is not None
        assert (truth.near.end - truth.near.start).max(initial=0) > 6 * truth.fps, f"seed {seed}"


@pytest.mark.parametrize("name", NEW)
def test_seeds_differ_in_people_and_sizes_of_groups(name: str) -> None:
    entry = LINES[name]
    found = []
    for seed in SEEDS:
        names = list(script_groups(entry, seed).values())
        found.append(tuple(sum(names.count(n) == size for n in set(names)) for size in (1, 2, 3)))
    assert len(set(found)) == len(SEEDS)
    assert all(alone >= 4 and pairs + threes >= 1 for alone, pairs, threes in found)
    assert any(pairs for _, pairs, _ in found)
    assert any(threes for *_, threes in found)


def test_who_waits_stands_as_near_as_in_a_row_of_seats() -> None:
    """The nearest stranger of a person who stands is 0.55 to 1.6 m away for most."""
    nearest: list[float] = []
    for seed in SEEDS:
        truth, group_of = truth_of("waiting", seed), script_groups(LINES["waiting"], seed)
        for frame in range(1, truth.length + 1, 20):
            rows = truth.rows(frame)
            still = np.hypot(*truth.vel[rows].T) < 0.2
            pos = truth.pos[rows][still]
            groups = np.array([group_of[person] for person in truth.id[rows][still].tolist()])
            apart = np.hypot(*(pos[:, None] - pos).transpose(2, 0, 1))
            apart[groups[:, None] == groups] = np.inf
            nearest += apart.min(axis=1, initial=np.inf).tolist()
    low, middle, high = np.quantile(nearest, [0.05, 0.5, 0.7])
    assert 0.55 < low < middle < 1.2
    assert high < 1.6


def test_who_waits_for_the_gate_goes_through_it_together() -> None:
    """Nobody passes the barrier before it opens; of those who pass, most do so within 12 s."""
    for seed in SEEDS:
        truth, scenario = truth_of("waiting", seed), drawn(LINES["waiting"].scenario, seed, 0)
        ((opens, _),) = scenario.world.doors[0].open or ()
        passed = [
            truth.frame[(truth.id == person) & (truth.pos[:, 1] > 11)].min(initial=10**6)
            for person in np.unique(truth.id)
        ]
        after = np.array([frame / truth.fps - opens for frame in passed if frame < 10**6])
        assert len(after) >= 4, f"seed {seed}"
        assert after.min() > 0
        assert (after < 12).mean() > 0.6, f"seed {seed}"


def test_people_start_at_once_when_the_light_is_green() -> None:
    """Of those who stood at a kerb 1 s before, most walk 4 s later; some of them are strangers to each other."""
    for seed in SEEDS:
        truth = truth_of("crossing-lights", seed)
        scenario = drawn(LINES["crossing-lights"].scenario, seed, 0)
        until = next(g for g in scenario.group if g.id == "there").stops[0].until
        starts = [t for k, t in enumerate(until) if not k or t > until[k - 1] + 1]
        assert 2 <= len(starts) <= 3
        frames = [round((starts[0] + t) * truth.fps) + 1 for t in (-1.0, GREEN)]
        speed = [
            dict(zip(truth.id[r].tolist(), np.hypot(*truth.vel[r].T).tolist(), strict=True))
            for r in map(truth.rows, frames)
        ]
        stood = [person for person, v in speed[0].items() if v < 0.2]
        assert len(stood) >= 3, f"seed {seed}"
        assert np.mean([speed[1].get(person, 1.0) > 0.5 for person in stood]) > 0.7, f"seed {seed}"


def test_people_on_the_path_walk_in_file_and_nobody_overtakes() -> None:
    gaps: list[float] = []
    speeds: list[float] = []
    for seed in SEEDS:
        truth, group_of = truth_of("single-file", seed), script_groups(LINES["single-file"], seed)
        before: list[int] = []
        for frame in range(1, truth.length + 1, 5):
            ids, x = file_on_path(truth, frame)
            order = ids.tolist()
            assert [p for p in order if p in before] == [p for p in before if p in order], f"seed {seed}: {frame}"
            before = order
            strangers = [group_of[a] != group_of[b] for a, b in pairwise(order)]
            gaps += np.diff(x)[np.array(strangers, bool)].tolist()
            rows = truth.rows(frame)
            speeds += np.hypot(*truth.vel[rows][np.isin(truth.id[rows], ids)].T).tolist()
    low, middle = np.quantile(gaps, [0.05, 0.4])
    assert low > 0.4
    assert 0.8 < middle < 2.0
    assert 0.6 < np.median(speeds) < 1.3
