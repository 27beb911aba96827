"""The keys of a scenario file, as frozen pydantic models. SI units; angles in degrees.

`flockscope scenarios --schema` and docs/reference/scenario-files.md print the descriptions of the fields. A class whose
subject has another class in `sim` ends in Spec. Where a value may be a number or a distribution
(scenarios.schema.values), it is drawn once for each seed. `flockscope replay` reads a file of the tables camera,
sensor, light and picture alone (ObservationSpec).
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from scenarios.limits import FRAME_RATES, PEOPLE, PICTURE_SIZES, fits_picture
from scenarios.schema.sensor import Sensor
from scenarios.schema.values import (
    Distribution,
    FixedPoint,
    Model,
    Name,
    NonNegative,
    Pattern,
    Point,
    Positive,
    Share,
    Side,
    Value,
    bounds,
    problem,
    within,
)

Pixels = Annotated[float, within(0.0, 100.0, " px")]


class LightSwitch(Model):
    """A sudden change of brightness, as of a lamp or a cloud; those of several switches multiply."""

    at: Value = Field(description="time of the change, s")
    gain: Annotated[Value, within(1e-3, 1000.0)] = Field(description="factor of the brightness from then on; above 0")
    ramp: NonNegative = Field(0.2, description="duration of the change, s")


class Light(Model):
    """The light on the scene; it changes pictures only."""

    sun_azimuth_deg: Value = Field(
        Distribution(uniform=(-180, 180)), description="direction from which the light comes; 0 = from +x, 90 = from +y"
    )
    sun_elevation_deg: Value = Field(Distribution(uniform=(35, 60)), description="angle of the sun above the ground")
    shadow: Share = Field(
        0.3, description="share of the brightness that the ground loses in a cast shadow; 0 = no shadows"
    )
    penumbra: Annotated[float, within(0.0, 100.0, " m")] = Field(0.05, description="width of a shadow's soft edge, m")
    drift: NonNegative = Field(0.0, description="standard deviation of slow changes of brightness, relative")
    drift_time: Positive = Field(20.0, description="time constant of slow changes, s")
    flicker: NonNegative = Field(
        0.0, description="standard deviation of changes of brightness from frame to frame, relative"
    )
    cloud: Annotated[Value, within(0.0, 10.0)] = Field(
        0.0, description="standard deviation of the brightness of soft patches that move over the ground, relative"
    )
    cloud_size: Positive = Field(8.0, description="size of the patches: distance at which their correlation is 0.6, m")
    cloud_speed: Annotated[float, within(0.0, 1000.0, " m/s")] = Field(1.0, description="speed of the patches, m/s")
    switch: tuple[LightSwitch, ...] = Field((), description="sudden changes of brightness")


class Picture(Model):
    """Texture, noise, blur and artefacts; they change pictures only.

    The noise at grey level x has the variance noise² (1 - shot + shot x / 128). True disparities are those of a pair
    without the errors right_….
    """

    texture: Share = Field(0.5, description="contrast of the patterns on ground and walls")
    samples: Annotated[int, Field(ge=1, le=4)] = Field(
        1, description="rays along each axis of a pixel of the empty scene, averaged; with more, patterns are finer"
    )
    noise: Annotated[float, within(0.0, 255.0, " grey levels")] = Field(
        3.0,
        description="standard deviation of the noise of each pixel and colour channel at grey level 128, grey levels",
    )
    shot: Share = Field(0.5, description="share of that noise's variance that is proportional to the brightness")
    blur_px: Pixels = Field(0.6, description="standard deviation of the blur, px")
    jpeg: Annotated[int, Field(ge=0, le=100)] = Field(
        0, description="quality of JPEG compression, which adds artefacts; 0 = no compression"
    )
    foliage: Annotated[Value, within(0.0, 1.0)] = Field(
        0.0, description="share of the image that is covered by plants moving in the wind; on the ground only"
    )
    sway_px: Pixels = Field(1.5, description="standard deviation of the plants' movement along each axis, px")
    sway_time: Positive = Field(0.4, description="time after which the correlation of that movement is 0.6, s")
    right_gain: Annotated[float, within(1e-3, 1000.0)] = Field(
        1.0, description="factor of the right picture's brightness, which is not calibrated"
    )
    right_roll_deg: Annotated[float, within(-10.0, 10.0, " degrees")] = Field(
        0.0, description="angle by which the right picture's content is turned clockwise, which is not calibrated"
    )
    right_down_px: Annotated[float, within(-100.0, 100.0, " px")] = Field(
        0.0, description="distance by which the right picture's content lies too low, px, which is not calibrated"
    )


FASTEST = 10.0  # m/s: as fast as a sprinter
Speed = Annotated[Value, within(0.05, FASTEST, " m/s")]
Seconds = Annotated[Value, within(0.0, 3600.0, " s")]  # of standing or being served
Noise = Annotated[float, within(0.0, 1.0, " m/s")]
Stray = Annotated[float, within(0.0, 2.0, " m")]
Length = Annotated[float, within(0.1, 10_000.0, " m")]
AtGoal = Literal["stand", "leave", "walk"]


class DoorSpec(Model):
    """A door: an opening in a wall."""

    at: FixedPoint = Field(description="middle of the opening, m; must lie on a wall")
    width: Positive = Field(1.2, description="m")


class StairsSpec(Model):
    """A flight of stairs; its height rises from 0 at `foot` to `rise` at `head`."""

    foot: FixedPoint = Field(description="middle of the lowest edge, m")
    head: FixedPoint = Field(description="middle of the highest edge, m")
    width: Positive = Field(3.0, description="width across, m")
    rise: float = Field(1.5, description="height of the head above the foot, m")
    steps: Annotated[int, Field(ge=1)] = Field(10, description="number of steps")
    landing: NonNegative = Field(4.0, description="length of the level ground behind the head, m")
    slowdown: Annotated[float, Field(gt=0, le=1)] = Field(
        0.6, description="share of the walking speed kept on the stairs"
    )


class WorldSpec(Model):
    """The immobile parts of the scene; by default an empty world."""

    size: tuple[Length, Length] = Field((16.0, 10.0), description="extent in x and y, m")
    walls: tuple[tuple[float, float, float, float], ...] = Field(
        (), description="each wall: x1, y1, x2, y2 of its ends, m"
    )
    pillars: tuple[tuple[float, float, Positive], ...] = Field(
        (), description="each pillar: x, y of its middle and radius, m"
    )
    stairs: tuple[StairsSpec, ...] = Field((), description="flights of stairs")
    doors: tuple[DoorSpec, ...] = Field((), description="openings in walls")
    service: tuple[FixedPoint, ...] = Field((), description="service points (counters), m")
    wall_height: Positive = Field(2.5, description="height of the walls, m")
    pillar_height: Positive = Field(2.5, description="height of the pillars, m")


FREE_SPEED = Distribution(normal=(1.34, 0.26), clip=(0.5, 2.2))
GROUP_SIZE = Distribution(poisson=1.1, clip=(1, 12))
SPACING = Distribution(normal=(0.75, 0.12), clip=(0.5, 1.2))
HEIGHT = Distribution(normal=(1.70, 0.09), clip=(1.50, 1.95))
SWAY = Distribution(normal=(0.024, 0.007), clip=(0.0, 0.05))


def _picture(size: tuple[int, int]) -> tuple[int, int]:
    if not fits_picture(*size):
        raise problem("{}×{} px".format(*size), PICTURE_SIZES, "make the image smaller")
    return size


class CameraSpec(Model):
    """Place, direction and lens of the camera; size and rate of its images."""

    kind: Literal["pinhole", "top"] = Field("pinhole", description="perspective, or orthographic from above")
    image: Annotated[tuple[Side, Side], AfterValidator(_picture)] = Field(
        (640, 480), description="width and height of an image, px"
    )
    fps: Annotated[float, within(*FRAME_RATES, " frames/s")] = Field(10.0, description="frames per second")
    focal_px: Positive = Field(500.0, description="focal length, px (pinhole)")
    baseline: Annotated[float, within(0.0, 100.0, " m")] = Field(
        0.12, description="distance from the left to the right camera, m (pinhole)"
    )
    tilt_deg: Annotated[float, Field(ge=-30, le=90)] = Field(
        40.0, description="angle by which the camera looks down; 90 = straight down"
    )
    yaw_deg: float | None = Field(
        None,
        description="0 looks along +y, positive turns left; absent: the direction, out of eight, in which people look "
        "largest (0 from above, or if height or position is given)",
    )
    px_per_m: Positive | None = Field(
        None, description="scale, px per m (kind top); absent: chosen so that all people are in view"
    )
    height: Positive | None = Field(
        None, description="height above the ground, m; absent: chosen so that all people are in view"
    )
    position: FixedPoint | None = Field(
        None, description="x, y of the camera, m; absent: chosen so that all people are in view"
    )
    crop: bool = Field(False, description="true accepts people who walk out of view; false makes that an error")


class CrowdSpec(Model):
    """How people walk; the defaults are measured values (docs/results/simulation.md)."""

    free_speed: Speed = Field(FREE_SPEED, description="walking speed of a person alone, m/s")
    spacing: Annotated[Value, within(0.1, 10.0, " m")] = Field(
        SPACING, description="distance between neighbours in a group, m"
    )
    height: Annotated[Value, within(0.3, 3.0, " m")] = Field(HEIGHT, description="body height, m")
    slowdown_per_member: Annotated[float, within(0.0, FASTEST, " m/s")] = Field(
        0.05, description="a group of n people is slower by this times (n - 1), m/s"
    )
    sway: Annotated[Value, within(0.0, 0.2, " m")] = Field(
        SWAY, description="amplitude of the sideways movement with each stride at 1.34 m/s, m; 0 = none"
    )
    velocity_noise: tuple[Noise, Noise] = Field(
        (0.08, 0.13), description="standard deviations of the wanted velocity along and across it, m/s; 0 = steady"
    )
    place_noise: tuple[Stray, Stray] = Field(
        (0.15, 0.05), description="standard deviations of a member's place in a walking group, forward and sideways, m"
    )


class Stop(Model):
    """A place on the way where a group stands for a while."""

    at: Point = Field(description="place, m; a group stands at the free place nearest to it")
    stay: Seconds = Field(
        0.0, description="time for which people stand there, s; 0 without `until` leaves the stop out"
    )
    until: tuple[float, ...] = Field(
        (),
        description="times, s from the first recorded frame: people wait until the first of them after their arrival, "
        "then for `stay`; after the last they wait to the end",
    )
    members: Annotated[Value, within(-0.5, PEOPLE, " people")] | None = Field(
        None, description="number of members who stop, rounded, while the others walk on; absent: all"
    )


def _somebody(size: Value) -> Value:
    low = bounds(size)[0]
    if low < 0.5:
        got = f"a size that can be {'any number' if math.isinf(low) else f'{low:g}'}"
        raise problem(got, "at least 1 person", "raise it, or add clip = [1, 6]")
    return size


class GroupSpec(Model):
    """A group of people who belong together from the start; a person alone is a group of one."""

    id: Name = Field(description="name in the script; repeat = n makes the groups id-1 … id-n")
    size: Annotated[Value, AfterValidator(_somebody), within(0.5, PEOPLE, " people")] = Field(
        GROUP_SIZE, description="number of people; rounded, at least 1"
    )
    start: Point = Field(description="middle of the group when it enters, m")
    goal: Point = Field(description="point to which the group walks, m")
    stops: tuple[Stop, ...] = Field((), description="places to stop at, in order, before `via`")
    via: tuple[Point, ...] = Field((), description="points to pass on the way")
    scatter: Annotated[Value, within(0.0, 10.0, " m")] = Field(
        0.0,
        description="distance of each member from its place in the group when the group enters, m; drawn for each "
        "member, in any direction",
    )
    speed: Speed | None = Field(
        None, description="speed of the whole group, m/s; absent: follows from its members' speeds"
    )
    enter: Value = Field(
        0.0, description="time of entry, s; 0 = present from the first frame; negative = during the warm-up"
    )
    at_goal: AtGoal = Field(
        "stand",
        description="at the goal: stand = stay in conversation, leave = leave the scene, walk = walk straight on",
    )
    repeat: Annotated[int, Field(ge=1, le=5000)] = Field(
        1, description="number of such groups; each is drawn independently"
    )


class Reach(Model):
    """A trigger: the mean place of the group's people comes near a place."""

    group: Name = Field(description="name of the group")
    at: FixedPoint | None = Field(None, description="the place, m; absent: the group's goal")
    radius: Positive = Field(1.0, description="distance between the group's middle and the place, m")


