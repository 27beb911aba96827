"""The cache: hits, what is dropped first, and bytes that are those of the arrays."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from tracking.environment.episode_cache import SourceCache, array_bytes
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


def test_without_room_only_the_last_stays():
    cache = SourceCache(0)
    for source in SOURCES:
        play("blob", source, cache=cache)
    assert len(cache) == 1
    with pytest.raises(InputError, match="bytes"):
        SourceCache(-1)


def test_bytes_of_arrays():
    a, b = np.zeros(1000), np.zeros(10)
    assert array_bytes([a, (a[:5], {"b": b}), a.reshape(2, 500)]) == 8080

    def closes_over():
        return b

    assert array_bytes(closes_over) == 80
