"""Points of the simulated detector where people are hidden: their errors, and what they cost trackers.

    python -m benchmarks.sensor_points errors [--seeds 30000:30010] [scenario …]
    python -m benchmarks.sensor_points scores [--seeds 20000:20030] [--tracker NAME …] [--json FILE] [scenario …]
    python -m benchmarks.sensor_points recordings [--data FOLDER]

Each scenario is made with `sensor.points` own, seen and foot; all other draws are the same. errors: distance of a point
from the true position, m, by the visible share of the person: median, 90 and 99 % quantile of all people whom the
sensor may detect, misses left out. The last column is the distance on the ground between the foot of the visible part
and that of the whole body, without any error. scores: means over sequences of each tracker, and seen less own, paired;
* if 0 lies outside the interval; of IDSW less is better. recordings: by which share the detected lower edge of real
detectors follows the foot of the visible part, where that is more than 0.05 box heights above the foot of the whole
body. The share is that of least absolute errors, its interval a bootstrap over people; errors are in box heights, less
the median error of people in full view. `cut`: people of whom the picture ends before more than 2 % of the body;
`hidden`: all others.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.group_pda import columns
from benchmarks.group_pda.runs import Row, TrackingJob, Variant, measure, with_points
from benchmarks.support.options import (
    CAMPUS,
    PETS,
    TOWN_CENTRE,
    add_data,
    add_seeds,
    new_parser,
    one_thread,
    seeds_text,
)
from benchmarks.support.tables import head, interval, row, signed, table
from scenarios.loading.resolve import Entry, resolve
from sim.detector.box_noise import box_errors, seen_shift
from sim.detector.sense import sense
from sim.io.source import open_source
from sim.sequence import simulate
from sim.types import Array
from tracking.fitting.detection_matching import match_sequence
from tracking.stats import paired

FOOT = 1  # column of `box_errors`
DRAWS = 500
SCENES = ("mixed", "pillar", "crowd", "merge")
POINTS = ("own", "seen", "foot")
TRACKERS = ("blob", "group-pda")
KEYS = ("group_F1", "group_MOTA", "pairwise_F1", "event_F1", "group_IDSW", "HOTA")
VISIBILITIES = (0.2, 0.5, 0.75, 0.95, 1.0, np.inf)
QUANTILES = (0.5, 0.9, 0.99)
NOBODY_MISSED = {"detect_prob": 1.0, "occlusion_power": 0.0, "small_px": 0.0, "clutter_rate": 0.0}
FIELDS = ("frame", "id", "group", "pos", "vel", "box", "visibility", "visible_box", "z")


def errors_of(entry: Entry, seed: int) -> tuple[Array, Array]:
    """Returns visibilities (R,), and errors (R, 4) in m: of points own, seen and foot, and of the box's foot.

    Detections name nobody, so people are detected one by one; their draws do not depend on each other.
    """
    made = simulate(entry.scenario, seed, entry.repeat, streams=())
    truth, camera = made.truth, made.camera
    assert truth is not None
    assert truth.pos is not None
    assert camera is not None
    sensors = [entry.scenario.sensor.model_copy(update={**NOBODY_MISSED, "points": p}) for p in POINTS]
    likely = truth.visibility >= entry.scenario.sensor.min_visibility
    visibility, errors = [np.zeros(0)], [np.zeros((0, 4))]
    for person in np.unique(truth.id):
        rows = likely & (truth.id == person)
        one = truth.replace(**{name: getattr(truth, name)[rows] for name in FIELDS})
        z = np.zeros(len(one.id)) if one.z is None else one.z
        away = [seen_shift(one.visible_box, one.box, z, camera)]
        away += [np.concatenate([d.pos for d in sense(one, s, seed, camera, camera.image)]) - one.pos for s in sensors]
        visibility.append(one.visibility)
        errors.append(np.linalg.norm(np.roll(away, -1, axis=0), axis=2).T)
    return np.concatenate(visibility), np.concatenate(errors)


def errors(given: argparse.Namespace, entries: Sequence[Entry]) -> None:
    """Prints the quantiles of each scenario by visibility."""
    head(["scenario", "visible", "rows", *POINTS, "foot of the visible part"])
    for entry in entries:
        found = [errors_of(entry, seed) for seed in given.seeds or range(30_000, 30_010)]
        visibility, e = (np.concatenate(part) for part in zip(*found, strict=True))
        for low, high in pairwise(VISIBILITIES):
            rows = (visibility >= low) & (visibility < high)
            if not rows.any():
                continue
            name = f"{low:.0%}" if np.isinf(high) else f"{low:.0%} to {high:.0%}"
            cells = [", ".join(f"{q:.2f}" for q in np.quantile(column[rows], QUANTILES)) for column in e.T]
            row([entry.name, name, f"{rows.mean():.1%}", *cells])


def scores(given: argparse.Namespace, entries: Sequence[Entry]) -> dict[str, dict[str, list[Row]]]:
    """Prints the table of each scenario and tracker; returns the rows by scenario, then tracker and points."""
    seeds = given.seeds or range(20_000, 20_030)
    variants = tuple(Variant(name, name) for name in given.tracker or TRACKERS)
    found: dict[str, dict[str, list[Row]]] = {}
    for entry in entries:
        rows = found.setdefault(entry.name, {})
        for points in POINTS:
            jobs = [TrackingJob(with_points(entry, points), seed, "file", variants) for seed in seeds]
            made = measure(jobs, given.workers)
            for job, by_tracker in sorted(made, key=lambda done: done[0].seed):
                for name, one in by_tracker.items():
                    rows.setdefault(f"{name}, {points}", []).append({**one, "seed": job.seed})
        for v in variants:
            own, seen = (columns.values(rows[f"{v.name}, {points}"], KEYS) for points in POINTS[:2])
            cells = {p: [columns.mean_of(key)(rows[f"{v.name}, {p}"]) for key in KEYS] for p in POINTS}
            cells["seen less own"] = [signed(*(float(e[k]) for e in paired(own, seen))) for k in range(len(KEYS))]
            table(f"{entry.name}, {v.name}: {len(own)} sequences, seeds {seeds_text(seeds)}", "points", KEYS, cells)
    return found


def followed_share(error: Array, shift: Array) -> float:
    """Returns the share a, -0.5 to 1.5, of least mean absolute error |error - a shift|; both (R,)."""
    shares = np.linspace(-0.5, 1.5, 201)
    return float(shares[np.abs(error - shares[:, None] * shift).mean(axis=1).argmin()])


def recordings(given: argparse.Namespace) -> None:
    """Prints a row for each recording and cause."""
    head(["recording", "cause", "rows", "people", "share", "hidden foot, heights", "error", "error in full view"])
    for path in (PETS, CAMPUS, TOWN_CENTRE):
        matched = match_sequence(open_source(given.data / path, images=False)[0])
        truth, hit = matched.truth, matched.hit
        assert truth.box is not None
        assert truth.visible_box is not None
        assert truth.truncation is not None
        visible = np.where(np.isfinite(truth.visible_box), truth.visible_box, truth.box)[hit]
        shift = box_errors(visible, truth.box[hit])[:, FOOT]
        error = box_errors(matched.box[matched.match[hit]], truth.box[hit])[:, FOOT]
        full, cut = truth.visibility[hit] >= 0.95, truth.truncation[hit] > 0.02
        error -= np.median(error[full])
        for cause, rows in (("cut", cut & (np.abs(shift) > 0.05)), ("hidden", ~cut & (np.abs(shift) > 0.05))):
            id, e, x = truth.id[hit][rows], error[rows], shift[rows]
            people = np.unique(id)
            cells = [Path(path).name, cause, str(len(id)), str(len(people))]
            if len(people) < 10:
                row([*cells, "–"])
                continue
            draws = np.random.default_rng(0).choice(len(people), (DRAWS, len(people)))
            taken = [np.concatenate([np.flatnonzero(id == p) for p in people[draw]]) for draw in draws]
            ends = np.quantile([followed_share(e[t], x[t]) for t in taken], (0.025, 0.975))
            sizes = (np.median(v) for v in (np.abs(x), np.abs(e), np.abs(error[full])))
            row([*cells, interval(followed_share(e, x), *map(float, ends)), *(f"{v:.2f}" for v in sizes)])


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["errors", "scores", "recordings"])
    parser.add_argument("name", nargs="*", help="scenarios, suites or files")
    add_seeds(parser, None)
    add_data(parser)
    parser.add_argument("--tracker", action="append", help="scores: a tracker; blob and group-pda by default")
    parser.add_argument("--workers", type=int, default=2, help="scores: processes")
    parser.add_argument("--json", type=Path, help="scores: writes the scores, sequence by sequence")
    given = parser.parse_intermixed_args()
    one_thread()
    entries = [entry for name in given.name or SCENES for entry in resolve(name)]
    if given.mode != "scores":
        errors(given, entries) if given.mode == "errors" else recordings(given)
        return
    found = scores(given, entries)
    if given.json is not None:
        given.json.write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
