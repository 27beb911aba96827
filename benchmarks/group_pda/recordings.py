"""Mode `real` of `benchmarks.group_pda`: recordings of real people.

hotel, zara: seq_hotel and zara01 from the labelled positions of people, without their identities. caviar:
Meet_WalkTogether1 from the centres of labelled boxes, in the image, at two scales: that of the first 100 boxes, which
is the default, and that of all boxes, given as by `--px-per-m`. Columns: group scores with 95 % intervals by weights of
blocks of frames; pairwise scores by the people in each hull (of rule and belief: by its members). Below: number of
events of each kind that are reported.
pets: the first 200 frames of PETS09-S2L1 from pixels. No groups are labelled: printed are the number of groups, the
events, and in how many frames the two people who walk together (11 and 12) are in one hull. A video is written.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.group_pda.runs import trackers
from benchmarks.support.options import HOTEL, PETS, WALK_TOGETHER, ZARA
from benchmarks.support.tables import interval, table
from sim.geometry.polygons import contains
from sim.io.source import open_source
from sim.types import Array, Tracks, Truth
from tracking.app.pictures.overlay import write_overlay
from tracking.grouping.grouped_tracks import with_groups
from tracking.grouping.grouping_choice import grouping_of
from tracking.grouping.known_people import people_as_tracks
from tracking.recording_intervals import recording_differences, recording_intervals
from tracking.run import track
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.frame_weights import weighted_scorers
from tracking.scoring.people_and_groups import INSIDE

DRAWS = 1000
KEYS = (
    "group_1-FP",
    "group_1-FN",
    "group_GDSR",
    "group_MOTP",
    "group_MOTA",
    "group_GDSR2",
    "group_F1_hull",
    "group_IDSW",
)
POSITIONS = """the input is the position of every labelled person in each frame (2.5 frames/s) without identities: no
misses and no false alarms"""
TABLE_3B = f"""columns of Bazzani et al. 2012, Table 3b. DEEPER-JIGT, on its own BIWI frames: 1-FP 53.8 %,
1-FN 78.0 %, GDSR 53.6 %, MOTP 0.44 m, MOTA 29.4 %; it follows people in the video and restarts from the truth when it
loses one. Here {POSITIONS}, but no restart from the truth either"""
ALL_BOXES = 18.8
"""px/m: scale of Meet_WalkTogether1 by all its boxes."""

PAIR = (11, 12)
OUT = Path("group-pda-pets.mp4")


def real(given: argparse.Namespace) -> Any:
    """Prints the parts of --only (default: all) and returns what they measured."""
    parts = {"hotel": hotel, "zara": zara, "caviar": caviar, "pets": pets}
    chosen = given.only.split(",") if given.only else parts
    return {name: parts[name](given) for name in chosen}


def hotel(given: argparse.Namespace) -> Any:
    return labelled_recording(given, HOTEL, TABLE_3B)


def zara(given: argparse.Namespace) -> Any:
    return labelled_recording(given, ZARA, POSITIONS)


def caviar(given: argparse.Namespace) -> Any:
    note = "from centres of labelled boxes; MOTP in px"
    return labelled_recording(given, WALK_TOGETHER, note, (None, ALL_BOXES))


def labelled_recording(
    given: argparse.Namespace, path: str, note: str, scales: Sequence[float | None] = (None,)
) -> Any:
    """Prints the table of a recording with labelled groups and returns values and intervals by tracker.

    scales: each tracker has a row for each, px/m; None: the recording's own. The truth has its own scale.
    """
    sequence = open_source(given.data / path)[0]
    truth = sequence.truth
    assert truth is not None
    boxed = truth.box is not None
    variants = [v for v in trackers(given.tracker, "truth") if boxed or v.tracker != "blob"]  # blob needs boxes
    answers: dict[str, Sequence[Tracks]] = {}
    for scale in scales:
        scaled = sequence if scale is None else open_source(given.data / path, px_per_m=scale)[0]
        at = f", {scaled.px_per_m:.1f} px/m" if scaled.px_per_m > 0 else ""
        for v in variants:
            answers[v.name + at] = track(
                v.tracker, scaled, params=v.params or None, detections="truth", grouping=v.grouping
            )
        for name in ("rule", "belief"):
            by_pairs = with_groups(people_as_tracks(truth), truth.fps, scaled.px_per_m, grouping_of(name))
            answers[f"{name}, given identities{at}"] = by_pairs
    keys = [*KEYS, "pairwise_F1", "pairwise_precision", "pairwise_recall"]
    found = {name: with_intervals(truth, tracks, keys) for name, tracks in answers.items()}
    rows = {name: [interval(*ends) for ends in row] for name, row in found.items()}
    seconds = truth.length / truth.fps
    title = f"{sequence.name}, {seconds:.0f} s: {note}"
    table(title, "tracker", [key.removeprefix("group_") for key in keys], rows)
    for name, tracks in answers.items():
        print(f"{name}: events reported {dict(Counter(e.kind for t in tracks for e in t.events))}")
    return found


def with_intervals(truth: Truth, answers: Sequence[Tracks], keys: Sequence[str]) -> list[tuple[float, float, float]]:
    """Returns value, low and high end of each score; the ends are nan where the interval is unknown."""
    return chosen(keys, recording_intervals(truth, weighted_scorers(truth, [answers])[0], DRAWS))


def paired_on_recording(
    truth: Truth, before: Sequence[Tracks], today: Sequence[Tracks], keys: Sequence[str]
) -> list[tuple[float, float, float]]:
    """Returns the difference of each score, today minus before, with the low and high end of its 95 % interval.

    before, today: one `Tracks` per frame. They are compared as by `score --against`: in one plane, under equal weights
    of the frames. The ends are nan where the interval is unknown, as for a difference of 0 in all draws. Raises
    IncomparableError if the runs cannot lie in one plane.
    """
    later, earlier = weighted_scorers(truth, [today, before])
    return chosen(keys, recording_differences(truth, later, earlier, DRAWS))


def chosen(keys: Sequence[str], ends: tuple[Array, Array, Array]) -> list[tuple[float, float, float]]:
    """Returns value, low and high end of the scores with these keys; ends: of all scores of the catalogue."""
    found = dict(zip(CATALOGUE, zip(*(end.tolist() for end in ends), strict=True), strict=True))
    return [found[key] for key in keys]


def pets(given: argparse.Namespace) -> Any:
    folder = given.data / PETS
    sequence = open_source(folder, images=True, camera=folder / "View_001.xml")[0]
    run = track(given.tracker, sequence, detections="image")
    truth = sequence.truth
    assert truth is not None
    count = [len(t.id) for t in run]
    speed = run.info["frames_per_second"]
    print(f"\n{sequence.name}, from pixels (background spread over the recording; calibrated), {speed:.0f} frames/s")
    print("groups reported, frames × groups:", ", ".join(f"{len(list(some))} × {n}" for n, some in groupby(count)))
    events = [(e.kind, e.start, t.index, e.before, e.after) for t in run for e in t.events]
    print("events (kind, start, reported in, before, after):", *events, sep="\n  ")
    seen, one = together(truth, run)
    print(f"people {PAIR[0]} and {PAIR[1]}: both present in {seen} frames, in one hull in {one}")
    print(write_overlay(sequence, run, given.out or OUT))
    return {"groups": count, "events": events, "pair": [seen, one]}


def together(truth: Truth, answers: Sequence[Tracks]) -> tuple[int, int]:
    """Returns in how many frames both people of PAIR are present, and in how many of them in one hull."""
    seen = one = 0
    for t in answers:
        here = truth.at(t.index)
        rows = np.isin(here.id, PAIR)
        if rows.sum() == 2 and here.box is not None:
            middle = here.box[rows, :2] + here.box[rows, 2:] / 2
            hulls = () if t.groups is None else t.groups.hull
            seen += 1
            one += any(contains(hull, middle, INSIDE * truth.px_per_m).all() for hull in hulls)
    return seen, one
