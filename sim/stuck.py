"""People of a simulated crowd who do not get on: groups that never arrive, and people who stand still on the way."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class NeverArrives:
    """A group of a simulated crowd that does not reach its goal, as in gt/never_arrives.json. group: its name in the
    script. people: ids of its members. pos, goal: their mean place at the end, and the point that they do not reach, x,
    y in m. no_way: True if walls and pillars leave a body no way; False if the group stood in the last 10 s. obstacle:
    in words, what is in the straight way."""

    group: str
    people: tuple[int, ...]
    pos: tuple[float, float]
    goal: tuple[float, float]
    no_way: bool
    obstacle: str

    @property
    def words(self) -> str:
        """The finding in one line."""
        ways = {True: "a body of 0.4 m has no way", False: "it stood to the end on the way"}
        places = f"from {list(self.pos)} to its goal {list(self.goal)}"
        return f"group {self.group} never arrives: {ways[self.no_way]} {places}; in the way: {self.obstacle}"


@dataclass(frozen=True, slots=True)
class Immobile:
    """A person of a simulated crowd who stood still for 10 s or more on the way, without an order to wait. person: id.
    start, end: s after the first recorded frame. pos: the place at the start, x, y in m."""

    person: int
    start: float
    end: float
    pos: tuple[float, float]

    @property
    def words(self) -> str:
        """The finding in one line."""
        at = f"from {self.start:.1f} s at {list(self.pos)}"
        return f"person {self.person} stood still for {self.end - self.start:.1f} s on the way, {at}"
