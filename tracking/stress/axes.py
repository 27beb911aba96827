"""Axes of difficulty: an axis is a name, the keys of a scenario that it sets, and the range from easy to hard. Any key
that takes a number is one (`crowd.spacing=1:2`).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from scenarios.errors import InputError
from scenarios.loading.toml_files import Setting, did_you_mean

Settings = Callable[[float], list[Setting]]  # value: the settings of a scenario
NUMBER = re.compile(r"-?[0-9]+(\.[0-9]+)?")


@dataclass(frozen=True)
class Axis:
    """One axis of difficulty."""

    name: str
    easy: float
    hard: float
    settings: Settings
    whole: bool = False  # values are whole numbers
    about: str = ""  # what a value is

    def between(self, a: float, b: float) -> float | None:
        """Returns the value in the middle of two values; None if whole numbers have none between them."""
        middle = round((a + b) / 2) if self.whole else (a + b) / 2
        return None if middle in (a, b) else middle

    def spread(self, count: int) -> list[float]:
        """Returns up to `count` evenly spread values from easy to hard, without repeats."""
        return list(dict.fromkeys(self.at(k / (count - 1)) for k in range(count)))

    def at(self, share: float) -> float:
        """Returns the value at a share of the way from easy (0) to hard (1)."""
        value = self.easy + (self.hard - self.easy) * share
        return float(round(value)) if self.whole else value


def _number(value: float) -> float:
    """Returns the value rounded to 10 digits, as an int if it is whole."""
    rounded = float(f"{value:.10g}")
    return int(rounded) if rounded.is_integer() else rounded


def _key(key: str) -> Settings:
    return lambda value: [Setting(key, _number(value))]


def _noise(value: float) -> list[Setting]:
    return [*_key("sensor.noise_m")(0.05 * value), *_key("sensor.box_noise.scale")(value)]


def _speeds(value: float) -> list[Setting]:
    return [Setting("crowd.free_speed", {"normal": [1.34, _number(value)], "clip": [0.3, 2.6]})]


def _shake(value: float) -> list[Setting]:
    return [Setting("camera.motion", {"kind": "shake", "px": _number(value)})]


AXES = {
    axis.name: axis
    for axis in (
        Axis("detection", 1.0, 0.4, _key("sensor.detect_prob"), about="probability that a person is detected"),
        Axis("clutter", 0.0, 6.0, _key("sensor.clutter_rate"), about="false alarms per frame"),
        Axis("noise", 0.0, 5.0, _noise, about="errors of points and boxes; 1: the default ones"),
        Axis("occlusion", 0.0, 0.8, _key("sensor.min_visibility"), about="visible share below which people are missed"),
        Axis("people", 1, 30, _key("group.passers.repeat"), whole=True, about="groups `passers` of strangers: density"),
        Axis("gap", 0.6, 1.6, _key("crowd.spacing"), about="m between neighbours in a group: spacing"),
        Axis("velocity-difference", 0.0, 0.6, _speeds, about="m/s, standard deviation of people's speeds"),
        Axis("frame-rate", 25.0, 1.0, _key("camera.fps"), about="frames per second"),
        Axis("camera-height", 15.0, 3.0, _key("camera.height"), about="m"),
        Axis("tilt", 80.0, 15.0, _key("camera.tilt_deg"), about="degrees by which the camera looks down"),
        Axis("camera-motion", 0.0, 20.0, _shake, about="px, standard deviation of a trembling camera's movement"),
        Axis("light", 0.0, 0.3, _key("light.drift"), about="relative changes of brightness, of pictures"),
        Axis("contrast", 0.0, 20.0, _key("picture.noise"), about="noise of pictures, grey levels"),
    )
}  # fmt: skip


def parse_axes(texts: Iterable[str]) -> tuple[Axis, ...]:
    """Returns one axis per text, as `parse_axis` reads it. Raises InputError if an axis is named twice."""
    axes = tuple(parse_axis(text) for text in texts)
    for axis in axes:
        if sum(other.name == axis.name for other in axes) > 1:
            raise InputError(place="--vary", got=f"{axis.name} twice", expected="it once", remedy="leave one out")
    return axes


def parse_axis(text: str) -> Axis:
    """Returns the axis of a text NAME, NAME=EASY:HARD or KEY=EASY:HARD. Raises InputError for any other text."""
    name, equals, span = text.partition("=")
    known, expected = AXES.get(name), f"one of {', '.join(AXES)}, or KEY=EASY:HARD"
    if not equals:
        if known is None:
            remedy = did_you_mean(name, AXES, "choose one of them")
            raise InputError(place="--vary", got=repr(text), expected=expected, remedy=remedy)
        return known
    ends = [float(part) for part in span.split(":") if NUMBER.fullmatch(part)]
    if len(ends) != 2 or span.count(":") != 1 or ends[0] == ends[1]:
        raise InputError(place="--vary", got=repr(text), expected=expected, remedy="write detection=1:0.5")
    if known is None:
        return Axis(name, ends[0], ends[1], _key(name), whole="." not in span)
    return replace(known, easy=ends[0], hard=ends[1])
