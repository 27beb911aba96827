"""Axes of difficulty: a name, the keys of a scenario that it sets, and the range from easy to hard.

AXES has the named ones; any other key of a scenario that takes a number is an axis, too (`sensor.detect_prob=1:0.5`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from scenarios.errors import InputError
from scenarios.limits import is_number
from scenarios.loading.toml_files import closest

Settings = Callable[[float], list[str]]


@dataclass(frozen=True)
class Axis:
    """One axis of difficulty."""

    name: str
    easy: float
    hard: float
    settings: Settings  # value: the settings of a scenario, as for --set
    whole: bool = False  # values are whole numbers
    about: str = ""

    def between(self, a: float, b: float) -> float | None:
        """Returns the value in the middle of two values, None if there is none."""
        middle = round((a + b) / 2) if self.whole else (a + b) / 2
        return None if middle in (a, b) else middle

    def spread(self, count: int) -> list[float]:
        """Returns evenly spread values, the easy one first, without repeats."""
        every = [self.easy + (self.hard - self.easy) * k / (count - 1) for k in range(count)]
        return list(dict.fromkeys(float(round(v)) if self.whole else v for v in every))


def _key(*keys: str) -> Settings:
    return lambda value: [f"{key}={value:.10g}" for key in keys]


def _noise(value: float) -> list[str]:
    return [f"sensor.noise_m={0.05 * value:.10g}", f"sensor.box_noise.scale={value:.10g}"]


def _speeds(value: float) -> list[str]:
    return [f"crowd.free_speed={{ normal = [1.34, {value:.10g}], clip = [0.3, 2.6] }}"]


AXES = {
    axis.name: axis
    for axis in (
        Axis("detection", 1.0, 0.4, _key("sensor.detect_prob"), about="probability that a person is detected"),
        Axis("clutter", 0.0, 6.0, _key("sensor.clutter_rate"), about="false alarms per frame"),
        Axis("noise", 0.0, 5.0, _noise, about="errors of points and boxes; 1: the default ones"),
        Axis("occlusion", 0.0, 0.8, _key("sensor.min_visibility"), about="visible share below which people are missed"),
        Axis("people", 1, 30, _key("group.passers.repeat"), whole=True, about="groups of strangers who walk about"),
        Axis("gap", 0.6, 1.6, _key("crowd.spacing"), about="m between neighbours in a group"),
        Axis("velocity-difference", 0.0, 0.6, _speeds, about="m/s, standard deviation of people's speeds"),
        Axis("frame-rate", 25.0, 1.0, _key("camera.fps"), about="frames per second"),
        Axis("camera-height", 15.0, 3.0, _key("camera.height"), about="m"),
        Axis("tilt", 80.0, 15.0, _key("camera.tilt_deg"), about="degrees by which the camera looks down"),
        Axis("light", 0.0, 0.3, _key("light.drift"), about="relative changes of brightness, of pictures"),
        Axis("contrast", 0.0, 20.0, _key("picture.noise"), about="noise of pictures, grey levels"),
    )
}  # fmt: skip


def parse_axis(text: str) -> Axis:
    """Returns the axis of a text NAME, NAME=EASY:HARD or KEY=EASY:HARD."""
    name, equals, span = text.partition("=")
    ends = [_number(part) for part in span.split(":")] if equals else []
    known = AXES.get(name)
    if (equals and (len(ends) != 2 or None in ends or ends[0] == ends[1])) or (not equals and known is None):
        near = f"did you mean {closest(name, [*AXES])}?" if known is None and not equals else "write detection=1:0.5"
        raise InputError(
            place="--vary", got=repr(text), expected=f"one of {', '.join(AXES)}, or KEY=EASY:HARD", remedy=near
        )  # fmt: skip
    easy, hard = (known.easy, known.hard) if known is not None and not equals else (ends[0] or 0.0, ends[1] or 0.0)
    if known is None:
        whole = easy == int(easy) and hard == int(hard) and "." not in span
        return Axis(name, easy, hard, _key(name), whole)
    return Axis(name, easy, hard, known.settings, known.whole, known.about)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if is_number(value, -1e9, 1e9) else None