class When(Model):
    """An order fires `delay` s after its trigger, exactly one of the other fields, was first met."""

    time: Value | None = Field(None, description="the order fires at this time, s")
    reach: Reach | None = None
    distance_lt: Positive | None = Field(
        None, description="the order fires when the nearest members of each two of its groups are closer than this, m"
    )
    after: Name | None = Field(
        None, description="the order fires when the rule of the order with this id has come true"
    )
    delay: Value = Field(0.0, description="time between the trigger and the firing, s")

    @model_validator(mode="after")
    def _one_trigger(self) -> Self:
        given = [name for name in ("time", "reach", "distance_lt", "after") if getattr(self, name) is not None]
        if len(given) != 1:
            raise problem(f"{given}", "exactly one of time, reach, distance_lt, after", "keep one")
        return self


class SplitPart(Model):
    """One part of a group that splits; the first parts without size get one more of a rest."""

    id: Name = Field(description="name of the new group")
    size: Annotated[int, Field(ge=1)] | None = Field(
        None, description="number of people; absent: an equal share of those left over"
    )
    goal: Point = Field(description="point to which the part walks, m")
    via: tuple[Point, ...] = Field((), description="points to pass on the way")
    at_goal: AtGoal = Field("stand", description="as for groups")


Goal = Annotated[
    Annotated[Point, Tag("point")] | Annotated[Literal["meet"], Tag("word")],
    Discriminator(lambda goal: "word" if isinstance(goal, str) else "point"),
]


