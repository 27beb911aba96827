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
    before = cache.bytes
    assert cache.open(SOURCES[0]).truth is not None
    assert cache.bytes > before + 1000


def test_sources_that_differ_in_the_sensor_share_people_truth_and_scorer():
    cache = SourceCache()
    (source,) = sources("cross", [3], ["camera.fps=5", "duration=4"])
    (hard,) = sources("cross", [3], ["camera.fps=5", "duration=4", "sensor.detect_prob=0.5"])
    (other,) = sources("cross", [3], ["camera.fps=5", "duration=4", "crowd.spacing=1"])
    first, second, third = (cache.open(each) for each in (source, hard, other))
    assert first.scorer is second.scorer
    assert first.scorer is not third.scorer
    for each in (source, hard):
        assert play("blob", each, cache=cache, every_score=True).scores == play("blob", each, every_score=True).scores
