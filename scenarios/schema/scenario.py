"""The strict form of a scenario file: frozen pydantic models, SI units, degrees.

Field descriptions are the documentation: `flockscope scenarios --schema` and docs/scenarios.md print them.
A value may be a number or a distribution (scenarios.schema.values); all are drawn once per seed.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenarios.schema.sensor import Hide as Hide
from scenarios.schema.sensor import Sensor as Sensor
from scenarios.schema.values import (
    Distribution,
    Fixed,
    Model,
    Name,
    NonNegative,
    Pattern,
    Point,
    Positive,
    Share,
    Value,
)

FREE_SPEED = Distribution(normal=(1.34, 0.26), clip=(0.5, 2.2))
GROUP_SIZE = Distribution(poisson=1.1, clip=(1, 12))
SPACING = Distribution(normal=(0.75, 0.12), clip=(0.5, 1.2))


class DoorSpec(Model):
    """An opening in a wall."""

    at: Fixed = Field(description="middle of the opening, m; must lie on a wall")
    width: Positive = Field(1.2, description="m")


class StairsSpec(Model):
    """A flight of stairs: z rises from the line `foot` to `head`."""

    foot: Fixed = Field(description="middle of the lowest edge, m")
    head: Fixed = Field(description="middle of the highest edge, m")
    width: Positive = Field(3.0, description="m across")
    rise: float = Field(1.5, description="height of the head above the foot, m")
    steps: Annotated[int, Field(ge=1)] = Field(10, description="number of steps, drawn and felt")
    landing: NonNegative = Field(4.0, description="plateau behind the head, m")
    slowdown: Annotated[float, Field(gt=0, le=1)] = Field(
        0.6, description="share of the walking speed kept on the stairs"
    )


class WorldSpec(Model):
    """What stands still."""

    size: tuple[Positive, Positive] = Field((16.0, 10.0), description="extent in x and y, m")
    walls: tuple[tuple[float, float, float, float], ...] = Field((), description="segments x1, y1, x2, y2, m")
    pillars: tuple[tuple[float, float, Positive], ...] = Field((), description="x, y, radius, m")
    stairs: tuple[StairsSpec, ...] = Field((), description="flights of stairs")
    doors: tuple[DoorSpec, ...] = Field((), description="openings in walls")
    service: tuple[Fixed, ...] = Field((), description="service points (counters), m")
    wall_height: Positive = Field(2.5, description="m")
    pillar_height: Positive = Field(2.5, description="m")


class CameraSpec(Model):
    """Where the camera stands and what it delivers."""

    kind: Literal["pinhole", "top"] = Field("pinhole", description="perspective, or orthographic from above")
    image: tuple[Annotated[int, Field(ge=16, le=8192)], Annotated[int, Field(ge=16, le=8192)]] = Field(
        (640, 480), description="width, height, px"
    )
    fps: Positive = Field(10.0, description="frames per second")
    focal_px: Positive = Field(500.0, description="focal length, px (pinhole)")
    baseline: NonNegative = Field(0.12, description="distance of the right camera, m (pinhole)")
    tilt_deg: Annotated[float, Field(ge=-30, le=90)] = Field(40.0, description="looks down by this; 90 = straight down")
    yaw_deg: float = Field(0.0, description="0 looks along +y, positive turns left")
    px_per_m: Positive | None = Field(None, description="scale of kind top; solved where absent")
    height: Positive | None = Field(None, description="height above the ground, m; solved where absent")
    position: Fixed | None = Field(None, description="x, y, m; solved where absent")
    crop: bool = Field(False, description="accept people who walk out of view")


class LightSwitch(Model):
    """The light changes at once: a lamp, a cloud."""

    at: Value = Field(description="when, s")
    gain: Value = Field(description="brightness from then on, times what it was; above 0")
    ramp: NonNegative = Field(0.2, description="how long the change takes, s")


class Light(Model):
    """What falls on the scene, for pictures only."""

    sun_azimuth_deg: Value = Field(
        Distribution(uniform=(-180, 180)), description="where the light comes from; 0 = from +x, 90 = from +y"
    )
    sun_elevation_deg: Value = Field(Distribution(uniform=(35, 60)), description="height of the sun above the ground")
    shadow: Share = Field(0.3, description="how much darker the ground is in a cast shadow; 0 = no shadows")
    penumbra: NonNegative = Field(0.05, description="width of a shadow's soft edge, m")
    drift: NonNegative = Field(0.0, description="sd of slow changes of brightness, relative")
    drift_time: Positive = Field(20.0, description="time constant of slow changes, s")
    flicker: NonNegative = Field(0.0, description="sd of changes from frame to frame, relative")
    cloud: Value = Field(0.0, description="sd of soft patches of brightness that pass over the ground, relative")
    cloud_size: Positive = Field(8.0, description="size of these patches (correlation 0.6 so far apart), m")
    cloud_speed: NonNegative = Field(1.0, description="how fast they pass, m/s")
    switch: tuple[LightSwitch, ...] = Field((), description="sudden changes")


class Picture(Model):
    """What the camera makes of it, for pictures only."""

    texture: Share = Field(0.5, description="contrast of the patterns on ground and walls")
    noise: NonNegative = Field(
        3.0, description="sd of the noise of each pixel and colour at grey level 128, grey levels"
    )
    shot: Share = Field(0.5, description="share of the noise's variance there that is in proportion to brightness")
    blur_px: NonNegative = Field(0.6, description="sd of the blur, px")
    jpeg: Annotated[int, Field(ge=0, le=100)] = Field(0, description="quality of lossy artefacts; 0 = none")
    foliage: Value = Field(0.0, description="share of the image that plants cover, which wind moves; ground only")
    sway_px: NonNegative = Field(1.5, description="sd of the plants' sway along each axis, px")
    sway_time: Positive = Field(0.4, description="how long the sway stays alike (correlation 0.6), s")


class CrowdSpec(Model):
    """How people walk; defaults are the measured ones (docs/realism.md)."""

    free_speed: Value = Field(FREE_SPEED, description="walking speed of someone alone, m/s")
    spacing: Value = Field(SPACING, description="distance of neighbours in a group, m")
    height: Value = Field(Distribution(normal=(1.70, 0.09), clip=(1.50, 1.95)), description="body height, m")
    slowdown_per_member: NonNegative = Field(0.05, description="a group of n is slower by this times (n - 1), m/s")


class GroupSpec(Model):
    """People who belong together from the start."""

    id: Name = Field(description="name in the script; repeat = n makes id-1 … id-n")
    size: Value = Field(GROUP_SIZE, description="people; rounded")
    start: Point = Field(description="middle of the group at the first frame or at `enter`, m")
    goal: Point = Field(description="where to, m")
    via: tuple[Point, ...] = Field((), description="points to pass on the way")
    speed: Value | None = Field(None, description="speed of the whole group, m/s; from its members where absent")
    enter: Value = Field(0.0, description="s; 0 = present from the first frame")
    at_goal: Literal["stand", "leave", "walk"] = Field(
        "stand", description="stand: stay and converse; leave: out of the scene; walk: straight on"
    )
    repeat: Annotated[int, Field(ge=1, le=5000)] = Field(1, description="so many groups, each drawn anew")


class Reach(Model):
    """A trigger: a group comes near a place."""

    group: Name = Field(description="whose middle comes near")
    at: Fixed | None = Field(None, description="m; the group's goal where absent")
    radius: Positive = Field(1.0, description="m, from the group's middle")


class When(Model):
    """When an order fires: exactly one of time, reach, distance_lt, after; delay adds to any of them."""

    time: Value | None = Field(None, description="s")
    reach: Reach | None = None
    distance_lt: Positive | None = Field(
        None, description="nearest members of the groups concerned closer than this, m"
    )
    after: Name | None = Field(None, description="id of an order: when its rule has come true")
    delay: Value = Field(0.0, description="s more")

    @model_validator(mode="after")
    def _one_trigger(self) -> Self:
        given = [name for name in ("time", "reach", "distance_lt", "after") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"`when` has exactly one of time, reach, distance_lt, after, not {given}")
        return self


class SplitPart(Model):
    """One part of a group that splits."""

    id: Name = Field(description="name of the new group")
    size: Annotated[int, Field(ge=1)] | None = Field(None, description="people; the rest, shared evenly, where absent")
    goal: Point = Field(description="m")
    via: tuple[Point, ...] = Field((), description="points to pass on the way")
    at_goal: Literal["stand", "leave", "walk"] = Field("stand", description="as for groups")


class MergeOrder(Model):
    """Groups become one."""

    id: Name = Field(description="name of the order")
    type: Literal["merge"] = Field(description="groups become one")
    groups: Annotated[tuple[Name, ...], Field(min_length=2)] = Field(description="who become one")
    into: Name = Field(description="name of the new group")
    goal: Point | Literal["meet"] = Field("meet", description='m; "meet": where they meet, to stand and converse')
    via: tuple[Point, ...] = Field((), description="points to pass on the way")
    at_goal: Literal["stand", "leave", "walk"] = Field("stand", description="as for groups")
    when: When


class SplitOrder(Model):
    """A group falls into parts."""

    id: Name = Field(description="name of the order")
    type: Literal["split"] = Field(description="a group falls into parts")
    group: Name = Field(description="which group parts")
    parts: Annotated[tuple[SplitPart, ...], Field(min_length=2)]
    when: When


class QueueOrder(Model):
    """Groups line up, are served one group after the other, and walk on."""

    id: Name = Field(description="name of the order")
    type: Literal["queue"] = Field(description="groups line up and are served one by one")
    groups: Annotated[tuple[Pattern, ...], Field(min_length=1)] = Field(
        description="who lines up; `g-*` for all of a repeat"
    )
    at: Fixed = Field(description="the head's place, m")
    direction_deg: float = Field(0.0, description="from the head to the tail; 0 = +x, 90 = +y")
    spacing: Annotated[float, Field(ge=0.5, le=1.4)] = Field(0.8, description="m")
    service: Value = Field(Distribution(exponential=3.0), description="s per group")
    goal: Point | None = Field(None, description="where the served walk to; their own goal where absent")
    at_goal: Literal["stand", "leave", "walk"] = Field("leave", description="as for groups")
    when: When


ScriptOrder = Annotated[MergeOrder | SplitOrder | QueueOrder, Field(discriminator="type")]


class Scenario(Model):
    """A whole scenario. `extends` is resolved by scenarios.loading.resolve; what is stored is always the resolved
    form.
    """

    schema_: Literal[1] = Field(alias="schema", description="version of this form")
    name: Name = Field("scenario", description="name of sequences made from it; the file's name where absent")
    about: str = Field("", description="one line: the phenomenon, and whose claim it tests")
    duration: Annotated[float, Field(gt=0, le=3600)] = Field(20.0, description="recorded time, s")
    warmup: Annotated[float, Field(ge=0, le=60)] = Field(2.0, description="unrecorded time before the first frame, s")
    turn_deg: Value = Field(0.0, description="turns the whole script (not walls) about the world's middle")
    lead: Value = Field(
        0.0, description="s; how much further on their way all who walk start (negative: back), one draw for all"
    )
    mirror: bool = Field(False, description="a coin decides whether the script is mirrored left to right")
    world: WorldSpec = WorldSpec()
    camera: CameraSpec = CameraSpec()
    sensor: Sensor = Sensor()
    light: Light = Light()
    picture: Picture = Picture()
    crowd: CrowdSpec = CrowdSpec()
    group: Annotated[tuple[GroupSpec, ...], Field(min_length=1)]
    event: tuple[ScriptOrder, ...] = ()


def group_names(group: GroupSpec) -> list[str]:
    """The names a `repeat` makes: id, or id-1 … id-n."""
    return [group.id] if group.repeat == 1 else [f"{group.id}-{k + 1}" for k in range(group.repeat)]


def expand(pattern: str, names: list[str]) -> list[str]:
    """`g-*` as all names that begin with `g-`; any other name as itself."""
    return [n for n in names if n.startswith(pattern[:-1])] if pattern.endswith("*") else [pattern]