class MergeOrder(Model):
    """An order: several groups become one."""

    id: Name = Field(description="name of the order")
    type: Literal["merge"] = Field(description="several groups become one")
    groups: Annotated[tuple[Name, ...], Field(min_length=2)] = Field(description="names of the groups that become one")
    into: Name = Field(description="name of the new group")
    goal: Goal = Field(
        "meet",
        description='point to which the new group walks, m; "meet": it stands in conversation where the groups meet',
    )
    via: tuple[Point, ...] = Field((), description="points to pass on the way")
    at_goal: AtGoal = Field("stand", description="as for groups")
    when: When


class SplitOrder(Model):
    """An order: a group divides into two or more parts, each a new group with a goal of its own."""

    id: Name = Field(description="name of the order")
    type: Literal["split"] = Field(description="a group divides into parts")
    group: Name = Field(description="name of the group that divides")
    parts: Annotated[tuple[SplitPart, ...], Field(min_length=2)]
    when: When


class QueueOrder(Model):
    """An order: groups line up, are served one group after the other, and walk on."""

    id: Name = Field(description="name of the order")
    type: Literal["queue"] = Field(description="groups line up and are served one by one")
    groups: Annotated[tuple[Pattern, ...], Field(min_length=1)] = Field(
        description="names of the groups that line up; `g-*` stands for all groups whose name begins with `g-`"
    )
    at: FixedPoint = Field(description="place of the first person in the queue, m")
    direction_deg: float = Field(0.0, description="direction from the head to the tail of the queue; 0 = +x, 90 = +y")
    spacing: Annotated[float, Field(ge=0.5, le=1.4)] = Field(
        0.8, description="distance between neighbours in the queue, m"
    )
    service: Seconds = Field(Distribution(exponential=3.0), description="time for which each group is served, s")
    goal: Point | None = Field(None, description="point to which groups walk after service, m; absent: their own goal")
    at_goal: AtGoal = Field("leave", description="as for groups")
    when: When


