"""Synthetic errors beside real ones: a detector's profile fitted on one half of a recording, judged on the other.

    python -m benchmarks.fit_sensor [--data FOLDER] [--draws 20] [--json FILE]

First tables: the profiles' errors of boxes, mean and standard deviation, and scores beside the default. Then, for each
recording with gt and det (PETS09-S2L1-first200, TUD-Campus), on the second half: `measured` is the real detector; the
other columns are mean and 5 to 95 % of --draws simulated detectors on the same people, with the profile fitted on the
first half (`held out`), on the whole recording (`same`), on the other recording (`other`), and without a profile
(`default`, [sensor] of a scenario without keys). `outside` counts the rows whose measured value lies outside these 5 to
95 %. Last table: the profiles of the whole recordings on simulated scenes, overlap of boxes and distance of points on
the ground from the true position, m.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from benchmarks.support.options import CAMPUS, PETS, TOWN_CENTRE, add_data, new_parser
from benchmarks.support.tables import table
from scenarios.loading.resolve import load
from scenarios.schema.sensor import Sensor
from sim.detector.draws import false_scores, true_scores
from sim.sequence import simulate
from sim.types import Frame, Truth
from sim.types import Sequence as Recording
from tracking.fitting.detection_matching import MatchedRecording, match_detections, match_sequence
from tracking.fitting.error_statistics import error_statistics, simulated_detections
from tracking.fitting.sensor import fit_matched
from tracking.recordings.source import open_source

RECORDINGS = (PETS, CAMPUS)
SCENES = ("merge", "street")
SEED = 30_000
SCENE_SEEDS = range(SEED, SEED + 4)
LOW, HIGH = 0.05, 0.95


def cut(recording: Recording, first: int, last: int) -> Recording:
    """Returns frames `first` to `last` of a recording, labels and detections, as a recording of its own."""
    truth = recording.truth
    assert truth is not None
    rows = (truth.frame >= first) & (truth.frame <= last)
    names = ("frame", "id", "group", "pos", "vel", "box", "visibility", "z")
    kept = {name: getattr(truth, name)[rows] for name in names if getattr(truth, name) is not None}
    kept["frame"] = kept["frame"] - (first - 1)
    short: Truth = truth.replace(length=last - first + 1, labelled=None, unscored=None, **kept)
    frames = []
    for k, frame in enumerate(islice(recording.without_pictures(), first - 1, last), 1):
        assert frame.detections is not None
        t = (k - 1) / recording.fps
        frames.append(Frame(k, t, detections=frame.detections.replace(index=k, t=t)))
    return replace(
        recording, length=len(frames), frames=lambda: iter(frames), bare=None, load_truth=lambda: short,
        has_images=False,
    )  # fmt: skip


def part(recording: Recording, first: int, last: int, size: tuple[int, int]) -> MatchedRecording:
    """Returns frames `first` to `last` of a recording, matched; size: of the image, px."""
    short = cut(recording, first, last)
    assert short.truth is not None
    found = [frame.detections for frame in short if frame.detections is not None]
    return match_detections(short.truth, found, size, recording.camera)


def drawn_statistics(second: MatchedRecording, profiles: dict[str, Sensor], draws: int) -> dict[str, dict[str, object]]:
    """Returns each statistic as measured, and by profile the mean, low and high end of its draws."""
    rows: dict[str, dict[str, object]] = {name: {"measured": v} for name, v in error_statistics([second]).items()}
    for profile, sensor in profiles.items():
        made = [error_statistics([simulated_detections(second, sensor, SEED + k)]) for k in range(draws)]
        for name, row in rows.items():
            v = np.array([m[name] for m in made])
            v = v[np.isfinite(v)]
            row[profile] = (float(v.mean()), *np.quantile(v, (LOW, HIGH)).tolist()) if len(v) else (np.nan,) * 3
    return rows


def print_statistics(name: str, rows: dict[str, dict[str, object]], profiles: Sequence[str]) -> None:
    wide = max(map(len, rows))
    print(f"\n{name}\n{'':<{wide}}  measured" + "".join(f"  {p:>22}" for p in profiles))
    outside = dict.fromkeys(profiles, 0)
    for key, row in rows.items():
        measured = row["measured"]
        cells = ""
        for p in profiles:
            mean, low, high = row[p]  # type: ignore[misc]
            cells += f"  {mean:6.3f} ({low:6.3f} to {high:6.3f})"
            outside[p] += bool(np.isfinite([measured, mean]).all() and not low <= measured <= high)
        print(f"{key:<{wide}}  {measured:8.3f}{cells}")
    print(f"{f'outside, of {len(rows)}':<{wide}}  {'':8}" + "".join(f"  {outside[p]:>22}" for p in profiles))


def print_scenes(fitted: dict[str, Sensor]) -> None:
    """Prints what a profile gives on simulated scenes: overlaps with true boxes, errors of points on the ground."""
    print("\nscene    profile                overlap, median   points off, m: 50, 90, 99 %")
    for scene in SCENES:
        for name, sensor in {**fitted, "default": Sensor()}.items():
            scenario = load(scene).model_copy(update={"sensor": sensor})
            found = [match_sequence(simulate(scenario, seed, streams=())) for seed in SCENE_SEEDS]
            overlap = np.mean([error_statistics([m])["overlap, 50% quantile"] for m in found])
            off = np.concatenate([m.pos[m.match[m.hit]] - m.truth.pos[m.hit] for m in found])  # type: ignore[index]
            far = "  ".join(f"{q:.2f}" for q in np.quantile(np.linalg.norm(off, axis=1), (0.5, 0.9, 0.99)))
            print(f"{scene:8} {name:22} {overlap:15.2f}   {far}")


def print_profiles(fitted: dict[str, Sensor]) -> None:
    """Prints the errors of boxes of each profile and of the default, mean ± standard deviation, and their scores.

    The default's scores of true boxes are those of people in full view.
    """
    columns = ("across", "foot", "top", "width")
    rows = {}
    for name, sensor in {**fitted, "default": Sensor()}.items():
        noise = sensor.box_noise
        rows[name] = [f"{m:.3f} ± {sd:.3f}" for m, sd in (getattr(noise, key) for key in columns)]
        rows[name] += [f"{noise.occluded:g}", f"{noise.tails:g}"]
    table("Errors of boxes in box heights; width: its logarithm", "profile", [*columns, "occluded", "tails"], rows)
    u = np.linspace(0.0, 1.0, 1001)
    scores, shares = {}, (0.05, 0.2, 0.5, 0.8)
    for name, sensor in {**fitted, "default": Sensor()}.items():
        true, false = true_scores(u, np.ones(len(u)), sensor), false_scores(u, sensor)
        scores[name] = [" / ".join(f"{q:.2f}" for q in np.quantile(s, shares)) for s in (true, false)]
        scores[name].insert(1, f"{np.mean(true > 0.8):.0%}")
    table("Scores: 5, 20, 50 and 80 % quantiles", "profile", ["true boxes", "above 0.8", "false alarms"], scores)


def main() -> None:
    parser = new_parser(__doc__)
    add_data(parser)
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--json", type=Path, help="writes the statistics")
    args = parser.parse_args()
    warnings.simplefilter("ignore")  # TUD-Campus states no frame rate
    recordings = {Path(name).name: open_source(args.data / name, images=False)[0] for name in RECORDINGS}
    whole = {name: match_sequence(r) for name, r in recordings.items()}
    fitted = {name: fit_matched([m]) for name, m in whole.items()}
    town = open_source(args.data / TOWN_CENTRE, images=False)[0]
    print_profiles({**fitted, Path(TOWN_CENTRE).name: fit_matched([match_sequence(town)])})
    result = {}
    for name, recording in recordings.items():
        length, size = recording.length, whole[name].size
        assert length is not None
        middle = length // 2
        other = next(sensor for key, sensor in fitted.items() if key != name)
        profiles = {
            "held out": fit_matched([part(recording, 1, middle, size)]),
            "same": fitted[name],
            "other": other,
            "default": Sensor(),
        }
        rows = drawn_statistics(part(recording, middle + 1, length, size), profiles, args.draws)
        print_statistics(f"{name}: frames {middle + 1} to {length}", rows, list(profiles))
        result[name] = rows
    print_scenes(fitted)
    if args.json:
        args.json.write_text(json.dumps(result, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
