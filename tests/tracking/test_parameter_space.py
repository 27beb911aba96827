"""The cube of a search space: there and back, clipped, and never a config that cannot be."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.errors import InputError
from tracking.config import Config, param
from tracking.parameter_space import decode, decode_and_build, encode, moved
from tracking.running.tracker_registry import find, names

CONFIGS = [find(name).config_class for name in names()]


@dataclasses.dataclass(frozen=True)
class Mixed(Config):
    tracker = "mixed"
    gate: float = param(2.0, (1.0, 5.0), "", "linear")
    rate: float = param(1.0, (0.01, 100.0), "1/s", "log", "log")
    count: int = param(3, (2, 6), "", "whole", "int")
    kind: str = param("b", ("a", "b", "c"), "", "a choice", "categorical")
    on: bool = param(True, (True, False), "", "a switch", "categorical")
    fixed: float = param(0.5, (0.0, 1.0), "", "not searched", tunable=False)

    def check(self):
        if self.gate + self.rate > 50:
            raise InputError(place="rate", got=str(self.rate), expected="less", remedy="lower it")


SPACE = Mixed.space()


def test_known_points():
    assert encode(SPACE, Mixed()) == pytest.approx([-0.5, 0.0, -0.4, 0.0, -0.5])
    config = decode(SPACE, [1.0, 0.5, 1.0, 1.0, 1.0], Mixed(fixed=0.25))
    assert config.rate == pytest.approx(10.0)
    assert (config.gate, config.count, config.kind, config.on, config.fixed) == (5.0, 6, "c", False, 0.25)
    narrow = [dataclasses.replace(SPACE[2], low=4)]
    assert encode(narrow, Mixed(count=2)) == pytest.approx(encode(narrow, Mixed(count=4)))
    low = decode(SPACE, [-1.0] * 5, Mixed())
    assert (low.gate, low.rate, low.count, low.kind, low.on) == (1.0, 0.01, 2, "a", True)
    assert type(low.count) is int


@given(st.floats(1, 5), st.floats(0.01, 40), st.integers(2, 6), st.sampled_from("abc"), st.booleans())
def test_there_and_back(gate, rate, count, kind, on):
    config = Mixed(gate, rate, count, kind, on)
    again = decode(SPACE, encode(SPACE, config), Mixed())
    assert (again.count, again.kind, again.on) == (count, kind, on)
    assert (again.gate, again.rate) == pytest.approx((gate, rate), rel=1e-12)


def test_residuals_lead_from_the_base_to_the_ends():
    base = Mixed(gate=3.5, rate=0.37, count=4, kind="c", on=False, fixed=0.2)
    origin = encode(SPACE, base)
    assert origin == pytest.approx([0.25, np.log10(0.37) / 2, 0.0, 2 / 3, 0.5])
    assert decode(SPACE, moved(SPACE, np.zeros(5), base), base) == base, "to the last bit"
    for end in (-1.0, 1.0):
        assert moved(SPACE, np.full(5, end), base) == pytest.approx([end] * 5, abs=1e-12)
        assert moved(SPACE, np.full(5, 3 * end), base) == pytest.approx([end] * 5, abs=1e-12)
        assert moved(SPACE, np.full(5, end / 2), base) == pytest.approx((origin + end) / 2)
    with pytest.raises(InputError, match="action"):
        moved(SPACE, [0.0] * 4, base)


@given(st.lists(st.floats(-3, 3), min_size=5, max_size=5))
def test_every_point_is_a_config(action):
    config = decode(SPACE, action, Mixed())
    assert config.gate + config.rate <= 50
    free = dict(zip(["gate", "rate", "count", "kind", "on"], np.clip(action, -1, 1), strict=True))
    if 0.01 * 1e4 ** ((free["rate"] + 1) / 2) < 45:
        assert np.abs(encode(SPACE, config)[:2] - [free["gate"], free["rate"]]).max() < 1e-9


def test_what_cannot_be_is_drawn_back_along_a_line_as_little_as_may_be():
    base, action = Mixed(), np.array([-1.0, 1.0, -0.4, 0.0, -0.5])
    config = decode(SPACE, action, base)
    origin, point = encode(SPACE, base), encode(SPACE, config)
    share = (point - origin)[:2] / (action - origin)[:2]
    assert share[0] == pytest.approx(share[1])
    assert 40 < config.gate + config.rate <= 50
    assert 1.9 < decode_and_build(SPACE, [0.0] * 5, Mixed(gate=1.0), at_most_two) <= 2


def at_most_two(config):
    if config.gate > 2:
        raise InputError(place="x", got="y", expected="z", remedy="w")
    return config.gate


@pytest.mark.parametrize("action", [[0.0] * 4, [[0.0] * 5], [0, 0, 0, 0, np.nan], [0, 0, 0, 0, np.inf], ["0.5"] * 5])
def test_wrong_actions_are_named(action):
    with pytest.raises(InputError, match="action"):
        decode(SPACE, action, Mixed())


@pytest.mark.parametrize("kind", CONFIGS)
def test_spaces_of_all_trackers(kind):
    space, defaults = kind.space(), kind()
    point = encode(space, defaults)
    assert (np.abs(point) <= 1).all()
    back = decode(space, point, kind()).as_dict()
    for p in space:
        value = getattr(defaults, p.name)
        assert back[p.name] == (pytest.approx(value, rel=1e-12) if type(value) is float else value)
    for corner in np.random.default_rng(0).choice([-1.0, 1.0], (20, len(space))):
        assert isinstance(decode(space, corner, defaults), kind)