ScriptOrder = Annotated[MergeOrder | SplitOrder | QueueOrder, Field(discriminator="type")]


class Scenario(Model):
    """A whole scenario with all defaults, `extends` applied, as stored."""

    schema_: Literal[1] = Field(alias="schema", description="version of the file format")
    name: Name = Field("scenario", description="name of the sequences made from it; absent: the file's name")
    about: str = Field("", description="one line: what happens, and whose claim it tests")
    duration: Annotated[float, Field(gt=0, le=3600)] = Field(20.0, description="recorded time, s")
    warmup: Annotated[float, Field(ge=0, le=60)] = Field(2.0, description="unrecorded time before the first frame, s")
    turn_deg: Value = Field(
        0.0, description="angle by which the script, but not the world, is turned about the middle of the world"
    )
    lead: Value = Field(
        0.0,
        description="time by which all walking groups start further on along their way (negative: further "
        "back), s; one draw for all",
    )
    mirror: bool = Field(False, description="true: with probability 0.5 the script is mirrored left to right")
    world: WorldSpec = WorldSpec()
    camera: CameraSpec = CameraSpec()
    sensor: Sensor = Sensor()
    light: Light = Light()
    picture: Picture = Picture()
    crowd: CrowdSpec = CrowdSpec()
    group: Annotated[tuple[GroupSpec, ...], Field(min_length=1)]
    event: tuple[ScriptOrder, ...] = ()


