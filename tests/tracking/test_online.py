"""Trackers whose parameters change between frames: what they do is what a tracker reset with the new ones does."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Context
from tracking.parameter_space import decode, decode_and_build
from tracking.running.prepare import prepare
from tracking.running.tracker_registry import find, names

POINTS = ["camera.fps=5", "duration=4", "sensor.detect_prob=0.7", "sensor.clutter_rate=1"]
PIXELS = ["camera.fps=5", "duration=2", "camera.image=[160,120]"]
# People are so near that a stereo pair tells their distance.
PAIRS = [
    "camera.fps=10", "duration=2", "camera.image=[240,180]", "camera.focal_px=200", "camera.height=6",
    "camera.crop=true", "camera.baseline=0.3",
]  # fmt: skip
# By these the background sample was looked through already.
TRAINED = ("detection_rate", "dark")


@pytest.fixture(scope="module")
def points():
    return simulate(load("cross", POINTS), 3, 0, ())


@pytest.fixture(scope="module")
def pixels():
    return simulate(load("cross", PIXELS), 3, 0, ("left", "background"))


@pytest.fixture(scope="module")
def pairs():
    return simulate(load("cross", PAIRS), 3, 0, ("left", "right", "background"))


def pictures_for(name, request):
    """Pictures that this tracker can work with."""
    return request.getfixturevalue("pixels" if "pixels" in find(name).needs else "pairs")


def answers(name, sequence, mode, configs):
    """Answers with the config that `configs` holds from each frame on."""
    ready = prepare(name, sequence, params=configs.get(0), detections=mode)
    ready.reset(0)
    made = []
    for frame in ready.frames():
        ready.tracker.config = configs.get(frame.index, ready.tracker.config)
        made.append(ready.step(frame))
    return made


def same(a, b):
    assert len(a) == len(b)
    for s, t in zip(a, b, strict=True):
        assert np.array_equal(s.id, t.id)
        assert np.array_equal(s.pos, t.pos)
        assert np.array_equal(s.cov, t.cov)
        assert [e.kind for e in s.events] == [e.kind for e in t.events]


def differ(a, b):
    pairs = [(x, y) for s, t in zip(a, b, strict=True) for x, y in ((s.pos, t.pos), (s.group, t.group))]
    return not all(np.array_equal(x, y) for x, y in pairs)


def other(p, value):
    """Another value of a parameter, far from this one."""
    if p.scale == "categorical":
        return next(c for c in p.choices if c != value)
    return p.low + 0.03 * (p.high - p.low) if value > (p.low + p.high) / 2 else p.high - 0.03 * (p.high - p.low)


def changed(config, p):
    """The config with another value of this parameter alone, if it can be had."""
    try:
        return dataclasses.replace(config, **{p.name: other(p, getattr(config, p.name))})
    except InputError:
        return None


@pytest.mark.parametrize("name", names())
def test_each_parameter_changed_after_the_reset_is_as_if_reset_with(name, points):
    kind = find(name).config_class
    counted, plain = 0, answers(name, points, "file", {})
    for p in (p for p in kind.space(online=True) if p.sees != "pixels"):
        config = changed(kind(), p)
        if config is None:
            continue
        try:
            reset = answers(name, points, "file", {0: config})
        except InputError:
            with pytest.raises(InputError):
                answers(name, points, "file", {1: config})
            continue
        same(reset, answers(name, points, "file", {1: config}))
        counted += differ(reset, plain)
    assert counted >= 6, "most have an effect here"


@pytest.mark.parametrize("name", names())
def test_from_pixels_too(name, request):
    pixels = pictures_for(name, request)
    kind, rng = find(name).config_class, np.random.default_rng(5)
    space = tuple(p for p in kind.space(online=True) if p.name not in TRAINED)
    plain = answers(name, pixels, "image", {})

    def allowed(config):
        find(name)(config).reset(Context(pixels.fps, 40.0), 0)
        return config

    for _ in range(2):  # each of which changes every parameter
        action = rng.uniform(-0.5, 0.5, len(space))
        config = decode_and_build(space, action, kind(), allowed)
        reset = answers(name, pixels, "image", {0: config})
        same(reset, answers(name, pixels, "image", {1: config}))
        assert differ(plain, reset)


@pytest.mark.parametrize("name", names())
def test_a_change_half_way_is_seen_from_there_on_and_not_before(name, points):
    kind = find(name).config_class
    config = decode(kind.space(online=True), np.full(len(kind.space(online=True)), -0.3), kind())
    plain, late = answers(name, points, "file", {}), answers(name, points, "file", {12: config})
    same(plain[:11], late[:11])
    assert differ(plain[11:], late[11:])
