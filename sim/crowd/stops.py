"""Draws the stops of groups: places on the way where a group, or some of its members, stand for a while."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scenarios.schema.scenario import Stop
from scenarios.schema.values import Point
from sim.rng import draw
from sim.types import Array


@dataclass(frozen=True)
class PlannedStop:
    """One stop of one group, drawn."""

    at: Array  # (2,) place in the world, m
    stay: float  # s
    until: tuple[float, ...]  # times, s after the first recorded frame, ascending; may be empty
    members: tuple[int, ...]  # numbers of the members who stop, from 0, ascending; at least one
    whole: bool  # True if all members stop

    def end(self, t: float) -> float:
        """Returns when people who arrive at time t walk on, s; inf if never."""
        return next((u for u in self.until if u >= t), np.inf) + self.stay if self.until else t + self.stay


def draw_stops(
    stops: tuple[Stop, ...], size: int, place: Callable[[Point], Array], r: np.random.Generator
) -> list[PlannedStop]:
    """Returns the stops of a group of `size` people; place: gives a point of the script in the world."""
    planned = []
    for stop in stops:
        at, stay = place(stop.at), max(0.0, draw(stop.stay, r))
        wanted = size if stop.members is None else min(round(draw(stop.members, r)), size)
        if wanted > 0 and (stay > 0 or stop.until):
            who = range(size) if wanted == size else sorted(r.permutation(size)[:wanted].tolist())
            planned.append(PlannedStop(at, stay, tuple(sorted(stop.until)), tuple(who), wanted == size))
    return planned