def group_names(group: GroupSpec) -> list[str]:
    """Returns the names of the groups that an entry of `group` makes: its id, or id-1 … id-n."""
    return [group.id] if group.repeat == 1 else [f"{group.id}-{k + 1}" for k in range(group.repeat)]


def expand(pattern: str, names: list[str]) -> list[str]:
    """Returns the names that a pattern means: for `g-*` those that begin with `g-`, else the pattern itself."""
    return [n for n in names if n.startswith(pattern[:-1])] if pattern.endswith("*") else [pattern]


class ObservationSpec(Model):
    """Camera, sensor, light and picture, with the keys that they have in a scenario."""

    schema_: Literal[1] = Field(1, alias="schema")
    camera: CameraSpec = CameraSpec()
    sensor: Sensor = Sensor()
    light: Light = Light()
    picture: Picture = Picture()


class ReplayOrigin(Model):
    """The recording whose motion a replay shows.

    - kind, name: format ("biwi", "mot", …) and name of the recording. real: it shows real people, so nothing may be
      tuned on it.
    - people: the recording's ids of persons 1, 2, … of the replay, in this order.
    - start, duration: the part that is replayed, s. shift: positions in the replay minus those in the recording, x, y,
      m.
    - smoothing: movements of the labels that are quicker than this are removed as jitter, s; 0: none.
    - motion: SHA-256 of the recording's labelled positions, ids and groups.
    """

    kind: str
    name: str
    real: bool
    people: tuple[int, ...]
    start: NonNegative
    duration: Positive
    smoothing: NonNegative
    shift: tuple[float, float]
    motion: str


class ReplaySpec(ObservationSpec):
    """A replay with all defaults filled in, as stored in its scenario.toml."""

    name: str
    replay: ReplayOrigin
