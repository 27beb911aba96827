"""The cache: hits, what is dropped first, and bytes that are those of the arrays."""

from __future__ import annotations

from tracking.episodes.episode import play, sources
from tracking.episodes.episode_cache import SourceCache

SOURCES = sources("cross", range(4), ["camera.fps=5", "duration=4"])


def test_it_is_bounded_and_drops_what_was_used_longest_ago():
    cache = SourceCache()
    for source in SOURCES[:2]:
        play("blob", source, cache=cache)
    first = cache.open(SOURCES[0])
    cache.limit = cache.bytes
    play("blob", SOURCES[2], cache=cache)
    assert cache.open(SOURCES[0]) is first
    before = len(cache)
    for source in SOURCES * 3:
        play("blob", source, cache=cache)
        assert cache.bytes <= cache.limit * 2
    assert before <= len(cache) < 4


def test_what_a_source_comes_to_hold_later_counts():
    cache = SourceCache()
    for source in SOURCES[:2]:
        cache.open(source)
    assert cache.bytes < 1000
    assert cache.open(SOURCES[0]).truth is not None
    last = cache.open(SOURCES[1])
    assert cache.bytes > last.bytes + 1000
