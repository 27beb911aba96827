"""The cache: hits, what is dropped first, and bytes that are those of the arrays."""

from __future__ import annotations

import sim.sequence
from sim.truth.label import label
from tracking.environment.episode_cache import SourceCache
from tracking.environment.episodes import play, sources

SOURCES = sources("cross", range(4), ["camera.fps=5", "duration=4"])


def test_the_same_source_is_opened_once():
    cache = SourceCache()
    first = cache.open(SOURCES[0])
    assert cache.open(SOURCES[1]) is not first
    assert cache.open(SOURCES[0]) is first
    assert cache.open(SOURCES[0], ("left",)) is not first
    assert len(cache) == 3


def test_it_is_bounded_and_drops_what_was_used_longest_ago():
    cache = SourceCache()
    for source in SOURCES[:2]:
        play("blob", source, cache=cache)
    cache.limit = cache.bytes
    first = cache.open(SOURCES[0])
    play("blob", SOURCES[2], cache=cache)
    assert cache.open(SOURCES[0]) is first
    before = len(cache)
    for source in SOURCES * 3:
        play("blob", source, cache=cache)
        assert cache.bytes <= cache.limit * 2
    assert before <= len(cache) < 4


def test_the_truth_is_labelled_once(monkeypatch):
    calls = []
    monkeypatch.setattr(sim.sequence, "label", lambda *given: calls.append(0) or label(*given))
    opened = SourceCache().open(sources("merge", [0])[0])
    assert opened.sequence.truth is not None
    assert opened.truth.frame is not None
    assert len(calls) == 1
