"""What a source can be, and that it is small."""

from __future__ import annotations

import pickle
from dataclasses import replace

import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from tracking.episodes.episode import play
from tracking.episodes.sources import sources


def test_a_suite_with_seeds_in_order():
    found = sources("quick", [4, 5])
    assert [(s.name, s.seed) for s in found][:3] == [("merge", 4), ("merge", 5), ("split", 4)]
    assert all(s.simulated for s in found)


def test_they_are_small_and_travel():
    source = sources("cross", [3])[0]
    packed = pickle.dumps(source)
    assert len(packed) < 20_000
    again = pickle.loads(packed)
    assert again.key == source.key
    assert again.key != sources("cross", [4])[0].key
    assert again.key != sources("cross", [3], ["duration=5"])[0].key


def test_sequences_in_memory_and_lists():
    sequence = simulate(load("cross", ["camera.fps=5", "duration=4"]), 3, 0, ())
    found = sources([sequence, "split", sources("merge", [9])[0]], [1])
    assert [(s.name, s.seed) for s in found] == [("cross", 3), ("split", 1), ("merge", 9)]
    assert found[0].open() is sequence


WRONG_SOURCES = [
    ("crosss", {}, "a scenario, a suite"),
    ([], {}, "at least one"),
    ("cross", {"seeds": []}, "at least one"),
    ("cross", {"set": ["wrold.size=[1,2]"]}, "wrold"),
]


@pytest.mark.parametrize(("what", "options", "words"), WRONG_SOURCES)
def test_wrong_sources(what, options, words):
    with pytest.raises(InputError, match=words):
        sources(what, **options)


def test_settings_without_a_scenario_are_refused():
    sequence = simulate(load("cross", ["duration=4"]), 3, 0, ())
    with pytest.raises(InputError, match="leave the settings out"):
        sources(sequence, set=["camera.fps=5"])


def test_without_labels_there_is_no_episode():
    bare = replace(simulate(load("cross", ["camera.fps=5", "duration=8"]), 3, 0, ()), load_truth=None)
    with pytest.raises(InputError, match="nothing to score by"):
        play("blob", sources(bare)[0])
