"""Mode `real` of benchmarks/group_pda.py: recordings of real people, on which nothing was chosen.

hotel: seq_hotel from the labelled places of people, without their identities. caviar: Meet_WalkTogether1 from the
middles of labelled boxes, in the image. pets: the first 200 frames of PETS09-S2L1 from pixels; no groups are labelled:
what is told, and how often the pair that walks together (people 11 and 12) is in one hull; a video to look at.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.group_pda_runs import Variant
from benchmarks.group_pda_tables import interval, table
from sim.geometry.polygons import contains
from sim.io.source import open_source
from sim.types import Array, Ints, Tracks, Truth
from tracking.app.pictures.overlay import write_overlay
from tracking.grouping.grouped_tracks import with_groups
from tracking.run import track
from tracking.scoring import evaluate
from tracking.scoring.block_resampling import resampled_scorer
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.people_and_groups import INSIDE
from tracking.stats import moving_blocks
from tracking.tuning.grouping_episodes import people_as_tracks

DRAWS = 200
KEYS = ("group_1-FP", "group_1-FN", "group_GDSR", "group_MOTP", "group_MOTA", "group_GDSR2", "group_F1", "group_IDSW")
TABLE_3B = """columns of Bazzani et al. 2012, Table 3b. DEEPER-JIGT there, on its own BIWI frames: 1-FP 53.8 %,
1-FN 78.0 %, GDSR 53.6 %, MOTP 0.44 m, MOTA 29.4 %; it follows people in the video and is set anew from the truth where
it loses one. Here the input is every labelled person's place in each frame (2.5 frames/s), nothing of who is who: no
detector's misses, no false alarms, but no help from the truth afterwards either"""
PAIR = (11, 12)
OUT = Path("group-pda-pets.mp4")


def real(given: argparse.Namespace) -> Any:
    """Must-show 4."""
    parts = {"hotel": hotel, "caviar": caviar, "pets": pets}
    chosen = given.only.split(",") if given.only else parts
    return {name: parts[name](given) for name in chosen}


def hotel(given: argparse.Namespace) -> Any:
    return labelled(given, "biwi/seq_hotel", TABLE_3B)


def caviar(given: argparse.Namespace) -> Any:
    note = "from middles of labelled boxes; MOTP in px"
    return labelled(given, "caviar/mwt1gt.xml", note)


def labelled(given: argparse.Namespace, path: str, note: str) -> Any:
    """Scores of a recording with labelled groups, from labelled people; intervals by moving blocks of frames."""
    sequence = open_source(given.data / path)[0]
    truth = sequence.truth
    assert truth is not None
    variants = (
        Variant(given.tracker, given.tracker),
        Variant('association="none"', given.tracker, {"association": "none"}),
    )
    said: dict[str, Sequence[Tracks]] = {
        v.name: track(v.tracker, sequence, params=v.params or None, detections="truth") for v in variants
    }
    said["baseline rule, told who is who"] = with_groups(people_as_tracks(truth), truth.fps, truth.px_per_m)
    keys = [*KEYS, "pairwise_F1", "pairwise_precision", "pairwise_recall"]
    found = {name: blocks(truth, answers, keys) for name, answers in said.items()}
    rows = {name: [interval(*ends) for ends in row] for name, row in found.items()}
    seconds = truth.length / truth.fps
    title = f"{sequence.name}, {seconds:.0f} s: {note}. Pairs by who is in a hull (of the baseline: by its members)"
    table(title, "tracker", [key.removeprefix("group_") for key in keys], rows)
    for name, answers in said.items():
        print(f"{name}: events told {dict(Counter(e.kind for t in answers for e in t.events))}")
    return found


def blocks(truth: Truth, answers: Sequence[Tracks], keys: Sequence[str]) -> list[tuple[float, float, float]]:
    """Value, low and high of each score; counts have no interval (a drawn recording has other frames)."""
    every = list(CATALOGUE)
    at = [every.index(key) for key in keys]
    draw = resampled_scorer(truth, answers, None, "hull")

    def score(places: Ints) -> Array:
        return draw(places)[at]

    _, low, high = moving_blocks(score, truth.length, truth.fps, DRAWS)
    whole = evaluate(truth, answers)
    bare = {"group_IDSW", "group_MOTA"}  # switches come where blocks are joined
    nan = float("nan")
    return [
        (whole[key], *((nan, nan) if key in bare else (float(a), float(b))))
        for key, a, b in zip(keys, low, high, strict=True)
    ]


def pets(given: argparse.Namespace) -> Any:
    folder = given.data / "mot" / "PETS09-S2L1-first200"
    sequence = open_source(folder, images=True, camera=folder / "View_001.xml")[0]
    run = track(given.tracker, sequence, detections="image")
    truth = sequence.truth
    assert truth is not None
    count = [len(t.id) for t in run]
    speed = run.info["frames_per_second"]
    print(f"\n{sequence.name}, from pixels (background spread over the recording; calibrated), {speed:.0f} frames/s")
    print("groups told, frames × groups:", ", ".join(f"{len(list(some))} × {n}" for n, some in groupby(count)))
    told = [(e.kind, e.start, t.index, e.before, e.after) for t in run for e in t.events]
    print("events (kind, start, told in, before, after):", *told, sep="\n  ")
    seen, one = together(truth, run)
    print(f"people {PAIR[0]} and {PAIR[1]}: both there in {seen} frames, in one hull in {one}")
    print(write_overlay(sequence, run, given.out or OUT))
    return {"groups": count, "events": told, "pair": [seen, one]}


def together(truth: Truth, answers: Sequence[Tracks]) -> tuple[int, int]:
    """In how many frames both of the pair are there, and in how many in one hull."""
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
