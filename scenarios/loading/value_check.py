"""Checks the values of a scenario before it is simulated: speeds, heights, sizes, rates, and how much it all is.

A value that is a distribution must lie in its range in at least 999 of 1000 draws.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from scenarios.limits import CELLS, DETECTIONS, FRAME_RATES, FRAMES, PEOPLE, PICTURE_SIZES, fits_picture
from scenarios.loading.script_check import fail
from scenarios.schema.observation import ObservationSpec
from scenarios.schema.scenario import QueueOrder, Scenario
from scenarios.schema.values import Distribution, Value, share_within

SURE = 0.999
"""Least probability that a value lies in its range."""
FASTEST = 10.0
"""m/s: as fast as a sprinter."""
TALLEST = 3.0
"""m."""


class _Range(NamedTuple):
    """A value at the key `place` of a scenario, and the least and greatest number allowed there, both included.

    unit: a text for messages, with a blank in front (" m"), "" for none."""

    place: str
    value: Value
    low: float
    high: float
    unit: str


def check_values(scenario: Scenario) -> None:
    """Raises InputError, without a file, for the first value that is out of its range; returns nothing.

    Also for a scenario of more than 1,000,000 recorded frames, 5000 people in all entries of `group` together, or
    20,000,000 frames times people. A size that is a distribution counts as `_most` says.
    """
    _require(_crowd(scenario))
    check_observation(scenario)
    frames = scenario.duration * scenario.camera.fps
    if frames > FRAMES:
        expected = f"at most {FRAMES:,}"
        fail("duration", f"{frames:,.0f} frames", expected, "shorten it, or lower camera.fps")
    people = most_people(scenario)
    if people > PEOPLE:
        fail("group", f"up to {people:,.0f} people", f"at most {PEOPLE:,}", "make groups smaller or fewer")
    if people * frames > CELLS:
        got = f"{frames:,.0f} frames with up to {people:,.0f} people"
        fail("duration", got, f"at most {CELLS:,} frames times people", "shorten it, or take fewer people")


def most_people(scenario: Scenario) -> float:
    """Returns how many people there can be, by the sizes that 999 of 1000 draws do not exceed."""
    return sum(group.repeat * _most(group.size) for group in scenario.group)


def check_observation(spec: Scenario | ObservationSpec) -> None:
    """Raises InputError, without a file, for the first value of camera, sensor, light or picture out of its range."""
    _require(_observation(spec))
    if not fits_picture(*spec.camera.image):
        fail("camera.image", "{}×{} px".format(*spec.camera.image), PICTURE_SIZES, "make the image smaller")


def _require(ranges: Iterator[_Range]) -> None:
    for place, value, low, high, unit in ranges:
        share = share_within(value, low, high)
        if share < SURE:
            drawn = isinstance(value, Distribution)
            got = f"a distribution with {share:.1%} of its draws in this range" if drawn else f"{value:g}{unit}"
            remedy = f"correct it, or add clip = [{low:g}, {high:g}]" if drawn else "correct it"
            fail(place, got, f"from {low:g} to {high:g}{unit}", remedy)


def _crowd(scenario: Scenario) -> Iterator[_Range]:
    crowd = scenario.crowd
    yield _Range("crowd.free_speed", crowd.free_speed, 0.05, FASTEST, " m/s")
    yield _Range("crowd.spacing", crowd.spacing, 0.1, 10.0, " m")
    yield _Range("crowd.height", crowd.height, 0.3, TALLEST, " m")
    yield _Range("crowd.slowdown_per_member", crowd.slowdown_per_member, 0.0, FASTEST, " m/s")
    yield _Range("crowd.sway", crowd.sway, 0.0, 0.2, " m")
    for k in range(2):
        yield _Range(f"crowd.velocity_noise.{k}", crowd.velocity_noise[k], 0.0, 1.0, " m/s")
        yield _Range(f"crowd.place_noise.{k}", crowd.place_noise[k], 0.0, 2.0, " m")
    for axis, size in zip("xy", scenario.world.size, strict=True):
        yield _Range(f"world.size.{'xy'.index(axis)}", size, 0.1, 10_000.0, " m")
    for group in scenario.group:
        yield _Range(f"group.{group.id}.size", group.size, 0.5, PEOPLE, " people")
        yield _Range(f"group.{group.id}.scatter", group.scatter, 0.0, 10.0, " m")
        for k, stop in enumerate(group.stops):
            yield _Range(f"group.{group.id}.stops.{k}.stay", stop.stay, 0.0, 3600.0, " s")
            if stop.members is not None:
                yield _Range(f"group.{group.id}.stops.{k}.members", stop.members, -0.5, PEOPLE, " people")
        if group.speed is not None:
            yield _Range(f"group.{group.id}.speed", group.speed, 0.05, FASTEST, " m/s")
    for order in scenario.event:
        if isinstance(order, QueueOrder):
            yield _Range(f"event.{order.id}.service", order.service, 0.0, 3600.0, " s")


def _observation(spec: Scenario | ObservationSpec) -> Iterator[_Range]:
    camera, sensor, light, picture = spec.camera, spec.sensor, spec.light, spec.picture
    yield _Range("camera.fps", camera.fps, *FRAME_RATES, " frames/s")
    yield _Range("camera.baseline", camera.baseline, 0.0, 100.0, " m")
    yield _Range("sensor.clutter_rate", sensor.clutter_rate, 0.0, DETECTIONS / 5, " false alarms per frame")
    yield _Range("sensor.box_noise.floor_px", sensor.box_noise.floor_px, 0.0, 1000.0, " px")
    yield _Range("sensor.box_noise.scale", sensor.box_noise.scale, 0.0, 20.0, "")
    yield _Range("sensor.noise_m", sensor.noise_m, 0.0, 1000.0, " m")
    yield _Range("light.penumbra", light.penumbra, 0.0, 100.0, " m")
    yield _Range("light.cloud", light.cloud, 0.0, 10.0, "")
    yield _Range("light.cloud_speed", light.cloud_speed, 0.0, 1000.0, " m/s")
    for k, switch in enumerate(light.switch):
        yield _Range(f"light.switch.{k}.gain", switch.gain, 1e-3, 1000.0, "")
    yield _Range("picture.noise", picture.noise, 0.0, 255.0, " grey levels")
    yield _Range("picture.blur_px", picture.blur_px, 0.0, 100.0, " px")
    yield _Range("picture.foliage", picture.foliage, 0.0, 1.0, "")
    yield _Range("picture.sway_px", picture.sway_px, 0.0, 100.0, " px")
    yield _Range("picture.right_gain", picture.right_gain, 1e-3, 1000.0, "")
    yield _Range("picture.right_roll_deg", picture.right_roll_deg, -10.0, 10.0, " degrees")
    yield _Range("picture.right_down_px", picture.right_down_px, -100.0, 100.0, " px")


def _most(size: Value) -> float:
    """Returns the number of people of a group that 999 of 1000 draws of its size do not exceed, rounded up to a power
    of 2 for a distribution.
    """
    if not isinstance(size, Distribution):
        return max(1.0, float(round(size)))
    most = 1
    while size.share_within(-math.inf, most) < SURE:
        most *= 2
    return most
