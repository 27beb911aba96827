"""The keys of a scenario file, as frozen pydantic models; a class with a namesake in `sim` ends in Spec. SI; degrees.

Where a value may be a number or a distribution (scenarios.schema.values), it is drawn once for each seed.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator
from pydantic.json_schema import SkipJsonSchema

from scenarios.limits import FRAME_RATES, PICTURE_SIZES, fits_picture
from scenarios.schema.camera_motion import CameraMotion
from scenarios.schema.groups import FASTEST, AtGoal, GroupSpec, Height, Seconds, Speed
from scenarios.schema.looks import LooksSpec
from scenarios.schema.pictures import Light, Picture
from scenarios.schema.sensor import Sensor

# isort: off
# fmt: off
from scenarios.schema.values import (
    Distribution, FixedPoint, Model, Name, Pattern, Point, Positive, Side, Value, problem,
    within,
)
# fmt: on
# isort: on
from scenarios.schema.world import WorldSpec

Noise = Annotated[float, within(0.0, 1.0, " m/s")]
Stray = Annotated[float, within(0.0, 2.0, " m")]
Factor = Annotated[float, within(0.0, 10.0)]
FREE_SPEED = Distribution(normal=(1.34, 0.26), clip=(0.5, 2.2))
SPACING = Distribution(normal=(0.75, 0.12), clip=(0.5, 1.2))
HEIGHT = Distribution(normal=(1.70, 0.09), clip=(1.50, 1.95))
SWAY = Distribution(normal=(0.024, 0.007), clip=(0.0, 0.05))


def _picture(size: tuple[int, int]) -> tuple[int, int]:
    if not fits_picture(*size):
        raise problem("{}×{} px".format(*size), PICTURE_SIZES, "make the image smaller")
    return size


class CameraSpec(Model):
    """Place, direction and lens of the camera; size and rate of its images.

    Attributes:
        kind: perspective, or orthographic from above
        image: width and height of an image, px
        fps: frames per second
        focal_px: focal length, px (pinhole)
        baseline: distance from the left to the right camera, m (pinhole)
        tilt_deg: angle by which the camera looks down; 90 = straight down
        yaw_deg: 0 looks along +y, positive turns left; absent: the direction, out of eight, in which people look
            largest (0 from above, or if height or position is given)
        px_per_m: scale, px per m (kind top); absent: chosen so that all people are in view
        height: height above the ground, m; absent: chosen so that all people are in view
        position: x, y of the camera, m; absent: chosen so that all people are in view
        crop: true accepts people who walk out of view; false makes that an error (of a moving camera: at its rest)
        motion: how the camera moves while it records (kind pinhole); absent: it stands still
    """

    kind: Literal["pinhole", "top"] = "pinhole"
    image: Annotated[tuple[Side, Side], AfterValidator(_picture)] = (640, 480)
    fps: Annotated[float, within(*FRAME_RATES, " frames/s")] = 10.0
    focal_px: Positive = 500.0
    baseline: Annotated[float, within(0.0, 100.0, " m")] = 0.12
    tilt_deg: Annotated[float, Field(ge=-30, le=90)] = 40.0
    yaw_deg: float | None = None
    px_per_m: Positive | None = None
    height: Positive | None = None
    position: FixedPoint | None = None
    crop: bool = False
    motion: CameraMotion | None = None


class CrowdSpec(Model):
    """How people walk; the defaults are measured values (docs/results/simulation.md).

    Attributes:
        free_speed: walking speed of a person alone, m/s
        spacing: distance between neighbours in a group, m
        height: body height, m
        slowdown_per_member: a group of n people is slower by this times (n - 1), m/s
        sway: amplitude of the sideways movement with each stride at 1.34 m/s, m; 0 = none
        velocity_noise: standard deviations of the wanted velocity along and across it, m/s; 0 = steady
        place_noise: standard deviations of a member's place in a walking group, forward and sideways, m
        separation: factor on the force that keeps members of a group apart; 0 = none
        alignment: factor on the force by which they take up each other's velocity
        cohesion: factor on the force that holds them together
    """

    free_speed: Speed = FREE_SPEED
    spacing: Annotated[Value, within(0.1, 10.0, " m")] = SPACING
    height: Height = HEIGHT
    slowdown_per_member: Annotated[float, within(0.0, FASTEST, " m/s")] = 0.05
    sway: Annotated[Value, within(0.0, 0.2, " m")] = SWAY
    velocity_noise: tuple[Noise, Noise] = (0.08, 0.13)
    place_noise: tuple[Stray, Stray] = (0.15, 0.05)
    separation: Factor = 1.0
    alignment: Factor = 1.0
    cohesion: Factor = 1.0


class Reach(Model):
    """A trigger: the mean place of the group's people comes near a place.

    Attributes:
        group: name of the group
        at: the place, m; absent: the group's goal
        radius: distance between the group's middle and the place, m
    """

    group: Name
    at: FixedPoint | None = None
    radius: Positive = 1.0


class When(Model):
    """An order fires `delay` s after its trigger, exactly one of the other fields, was first met.

    Attributes:
        time: the order fires at this time, s
        distance_lt: the order fires when the nearest members of each two of its groups are closer than this, m
        after: the order fires when the rule of the order with this id has come true
        delay: time between the trigger and the firing, s
    """

    time: Value | None = None
    reach: Reach | None = None
    distance_lt: Positive | None = None
    after: Name | None = None
    delay: Value = 0.0

    @model_validator(mode="after")
    def _one_trigger(self) -> Self:
        given = [name for name in ("time", "reach", "distance_lt", "after") if getattr(self, name) is not None]
        if len(given) != 1:
            raise problem(f"{given}", "exactly one of time, reach, distance_lt, after", "keep one")
        return self


class SplitPart(Model):
    """One part of a group that splits; of parts without size, the first ones get one more person if needed.

    Attributes:
        id: name of the new group
        size: number of people; absent: an equal share of those left over
        goal: point to which the part walks, m
        via: points to pass on the way
        at_goal: as for groups
    """

    id: Name
    size: Annotated[int, Field(ge=1)] | None = None
    goal: Point
    via: tuple[Point, ...] = ()
    at_goal: AtGoal = "stand"


def _kind_of_goal(goal: object) -> str | None:
    return "meet" if goal == "meet" else "point" if isinstance(goal, tuple | list) else None


Goal = Annotated[
    Annotated[Point, Tag("point")] | Annotated[Literal["meet"], Tag("meet")],
    Discriminator(_kind_of_goal, custom_error_type="no_goal", custom_error_message="a point [x, y], or 'meet'"),
]


class MergeOrder(Model):
    """An order: several groups become one.

    Attributes:
        id: name of the order
        type: several groups become one
        groups: names of the groups that become one
        into: name of the new group
        goal: point to which the new group walks, m; "meet": it stands in conversation where the groups meet
        via: points to pass on the way
        at_goal: as for groups
    """

    id: Name
    type: Literal["merge"]
    groups: Annotated[tuple[Name, ...], Field(min_length=2)]
    into: Name
    goal: Goal = "meet"
    via: tuple[Point, ...] = ()
    at_goal: AtGoal = "stand"
    when: When


class SplitOrder(Model):
    """An order: a group divides into two or more parts, each a new group with a goal of its own.

    Attributes:
        id: name of the order
        type: a group divides into parts
        group: name of the group that divides
    """

    id: Name
    type: Literal["split"]
    group: Name
    parts: Annotated[tuple[SplitPart, ...], Field(min_length=2)]
    when: When


class QueueOrder(Model):
    """An order: groups line up, are served one group after the other or at several counters, and walk on.

    Attributes:
        id: name of the order
        type: groups line up and are served one by one
        groups: names of the groups that line up; `g-*` stands for all groups whose name begins with `g-`
        at: place of the first person in the queue, m
        counters: service points, m: whoever is first in the queue walks to the nearest free one and is served there;
            absent: people are served at the head of the queue
        direction_deg: direction from the head to the tail of the queue; 0 = +x, 90 = +y
        spacing: distance between neighbours in the queue, m
        service: time for which each group is served, s
        goal: point to which groups walk after service, m; absent: their own goal
        at_goal: as for groups
    """

    id: Name
    type: Literal["queue"]
    groups: Annotated[tuple[Pattern, ...], Field(min_length=1)]
    at: FixedPoint
    counters: Annotated[tuple[FixedPoint, ...], Field(min_length=1)] | None = None
    direction_deg: float = 0.0
    spacing: Annotated[float, Field(ge=0.5, le=1.4)] = 0.8
    service: Seconds = Distribution(exponential=3.0)
    goal: Point | None = None
    at_goal: AtGoal = "leave"
    when: When


ScriptOrder = Annotated[MergeOrder | SplitOrder | QueueOrder, Field(discriminator="type")]


class Scenario(Model):
    """A whole scenario with all defaults, `extends` applied, as stored.

    Attributes:
        schema_: version of the file format
        name: name of the sequences made from it; absent: the file's name
        about: one line: what happens, and whose claim it tests
        duration: recorded time, s
        warmup: unrecorded time before the first frame, s
        turn_deg: angle by which the script, but not the world, is turned about the middle of the world
        lead: time by which all walking groups start further on along their way (negative: further back), s; one draw
            for all
        mirror: true: with probability 0.5 the script is mirrored left to right
        draw: named numbers that are drawn once for each seed, for the links of several keys; each is a distribution
    """

    schema_: Literal[1] = Field(alias="schema")
    name: Name = "scenario"
    about: str = ""
    duration: Annotated[float, Field(gt=0, le=3600)] = 20.0
    warmup: Annotated[float, Field(ge=0, le=60)] = 2.0
    turn_deg: Value = 0.0
    lead: Value = 0.0
    mirror: bool = False
    world: WorldSpec = WorldSpec()
    camera: CameraSpec = CameraSpec()
    sensor: Sensor = Sensor()
    light: Light = Light()
    picture: Picture = Picture()
    crowd: CrowdSpec = CrowdSpec()
    group: Annotated[tuple[GroupSpec, ...], Field(min_length=1)]
    event: tuple[ScriptOrder, ...] = ()
    looks: LooksSpec | None = None
    draw: dict[Name, Distribution] | None = None
    # Not a key of files: the distributions and links in places of fixed values, by key.
    draws: SkipJsonSchema[dict[str, dict[str, Any]] | None] = None


def expand(pattern: str, names: list[str]) -> list[str]:
    """Returns for a pattern `g-*` those of `names` that begin with `g-`; for any other pattern the pattern itself."""
    return [n for n in names if n.startswith(pattern[:-1])] if pattern.endswith("*") else [pattern]


class ObservationSpec(Model):
    """Camera, sensor, light, picture and looks, with the keys that they have in a scenario; for `flockscope replay`."""

    schema_: Literal[1] = Field(1, alias="schema")
    camera: CameraSpec = CameraSpec()
    sensor: Sensor = Sensor()
    light: Light = Light()
    picture: Picture = Picture()
    looks: LooksSpec | None = None
