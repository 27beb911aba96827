"""Where wrong and missed merges come from, when people and their ways are known.

    python -m benchmarks.wrong_merges [--scenes standard friends-meet …] [--seeds 20000:20002] [--grouping NAME …]

Groups and merges (with forms) are derived from labelled people. A reported merge is right if a true one starts at most
1 s from it and the members have a Jaccard index of at least 0.5. The others are sorted by the first row that fits:
- at another time: a true merge of these people (Jaccard index of at least 0.5) starts more than 1 s earlier or later.
- who belong together: the people are one true group when the merge is reported. The grouping found them late, or had
  parted them.
- strangers who stand, strangers who walk: their median speed between start and report is below 0.3 m/s, or not.
Missed merges are sorted by how long the true group lasts unchanged: up to 4 s, or longer. In parentheses are the scenes
with the most merges of a row. --list also prints every wrong merge, to look at it with `flockscope view`.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.support.options import add_seeds, new_parser
from benchmarks.support.tables import table
from scenarios.loading.resolve import resolve
from sim.types import GroupEvent, Truth
from tracking.fitting.grouping_scenes import simulated
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.grouping_choice import grouping_of
from tracking.grouping.known_people import people_as_tracks
from tracking.scoring.events import ALIKE, KINDS, ComparableEvent, EventMembers, match_events

MERGES = frozenset({"merge", "form"})
SHORT = 4.0  # s
STANDING = 0.3  # m/s
ROWS = (
    "right", "at another time", "who belong together", "strangers who stand", "strangers who walk",
    "missed, together for up to 4 s", "missed, together for longer",
)  # fmt: skip
WRONG = frozenset(ROWS[1:5])


@dataclass(frozen=True, slots=True)
class Finding:
    """One merge: its row of the table, its start and report, s (both the start if missed), ids of its people."""

    kind: str
    start: float
    reported: float
    people: tuple[int, ...]


def findings(truth: Truth, reported: Sequence[tuple[GroupEvent, int]]) -> list[Finding]:
    """Returns all reported merges of a sequence, each as (event, frame of the report), then those that were missed."""
    merges, fps, out = [e for e in truth.events if e.kind in MERGES], truth.fps, []
    true, told = [_comparable(e) for e in merges], [_comparable(e) for e, _ in reported]
    pairs = match_events(true, told, fps, 1.0)[KINDS.index("merge")].pairs
    right, found = {id(b) for _, b in pairs}, {id(a) for a, _ in pairs}
    for (event, frame), own in zip(reported, told, strict=True):
        if id(own) in right:
            kind = "right"
        elif any(own.members.jaccard(e.members) >= ALIKE for e in true):
            kind = "at another time"
        elif _one_group(truth, event, frame):
            kind = "who belong together"
        else:
            kind = "strangers who " + ("stand" if _speed(truth, event, frame) < STANDING else "walk")
        out.append(Finding(kind, event.start / fps, frame / fps, event.members))
    for event in (e for e, own in zip(merges, true, strict=True) if id(own) not in found):
        short = _lasts(truth, event) <= SHORT
        kind = "missed, together for " + ("up to 4 s" if short else "longer")
        out.append(Finding(kind, event.start / fps, event.start / fps, event.members))
    return out


def _comparable(event: GroupEvent) -> ComparableEvent:
    return ComparableEvent("merge", event.start, None, EventMembers(frozenset(event.members)), (np.nan, np.nan))


def _one_group(truth: Truth, event: GroupEvent, frame: int) -> bool:
    """Returns True if all members that are present in a frame have one group label."""
    rows = (truth.frame == frame) & np.isin(truth.id, event.members)
    labels = truth.group[rows]
    return len(labels) > 1 and labels[0] >= 0 and bool((labels == labels[0]).all())


def _speed(truth: Truth, event: GroupEvent, frame: int) -> float:
    """Returns the median speed of the members from the start of the event to the frame of its report, m/s."""
    assert truth.vel is not None
    rows = (truth.frame >= event.start) & (truth.frame <= frame) & np.isin(truth.id, event.members)
    return float(np.median(np.hypot(*truth.vel[rows].T)))


def _lasts(truth: Truth, event: GroupEvent) -> float:
    """Returns the time for which all members of a true merge are in one group from its end on, s."""
    rows = (truth.frame >= event.end) & np.isin(truth.id, event.members)
    frame, label = truth.frame[rows], truth.group[rows]
    of_frame = (label[frame == t] for t in np.unique(frame))
    together = [bool((labels == labels[0]).all() and labels[0] >= 0) for labels in of_frame]
    return (together.index(False) if False in together else len(together)) / truth.fps


def _list(scene: str, found: Sequence[Finding]) -> None:
    for one in found:
        if one.kind != "right":
            people = " ".join(map(str, one.people))
            print(f"  {scene}: {one.kind}, start {one.start:.1f} s, report {one.reported:.1f} s, people {people}")


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("--scenes", nargs="+", default=["standard", "friends-meet"], metavar="NAME")
    parser.add_argument("--grouping", nargs="+", default=["rule", "belief"], metavar="NAME")
    parser.add_argument("--list", action="store_true", help="print every wrong and every missed merge")
    add_seeds(parser, "20000:20002")
    args = parser.parse_args()
    groupings = {g: grouping_of(g) for g in args.grouping}
    for name in args.scenes:
        counts: dict[str, dict[str, Counter[str]]] = {g: defaultdict(Counter) for g in args.grouping}
        for entry in resolve(name):
            for seed in args.seeds:
                truth = simulated(entry, seed)
                people = people_as_tracks(truth)
                for g, grouping in groupings.items():
                    made = derive(people, truth.fps, truth.px_per_m, grouping)
                    found = findings(truth, [(e, t.index) for t in made for e in t.events if e.kind in MERGES])
                    if args.list:
                        _list(f"{g}, {truth.name}", found)
                    for one in found:
                        counts[g][one.kind][entry.name] += 1
        cells = {kind: [_cell(counts[g][kind]) for g in args.grouping] for kind in ROWS}
        wrong = {g: sum(sum(counts[g][kind].values()) for kind in WRONG) for g in args.grouping}
        table(f"{name}, seeds {args.seeds.start}:{args.seeds.stop}", "merges", args.grouping, cells)
        print("\nwrong: " + ", ".join(f"{g} {n}" for g, n in wrong.items()))


def _cell(count: Counter[str]) -> str:
    most = ", ".join(f"{scene} {n}" for scene, n in count.most_common(3))
    return f"{sum(count.values())}" + (f" ({most})" if most else "")


if __name__ == "__main__":
    main()
