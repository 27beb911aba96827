"""Warnings for people with ids whose frame numbers, frame rate, unit of length or velocities cannot be right.

A wrong rate or unit gives no error, only other groups or none. The baseline rule links people whose velocities differ
by less than `alike` (0.5 m/s) most of the time: differences of positions from frame to frame, or zeros, make no such
pair, or too many.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from sim.io.formats.labels import WINDOW, chords
from sim.types import Tracks
from tracking.grouping.grouping_choice import Grouping, default_grouping
from tracking.grouping.link_rule import LinkRule
from tracking.grouping.tracks_table import tabulate

# m/s: a median speed above it is no crowd's. It is 0.6 to 1.4 in seq_hotel, zara01, mwt1gt, PETS09, TownCentre and
# TUD-Campus.
FAST = 3.0
LEAST_ROWS = 50  # Fewer velocities tell nothing.
MUCH = 1.5  # Times `alike` from which on velocities are reported as unusable; those of our trackers reach 0.9 at most.


def implausible(name: str, people: Sequence[Tracks], fps: float, px_per_m: float) -> Iterator[str]:
    """Yields a warning for each thing that is hardly right: frames without anybody at a fixed step, and speeds."""
    present = [t for t in people if len(t.id)]
    step = math.gcd(*np.diff([t.index for t in present]).astype(int).tolist())
    if step > 1:
        yield (
            f"{name}: people only in every {step}th frame, so that no group lasts. Number these frames 1, 2, 3, … and "
            f"give their own rate: --fps {fps:g} if the labels have this rate, --fps {fps / step:g} if the video has it"
        )
    if not present:
        return
    in_image = present[0].plane == "image"
    scale = px_per_m if in_image else 1.0
    median = median_speed(people, fps, scale)
    if median > FAST:
        unit = "that positions are in metres" if not in_image else f"--px-per-m, here {scale:.4g}"
        yield f"{name}: half of the people are faster than {median:.3g} m/s. Check --fps, here {fps:g}, and {unit}"


def median_speed(people: Sequence[Tracks], fps: float, px_per_m: float) -> float:
    """Returns the median speed of the motion over the last 0.5 s, m/s; nan if nobody moves for so long."""
    present = [t for t in people if len(t.id)]
    if not present:
        return math.nan
    frame = np.repeat([t.index for t in present], [len(t.id) for t in present])
    id, pos = np.concatenate([t.id for t in present]), np.concatenate([t.pos[:, :2] for t in present])
    speed = np.hypot(*chords(frame, id, pos, fps).T) / (px_per_m if present[0].plane == "image" else 1.0)
    return float(np.median(speed[np.isfinite(speed)])) if np.isfinite(speed).any() else math.nan


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
