"""Whether the velocities that a tracker reports are good enough for the grouping rule.

The rule links people whose velocities differ by less than `alike` (0.5 m/s) most of the time. Differences of positions
from frame to frame, or zeros, make no such pair, or too many.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sim.io.formats.velocity import WINDOW, chords
from sim.types import Tracks
from tracking.grouping.grouping_choice import Grouping, default_grouping
from tracking.grouping.link_rule import LinkRule
from tracking.grouping.tracks_table import tabulate

LEAST_ROWS = 50
"""Fewer velocities tell nothing."""
MUCH = 1.5
"""Times `alike` from which on velocities are reported as unusable; those of our trackers reach 0.9 at most."""


def velocity_error(tracks: Sequence[Tracks], fps: float, px_per_m: float, rule: LinkRule) -> float:
    """Returns by how much two people of equal motion differ in their reported velocities, m/s; nan if unknown."""
    table = tabulate(tracks, fps, px_per_m, rule.smooth)
    chord = chords(table.frame, table.id, table.pos, fps)
    apart = np.hypot(*(table.vel - chord).T)
    apart = apart[np.isfinite(apart)]
    return float(np.sqrt(2) * np.quantile(apart, rule.share)) if len(apart) >= LEAST_ROWS else float("nan")


def velocity_warning(
    name: str, tracks: Sequence[Tracks], fps: float, px_per_m: float, rule: Grouping | None
) -> str | None:
    """Returns a warning if groups cannot be derived from the velocities of these tracks, else None."""
    rule = rule or default_grouping()
    if not tracks or not isinstance(rule, LinkRule) or tracks[0].unit == "group" or rule.smooth > 0:
        return None
    if tracks[0].plane == "image" and not (math.isfinite(px_per_m) and px_per_m > 0):
        return None
    error = velocity_error(tracks, fps, px_per_m, rule)
    if not error > MUCH * rule.alike:
        return None
    one_in = round(1 / max(1 - rule.share, 0.01))
    return (
        f"{name}: one velocity in {one_in} differs by {error / 2**0.5:.1f} m/s or more from the motion over "
        f"{WINDOW} s, too much to derive groups. Report nan as velocity: this motion is then used"
    )
