"""Members of the groups that the default grouping derives from tracked people, without shapes, ids and events.

The groups are those of `tracking.grouping.grouped_tracks.derive`, in the same frames and with the same members. Links
come from `links_of`; connected components are compiled.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.truth.merge_split_rules import frames_of
from sim.types import Bools, Ints, Tracks
from tracking.grouping.grouped_tracks import names_groups
from tracking.grouping.grouping_choice import default_grouping, links_of
from tracking.grouping.tracks_table import TracksTable, tabulate
from tracking.scoring.rows import FrameRows


def derived_members(tracks: Sequence[Tracks], fps: float, px_per_m: float, labelled: Bools) -> tuple[FrameRows, Ints]:
    """Returns frame and id of the K members of groups of two or more in labelled frames, and their group (K,), from 0.

    Both are sorted by group, groups by frame. labelled (length + 1,): bool by frame number.
    """
    table = tabulate(tracks, fps, px_per_m, default_grouping().smooth)
    group = _group_of_rows(table, fps, names_groups(tracks))
    order = np.lexsort((group, table.frame))
    order = order[(group[order] >= 0) & labelled[table.frame[order] + 1]]
    frame, label = table.frame[order], group[order]
    new = np.diff(frame, prepend=-1).astype(bool) | np.diff(label, prepend=-1).astype(bool)
    number = np.cumsum(new) - 1
    several = np.bincount(number, minlength=1)[number] > 1
    order, new = order[several], new[several]
    return FrameRows(table.frame[order] + 1, table.id[order]), np.cumsum(new) - 1


def _group_of_rows(table: TracksTable, fps: float, named: bool) -> Ints:
    """Returns a label for each of the R table rows, equal for members of one group in a frame, -1 alone."""
    from tracking.objective.derived_members_kernels import connected_people

    if named:
        return table.group
    rule = default_grouping()
    links = links_of(table, fps, rule)
    label: Ints = connected_people(
        table.frame, table.column, table.length, len(table.ids), frames_of(rule.memory, fps),
        links.frame, links.a, links.b, links.on,
    )  # fmt: skip
    return label
