"""The keys of the groups of a scenario file, as frozen pydantic models; see scenarios.schema.scenario."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from scenarios.limits import PEOPLE
from scenarios.schema.colours import Colours
from scenarios.schema.values import Distribution, Model, Name, Point, Value, bounds, problem, within

FASTEST = 10.0  # m/s: as fast as a sprinter
Speed = Annotated[Value, within(0.05, FASTEST, " m/s")]
Seconds = Annotated[Value, within(0.0, 3600.0, " s")]  # of standing or being served
Height = Annotated[Value, within(0.3, 3.0, " m")]
AtGoal = Literal["stand", "leave", "walk"]
GROUP_SIZE = Distribution(poisson=1.1, clip=(1, 12))


class Stop(Model):
    """A place on the way where a group stands for a while.

    Attributes:
        at: place, m; a group stands at the free place nearest to it
        stay: time for which people stand there, s; 0 without `until` leaves the stop out
        until: times, s from the first recorded frame: people wait until the first of them after their arrival, then for
            `stay`; after the last they wait to the end
        members: number of members who stop, rounded, while the others walk on; absent: all
    """

    at: Point
    stay: Seconds = 0.0
    until: tuple[float, ...] = ()
    members: Annotated[Value, within(-0.5, PEOPLE, " people")] | None = None


def _somebody(size: Value) -> Value:
    low = bounds(size)[0]
    if low < 0.5:
        got = f"a size that can be {'any number' if math.isinf(low) else f'{low:g}'}"
        raise problem(got, "at least 1 person", "raise it, or add clip = [1, 6]")
    return size


class SubGroupSpec(Model):
    """A small group within a group, such as a pair of a class; a person alone, such as the teacher, is one of one.

    Attributes:
        id: name in the group; the whole name is group.id, and repeat = n makes the sub-groups group.id-1 … group.id-n
        size: as for groups
        formation: as for groups
        height: as for groups; absent: that of the group
        clothes: as for groups; absent: those of the group
        trousers: likewise
        repeat: number of such sub-groups, one behind the other; each is drawn independently
    """

    id: Name
    size: Annotated[Value, AfterValidator(_somebody), within(0.5, PEOPLE, " people")] = GROUP_SIZE
    formation: Literal["rows", "none"] = "rows"
    height: Height | None = None
    clothes: Colours | None = None
    trousers: Colours | None = None
    repeat: Annotated[int, Field(ge=1, le=5000)] = 1


class GroupSpec(Model):
    """A group of people who belong together from the start; a person alone is a group of one.

    Attributes:
        id: name in the script; repeat = n makes the groups id-1 … id-n
        size: number of people; rounded, at least 1; follows from `groups` where these are given
        start: middle of the group when it enters, m
        goal: point to which the group walks, m
        stops: places to stop at, in order, before `via`
        via: points to pass on the way
        scatter: distance of each member from its place in the group when the group enters, m; drawn for each member, in
            any direction
        formation: rows = a place for each: pairs abreast, triads in a V, larger groups in rows of them; none = a flock:
            no places, each member keeps to the neighbours
        speed: speed of the whole group, m/s; absent: follows from its members' speeds
        height: body height of each member, m; absent: crowd.height
        clothes: colour of the upper garment, or several, one of which is drawn for each member; absent: any
        trousers: colour of the trousers, likewise
        enter: time of entry, s; 0 = present from the first frame; negative = during the warm-up
        at_goal: at the goal: stand = stay in conversation, leave = leave the scene, walk = walk straight on
        repeat: number of such groups; each is drawn independently
        groups: sub-groups of which the group consists, that at the front first; they walk behind each other
    """

    id: Name
    size: Annotated[Value, AfterValidator(_somebody), within(0.5, PEOPLE, " people")] = GROUP_SIZE
    start: Point
    goal: Point
    stops: tuple[Stop, ...] = ()
    via: tuple[Point, ...] = ()
    scatter: Annotated[Value, within(0.0, 10.0, " m")] = 0.0
    formation: Literal["rows", "none"] = "rows"
    speed: Speed | None = None
    height: Height | None = None
    clothes: Colours | None = None
    trousers: Colours | None = None
    enter: Value = 0.0
    at_goal: AtGoal = "stand"
    repeat: Annotated[int, Field(ge=1, le=5000)] = 1
    groups: tuple[SubGroupSpec, ...] = ()

    @model_validator(mode="after")
    def _sub_groups_alone(self) -> Self:
        members = any(stop.members is not None for stop in self.stops)
        given = {"size": self.size != GROUP_SIZE, "formation": self.formation != "rows", "stops.members": members}
        if self.groups and any(given.values()):
            got = f"{next(key for key, beside in given.items() if beside)} beside groups"
            raise problem(got, "sub-groups with sizes and formations of their own, all of whom stop", "remove it")
        return self

    def size_bounds(self) -> tuple[float, float]:
        """Returns the least and the greatest number of people of one such group."""
        low, high = zip(*(bounds(part.size) for part in parts_of(self)), strict=True)
        return float(sum(max(1.0, float(round(x))) for x in low)), float(sum(high))


def group_names(group: GroupSpec | SubGroupSpec) -> list[str]:
    """Returns the names of the groups that an entry of `group` makes: its id, or id-1 … id-n."""
    return [group.id] if group.repeat == 1 else [f"{group.id}-{k + 1}" for k in range(group.repeat)]


def parts_of(group: GroupSpec) -> list[GroupSpec | SubGroupSpec]:
    """Returns the sub-groups of a group, front first, each as often as it is repeated; without any the group itself."""
    return [part for part in group.groups for _ in range(part.repeat)] or [group]


def part_names(group: GroupSpec) -> list[str]:
    """Returns the names of a group's sub-groups within it, in the order of `parts_of`; [] without any."""
    return [name for part in group.groups for name in group_names(part)]
