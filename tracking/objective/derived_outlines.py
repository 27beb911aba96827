"""Outlines of the groups that the default grouping derives from tracked people: shapes only, without ids and events.

The groups are those of `tracking.grouping.grouped_tracks.derive`, in the same frames and with the same members. Links
come from `links_of`; connected components and footprint hulls are compiled.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.geometry.footprints import FOOTPRINT
from sim.truth.merge_split_rules import frames_of
from sim.types import Array, Bools, Ints, Tracks
from tracking.grouping.grouped_tracks import names_groups
from tracking.grouping.grouping_choice import default_grouping, links_of
from tracking.grouping.tracks_table import TracksTable, boxes_of_rows, tabulate
from tracking.objective.hull_overlaps import GroupOutlines
from tracking.scoring.rows import FrameRows

FROM_LEFT = np.roll(FOOTPRINT, -int(FOOTPRINT[:, 0].argmin()), axis=0)
"""The footprint polygon (16, 2) in m, from its leftmost vertex on."""


def derived_outlines(tracks: Sequence[Tracks], fps: float, px_per_m: float, labelled: Bools) -> GroupOutlines:
    """Returns the hulls of groups of two or more people in the frames f where labelled[f] is true, sorted by frame.

    tracks: of one tracker, of people, without `groups`, sorted by frame, with boxes in all frames or in none; none
    raises IndexError. If the tracker names groups (`names_groups`), its group ids define the groups, else the default
    grouping does. Hulls are drawn round boxes if the tracks are in the image and have boxes, else round footprints
    (16-gons on a circle of 0.25 m). Unit: m on the
    ground, px in the image. fps: frames per second. px_per_m: px per m, used only in the image. labelled (length + 1,):
    bool by frame number from 1, index 0 unused. A centre is the mean position of the group's people in the frame. Group
    ids of the result are only row numbers. Without groups it has no rows.

    Raises InputError if the tracks are in the image and px_per_m is not a finite number above 0.
    """
    table = tabulate(tracks, fps, px_per_m, default_grouping().smooth)
    order, first = _grouped_rows(table, _group_of_rows(table, fps, names_groups(tracks)), labelled)
    pos = table.pos[order] * table.scale
    ends = np.append(first[1:], len(order)) if len(first) else first
    centre = np.add.reduceat(pos, first) / np.diff(first, append=len(order))[:, None] if len(first) else pos[:0]
    box = boxes_of_rows(tracks)[order]
    boxed = len(box) > 0 and np.isfinite(box[0, 0])
    vertex, ends = _box_hulls(box, ends) if boxed else flat_footprint_hulls(pos, ends, table.scale)
    rows = FrameRows(table.frame[order][first] + 1, np.arange(len(first)))
    return GroupOutlines.measured(rows, centre, vertex, ends)


def _group_of_rows(table: TracksTable, fps: float, named: bool) -> Ints:
    """Returns a label for each of the R table rows (tracks in frames), (R,): equal for members of one group in a frame,
    -1 alone.

    If the tracker names groups (`named`), its ids are returned, else the components that the default grouping links:
    the label is the least column of the group, and a group of which one member is seen has -1. fps: frames per
    second.
    """
    from tracking.objective import derived_outlines_kernels as kernels

    if named:
        return table.group
    rule = default_grouping()
    links = links_of(table, fps, rule)
    label: Ints = kernels.connected_people(
        table.frame, table.column, table.length, len(table.ids), frames_of(rule.memory, fps),
        links.frame, links.a, links.b, links.on,
    )  # fmt: skip
    return label


def _grouped_rows(table: TracksTable, group: Ints, labelled: Bools) -> tuple[Ints, Ints]:
    """Returns the indices of the table rows (tracks in frames) in groups of two or more, group after group, (M,), and
    the index in this list at which each of the G groups begins, (G,).

    group (R,): label of each table row, -1 alone. labelled: bool by frame number from 1, to the last at least; groups
    in other frames are left out. Groups are sorted by frame, then label. Both results are empty without groups.
    """
    order = np.lexsort((group, table.frame))
    order = order[(group[order] >= 0) & labelled[table.frame[order] + 1]]
    frame, label = table.frame[order], group[order]
    new = np.diff(frame, prepend=-1).astype(bool) | np.diff(label, prepend=-1).astype(bool)
    number = np.cumsum(new) - 1
    several = np.bincount(number)[number] > 1 if len(order) else np.zeros(0, bool)
    return order[several], np.flatnonzero(new[several])


def flat_convex_hulls(points: Array, ends: Ints) -> tuple[Array, Ints]:
    """Returns the convex hulls of G point sets: all vertices (V, 2), and the index in them at which each hull ends,
    (G,).

    points (N, 2): the sets one after the other; ends (G,): index at which each set ends (exclusive). Each hull is
    counter-clockwise from its leftmost point, the lowest of several. An empty set, or one with a nan, has a hull
    without vertices. A set of one point repeated gives that point twice.
    """
    from sim.geometry.hull_kernels import monotone_chains

    begins = np.concatenate([np.zeros(1, np.int64), ends])
    owner = np.repeat(np.arange(len(ends)), np.diff(begins))
    hulls: tuple[Array, Ints] = monotone_chains(points[np.lexsort((points[:, 1], points[:, 0], owner))], begins)
    return hulls


def flat_footprint_hulls(pos: Array, ends: Ints, scale: float) -> tuple[Array, Ints]:
    """Returns the convex hulls of the footprints of G groups of people: all vertices (V, 2), and where each hull ends,
    (G,).

    pos (M, 2): people's x, y, not nan, group after group; ends (G,): index at which each group, not empty, ends
    (exclusive). scale: units of pos per metre. A footprint is a polygon of 16 vertices on a circle of 0.25 m round the
    position. Hulls are counter-clockwise and may repeat vertices.
    """
    from tracking.objective import derived_outlines_kernels as kernels

    hulls: tuple[Array, Ints] = kernels.minkowski_sums(*flat_convex_hulls(pos, ends), FROM_LEFT * scale)
    return hulls


def _box_hulls(box: Array, ends: Ints) -> tuple[Array, Ints]:
    """Returns the convex hulls of the corners of G groups of boxes: all vertices (V, 2), and where each hull ends,
    (G,).

    box (M, 4): left, top, width, height in px, group after group; ends (G,): index at which each group ends
    (exclusive). A group with a nan box has a hull without vertices.
    """
    left, top, wide, high = box.T
    corners = np.stack([left, top, left + wide, top, left + wide, top + high, left, top + high], 1).reshape(-1, 2)
    return flat_convex_hulls(corners, 4 * ends)
