"""The suites after papers: as many sequences, people, events and frames as the papers say."""

from __future__ import annotations

import pytest

from scenarios.loading.resolve import Entry, resolve
from sim.crowd.navigation import scene_of
from sim.crowd.population import draw_population
from sim.sequence import simulate

pytestmark = pytest.mark.slow

FRIENDS = resolve("suite:friends-meet")
HARD = resolve("suite:friends-meet-hard")


def people(entry: Entry, seed: int) -> int:
    parties = draw_population(entry.scenario, scene_of(entry.scenario.world), seed, entry.repeat)
    return sum(len(party.members) for party in parties)


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


def test_strangers_of_the_hard_suite_are_near_and_alike_for_seconds() -> None:
    for name in ("abreast", "beside", "converge", "brush", "door", "lag"):
        entries = [e for e in HARD if e.name.startswith(f"friends-{name}-")]
        truths = (simulate(e.scenario, 90_001, e.repeat, streams=()).truth for e in entries)
        assert any((t.near.end - t.near.start).max(initial=0) > 30 for t in truths if t and t.near), name


@pytest.mark.parametrize("entry", [*FRIENDS, *HARD], ids=lambda e: e.name)
def test_friends_meet_as_ordered(entry: Entry) -> None:
    sequence = simulate(entry.scenario, 90_001, entry.repeat)
    assert sequence.truth is not None  # a WorkError where an order has not come true
    assert (sequence.length, sequence.truth.px_per_m) == (200, pytest.approx(40))
    kinds = [e.kind for e in sequence.truth.events or ()]
    assert len([k for k in kinds if k in {"merge", "split", "form", "dissolve", "queue"}]) >= len(entry.scenario.event)
    assert sequence.truth.visible_box is not None
    assert (sequence.truth.truncation < 0.01).all()


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


@pytest.mark.parametrize("seed", [957, 961])
def test_everybody_climbs_the_stairs(seed: int) -> None:
    """Members who walk at the outside of their group, too: nobody passes beside the flight or the landing."""
    (found,) = [e for e in resolve("suite:subtraction-stereo") if e.name == "stereo-stairs"]
    truth = simulate(found.scenario, seed, streams=()).truth
    z = truth.z[truth.pos[:, 1] < 5.9]
    assert len(z) > 100
    assert z.min() == pytest.approx(1.6, abs=0.01)
