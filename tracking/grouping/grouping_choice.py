"""Which grouping makes the groups of tracked people: the belief (the default) or the baseline rule, with parameters.

`grouping_of` reads what a user names: "rule", "belief", or a TOML file of either. `group_finder` applies it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np

from scenarios.loading.toml_files import parse
from sim.types import Ints
from tracking.grouping.belief import KIND, Belief, default_belief
from tracking.grouping.belief_groups import BeliefGroups, FoundGroups
from tracking.grouping.link_rule import LinkRule, RuleLinks
from tracking.grouping.motion_history import PeopleRows

Grouping = LinkRule | Belief


def default_grouping() -> Grouping:
    """Returns the grouping of trackers that report people only: the belief of belief.toml."""
    return default_belief()


def grouping_of(source: str | Path) -> Grouping:
    """Returns the grouping "rule" or "belief" with its default parameters, or that of a TOML file."""
    if str(source) == "rule":
        return LinkRule()
    if str(source) == KIND:
        return default_belief()
    return Belief.from_toml(source) if "grouping" in parse(Path(source)) else LinkRule.from_toml(source)


class GroupFinder(Protocol):
    """Finds the groups of people, frame by frame."""

    def add(self, rows: PeopleRows, column: Ints, end: int) -> FoundGroups:
        """Adds the frames up to `end`, and returns the groups in them. column (R,): the person of each row, from 0."""

    def take_people(self, rows: Ints) -> None:
        """Renumbers the people, who keep their order: person k becomes who was person rows[k], or somebody new if
        rows[k] is -1."""

    def forget(self, before: int) -> None:
        """Forgets the pairs of people who were last near each other before a frame."""


def group_finder(grouping: Grouping, fps: float) -> GroupFinder:
    """Returns the finder of groups by the rule or the belief."""
    return BeliefGroups(fps, grouping) if isinstance(grouping, Belief) else RuleGroups(fps, grouping)


class RuleGroups:
    """Finds groups by the baseline rule. State: links."""

    def __init__(self, fps: float, rule: LinkRule) -> None:
        self.links = RuleLinks(fps, rule)

    def add(self, rows: PeopleRows, column: Ints, end: int) -> FoundGroups:
        """Adds frames, as `GroupFinder.add`."""
        there = np.isfinite(rows.pos).all(axis=1)
        known = rows.frame[there], column[there], rows.pos[there], rows.vel[there]
        return FoundGroups(self.links.add(*known, end))

    def take_people(self, rows: Ints) -> None:
        """Renumbers the people, as `GroupFinder.take_people`."""
        self.links.take_people(rows)

    def forget(self, before: int) -> None:
        """Does nothing: the rule does not look back for long."""
