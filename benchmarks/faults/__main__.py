"""Whether `flockscope errors` lists a fault, names it and its cause, lists nothing else, and repairs it.

    python -m benchmarks faults [--seed 20000] [--fps 8] [--frames 10] [scenario …]

The tracks are the truth of a simulated scene with one fault. Each fault is made in ten places of each of eleven scenes,
at drawn frames; places whose true causes differ come in turn. Faults of groups are made twice: in tracks of people, and
in hulls of whole groups in which nobody else is. Columns: number of cases; listed: errors at the right people and
frames, to the frame; named: of the right kind; cause: of those whose cause is not ambiguous, with their number; nothing
else: no other error is listed; repaired: the repair of all errors gives the score 1.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from collections.abc import Sequence as SequenceOf
from dataclasses import replace
from itertools import islice, zip_longest

import numpy as np

from benchmarks.faults.groups import FAULTS, GROUPS
from benchmarks.faults.people import Fault, Span
from benchmarks.faults.scene import FaultScene, scene
from benchmarks.support.options import new_parser, one_thread
from benchmarks.support.tables import head, row
from sim.types import Tracks
from tracking.errors.found import FoundError, RunErrors, find_errors
from tracking.errors.groups import GroupError
from tracking.running.run import TrackingRun
from tracking.scoring.evaluation import Scorer
from tracking.scoring.group_rows import tracked_groups

SCENES = ("merge", "split", "cross", "queue", "pillar", "mixed", "crowd", "party", "door", "street", "lights")
DRAWN = 400  # places of which those to be used are chosen
COLUMNS = ("listed", "named", "cause", "nothing else", "repaired")


def cases(of: FaultScene, fault: str, count: int, seed: int) -> list[Fault]:
    """Returns up to `count` cases of a fault, of each true cause as many as there are."""
    makers = list(FAULTS[fault](of))
    drawn = np.random.default_rng(seed).permutation(len(makers))[:DRAWN]
    by_cause: dict[str, list[Fault]] = {}
    for k in drawn.tolist():
        made = makers[k]()
        if made.expected:
            by_cause.setdefault(made.cause or "", []).append(made)
    in_turn = (one for several in zip_longest(*(by_cause[c] for c in sorted(by_cause))) for one in several if one)
    return list(islice(in_turn, count))


def whole_cases(of: FaultScene, fault: str, count: int, seed: int) -> Iterator[tuple[Fault, list[Tracks]]]:
    """Yields cases with the hulls of their groups, in which nobody else is."""
    for made in cases(of, fault, 4 * count, seed):
        run = of.wholes(made.told.label)
        first, last = made.expected[0][1:3]
        if _holds_members_only(of, made, run, range(first - 1, last + 2)):
            yield made, run


def _holds_members_only(of: FaultScene, made: Fault, run: list[Tracks], frames: range) -> bool:
    truth = of.sequence.truth
    assert truth is not None
    (compared,) = Scorer(truth).compare([run], None, None)
    groups = tracked_groups(compared.sides).counted
    inside: dict[tuple[int, int], set[int]] = {}
    for g, member in zip(groups.of.tolist(), groups.member.tolist(), strict=True):
        frame, id = int(groups.rows.frame[g]), int(groups.rows.id[g])
        inside.setdefault((frame, id), set()).add(int(compared.sides.true.rows.id[member]))
    label = made.told.label
    meant: dict[tuple[int, int], set[int]] = {}
    for k in frames:
        for p in np.flatnonzero(label[k - 1] >= 0).tolist():
            meant.setdefault((k, int(label[k - 1, p])), set()).add(int(of.people[p]))
    return all(inside.get(key) == people for key, people in meant.items()) and not any(
        key not in meant for key in inside if key[0] in frames
    )


def judged(found: RunErrors, before: RunErrors, made: Fault) -> dict[str, bool]:
    """Returns what is right about the errors that were found; before: the errors without the fault."""
    known = [_span(one) for one in before.errors]
    listed = [one for one in found.errors if _span(one) not in known]
    wanted = [span[1:] for span in made.expected]
    spans = [_span(one)[1:] for one in listed]
    ours = [one for one in listed if _span(one)[1:] in wanted]
    first = [one for one in ours if _span(one) == made.expected[0]]
    result = {
        "listed": all(span in spans for span in wanted),
        "named": Counter(map(_span, ours)) == Counter(made.expected),
        "nothing else": len(ours) == len(listed),
        "repaired": all(abs(v) < 1e-9 for v in found.left.values() if v == v),
    }
    if made.cause is not None:
        result["cause"] = bool(first) and first[0].cause.name == made.cause
    return result


def _span(one: FoundError) -> Span:
    error = one.error
    people = error.people if isinstance(error, GroupError) else () if error.person is None else (error.person,)
    if error.kind == "engulfed group":
        people += error.others
    return error.kind, error.start, error.end, frozenset(people)


def measure(scenes: SequenceOf[FaultScene], fault: str, count: int, seed: int, whole: bool = False) -> Counter[str]:
    """Returns the number of cases, and of each column those that are right and those that were judged ("of …")."""
    total: Counter[str] = Counter()
    for of in scenes:
        if whole:
            before = find_errors(of.sequence, of.clean_wholes, costs=0)
            runs = ((made, run, None) for made, run in islice(whole_cases(of, fault, count, seed), count))
        else:
            before = find_errors(of.sequence, of.clean, costs=0)
            runs = (
                (made, _run(of, made), of.tracks(replace(of.told, ghosts=made.alarms), made.seen))
                for made in cases(of, fault, count, seed)
            )
        for made, run, seen in runs:
            total["cases"] += 1
            for name, right in judged(find_errors(of.sequence, run, seen, costs=0), before, made).items():
                total[name] += right
                total[f"of {name}"] += 1
    return total


def _run(of: FaultScene, made: Fault) -> SequenceOf[Tracks]:
    tracks = tuple(of.tracks(made.told))
    return TrackingRun(tracks, {"detections": "image"}) if made.pixels else tracks


def main() -> None:
    one_thread()
    parser = new_parser(__doc__)
    parser.add_argument("--seed", type=int, default=20000)
    parser.add_argument("--fps", type=float, default=8.0)
    parser.add_argument("--frames", type=int, default=10, help="cases of each fault in each scene")
    parser.add_argument("scenes", nargs="*", default=SCENES)
    args = parser.parse_args()
    scenes = [scene(name, args.seed, args.fps) for name in args.scenes]
    head(["fault", "cases", *COLUMNS])
    for whole in (False, True):
        for fault in GROUPS if whole else FAULTS:
            found = measure(scenes, fault, args.frames, args.seed, whole)
            cells = {c: f"{found[c] / found[f'of {c}']:.1%}" if found[f"of {c}"] else "" for c in COLUMNS}
            cells["cause"] += f" of {found['of cause']}"
            row([f"{fault}, hulls" if whole else fault, str(found["cases"]), *cells.values()])


if __name__ == "__main__":
    main()
