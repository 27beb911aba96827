"""Which grouping makes the groups of tracked people: the belief (the default) or the baseline rule, with parameters.

`grouping_of` reads what a user names: "rule", "belief", or a TOML file of either. `find_groups` applies it.
"""

from __future__ import annotations

from pathlib import Path

from scenarios.loading.toml_files import parse
from tracking.grouping.belief import KIND, Belief, default_belief
from tracking.grouping.belief_groups import FoundGroups, belief_groups
from tracking.grouping.link_rule import LinkRule, find_links
from tracking.grouping.tracks_table import TracksTable

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


def find_groups(table: TracksTable, fps: float, grouping: Grouping) -> FoundGroups:
    """Returns the groups of the people of a table, by the rule or the belief."""
    if isinstance(grouping, Belief):
        return belief_groups(table.frame, table.column, table.pos, table.length, fps, grouping, table.seen)
    return FoundGroups(find_links(table.frame, table.column, table.pos, table.vel, table.length, fps, grouping))
