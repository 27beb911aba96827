"""Which grouping makes the groups of tracked people: the belief (the default) or the baseline rule, with parameters.

`grouping_of` reads what a user names: "rule", "belief", or a TOML file of either.

Also here: consistent groups from beliefs of pairs, by average linkage with a memory, and the links these groups stand
for.

In each step the two groups (or people) with the highest mean log-odds over their pairs are joined, as long as it is
above 0. So a chain of strangers is no group, and a group whose ends are far apart is one.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenarios.loading.toml_files import parse
from sim.truth.merge_split_rules import frames_of, runs, stretches
from sim.types import Array, Bools, Ints
from tracking.grouping.belief import KIND, UNSEEN, Belief, default_belief, pair_beliefs
from tracking.grouping.link_rule import LinkRule, Links, find_links
from tracking.grouping.pair_evidence import frames_per_step, step_positions
from tracking.grouping.tracks_table import TracksTable


def groups_of_steps(
    step: Ints, a: Ints, b: Ints, log_odds: Array, unseen: float, stay: float = 0.0, come: float = 0.0
) -> tuple[Ints, Ints, Ints]:
    """Returns step, person and group (N,) of all people in groups, sorted by group; people alone are left out.

    step, a, b, log_odds (R,): one row per pair and step, step ascending. stay, come: added for pairs that were in one
    group in the step before, taken from all others.
    """
    from tracking.grouping.belief_kernels import linked_groups

    people = int(max(a.max(initial=0), b.max(initial=0))) + 1
    steps = int(step.max(initial=-1)) + 1
    label = np.full((steps, people), -1, np.int64)
    linked_groups(np.searchsorted(step, np.arange(steps + 1)), a, b, log_odds, unseen, stay, come, label)
    when, person = np.nonzero(label >= 0)
    group = when * people + label[when, person]
    order = np.argsort(group, kind="stable")
    return when[order], person[order], group[order]


def belief_links(frame: Ints, column: Ints, pos: Array, length: int, fps: float, belief: Belief) -> Links:
    """Returns all switches of links in a sequence of `length` frames: any two members of a group are linked."""
    size = frames_per_step(fps)
    people = int(column.max(initial=0)) + 1
    places, times = step_positions(frame, column, pos, length, people, fps)
    found, steps = pair_beliefs(places, times, size / fps, belief), len(places)
    seen = np.isfinite(places[..., 0])
    pair = found.a * people + found.b
    order = np.lexsort((found.step, pair))
    row, at = _remembered(pair[order], found.step[order], seen, frames_of(belief.memory, fps / size))
    row = np.concatenate([np.arange(len(pair)), order[row]])
    step = np.concatenate([found.step, at])
    order = np.argsort(step, kind="stable")
    row, step = row[order], step[order]
    t, person, group = groups_of_steps(
        step, found.a[row], found.b[row], found.log_odds[row], UNSEEN, belief.stay, belief.come
    )
    i, j = runs(np.arange(len(group)) + 1, np.searchsorted(group, group, side="right"))
    low, high = np.minimum(person[i], person[j]), np.maximum(person[i], person[j])
    both, when = low * people + high, t[i]
    order = np.lexsort((when, both))
    both, first, last = stretches(both[order], when[order], 1)
    ends = last + 1 < steps
    t, both = np.concatenate([first, last[ends] + 1]), np.concatenate([both, both[ends]])
    on = np.arange(len(t)) < len(first)
    order = np.lexsort((both, t))
    t, both, on = t[order], both[order], on[order]
    return Links(t * size, both // people, both % people, on)


def _remembered(pair: Ints, step: Ints, seen: Bools, memory: int) -> tuple[Ints, Ints]:
    """Returns (row, step) of rows that stand for steps in which one of a pair was missed; seen (S, P)."""
    steps, people = seen.shape
    last = np.concatenate([np.diff(pair) != 0, [True]])[: len(pair)]
    following = np.where(last, steps, np.append(step[1:], steps)[: len(step)])
    row, at = runs(step + 1, np.minimum(following, step + memory + 1))
    missed = ~(seen[at, pair[row] // people] & seen[at, pair[row] % people])
    return row[missed], at[missed]


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


def links_of(table: TracksTable, fps: float, grouping: Grouping) -> Links:
    """Returns all switches of links between the people of a table, by the rule or the belief."""
    if isinstance(grouping, Belief):
        return belief_links(table.frame, table.column, table.pos, table.length, fps, grouping)
    return find_links(table.frame, table.column, table.pos, table.vel, table.length, fps, grouping)
