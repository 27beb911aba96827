"""Does what was tuned on simulated scenes help on recordings?

    python -m benchmarks tuning [TRACKER …] [--trials 30] [--environments DIR] [--data FOLDER] [--json FILE]

Trackers of other libraries (benchmarks/peers) and `blob` get the boxes of PETS09-S2L1-first200, TUD-Campus and
AVG-TownCentre-first225. HOTA with the defaults, with 95 % intervals by blocks of frames, and how much it changes with
parameters that `tune` found (similarity by boxes, choice on validation seeds)

standard    on the scenes of tuning_suites/peers.toml
--like      on the scenes that `fit scene` makes of the recording's detections, without its labels
both        on these and on the standard ones, about as many of either
labels      on the scenes that `fit scene --labels` makes of the first third of the recording: people, camera and
            detector; judged on the rest
checked     the same, where it is no worse than the defaults on the labelled third; else the defaults
labels of…  the same of another recording, the whole of it
itself      on the recording itself, by four times as many draws as the search has trials, half of them round the
            defaults, half anywhere; a search may find more

The first table has the mean over recordings, and over the trackers of other libraries.
"""

from __future__ import annotations

import json
import tempfile
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fit_sensor import cut
from benchmarks.peers.adapters import PEERS
from benchmarks.peers.environments import DEFAULT, make_environments
from benchmarks.support.options import CAMPUS, PETS, TOWN_CENTRE, add_data, add_trackers, new_parser, one_thread
from benchmarks.support.tables import interval, signed, table
from sim.types import Array, Sequence, Tracks
from tracking.config import Config
from tracking.fitting.scene_like import scene_like
from tracking.papers.blob.tracker import Blob
from tracking.parameter_space import decode, moved, space_of
from tracking.recording_ranking import presence_in
from tracking.recordings.source import open_source
from tracking.running.run import track
from tracking.scoring import evaluate
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scorer
from tracking.stats import block_intervals
from tracking.tuning.adaptive import drawn_residuals
from tracking.tuning.result import short
from tracking.tuning.search import tune

SUITE = Path(__file__).parent / "tuning_suites" / "peers.toml"
RECORDINGS = {"PETS09": PETS, "TownCentre": TOWN_CENTRE, "TUD-Campus": CAMPUS}
NAMES = ("SORT", "ByteTrack", "OC-SORT", "norfair")
KINDS = {name: PEERS[name][1] for name in NAMES} | {"blob": Blob}
SCORE = "HOTA"
BOTH, LABELS, CHECKED, OTHERS = "both", "labels of the first third", "checked there", "labels of another"
WAYS = "standard", "--like", BOTH, LABELS, CHECKED, OTHERS, "itself"
DRAWN = 6  # scenes of a recording's kind in training
SEED, HALF = 0, 0.5  # of draws; share of the parameters that a draw anywhere changes
Found = dict[str, dict[str, list[float]]]  # by recording and way: the difference and its ends


def tuned(kind: Any, scenes: Path, seeds: int, trials: int) -> Config:
    """Returns the parameters that `tune` finds for a tracker; seeds: of training, of each scene."""
    return tune(
        kind, scenes, trials, objective=SCORE, detections="file", similarity="boxes", check=None, finalists=3,
        seeds=range(seeds), validation=range(10_000, 10_000 + 2 * seeds), test=range(20_000, 20_001),
    ).config  # fmt: skip


def tuned_on_itself(kind: Any, recording: Sequence, trials: int) -> Config:
    """Returns the best config of draws on the recording that it is judged on."""
    base, random = kind.config_class(), np.random.default_rng(SEED)
    space = space_of(type(base), "file")
    anywhere = random.uniform(-1, 1, (trials // 2, len(space))) * (random.random((trials // 2, len(space))) < HALF)
    drawn = np.concatenate([drawn_residuals(space, trials - trials // 2, random), anywhere])
    configs = [decode(space, moved(space, each, base), base) for each in drawn]

    def score(config: Config) -> float:
        return evaluate(recording.truth, run_of(kind, recording, config), similarity="boxes")[SCORE]

    return max(configs, key=score)


def run_of(kind: Any, recording: Sequence, config: Config) -> list[Tracks]:
    """Returns what a tracker with a config makes of the detections of a recording."""
    return list(track(kind, recording, params=config, detections="file"))


def gain(kind: Any, recording: Sequence, config: Config, first: int = 0) -> tuple[float, float, float]:
    """Returns the score of a config minus that of the defaults on a recording but for its `first` frames, with its
    ends."""
    return _scores(kind, recording, (kind.config_class(), config), first)[1]


def _scores(
    kind: Any, recording: Sequence, configs: tuple[Config, Config], first: int = 0
) -> list[tuple[float, float, float]]:
    """Returns the score of the first config, and the difference of the second, each with its ends."""
    truth = recording.truth
    assert truth is not None
    runs = {config: run_of(kind, recording, config) for config in configs}
    compared = Scorer(truth).compare([runs[config] for config in configs], "boxes")
    one, two = (each.weighted_scores("hull") for each in compared)
    at = list(CATALOGUE).index(SCORE)

    def scores(weights: Array) -> Array:
        every = np.hstack([np.zeros((len(weights), first)), weights])
        return np.column_stack([one(every)[:, at], two(every)[:, at] - one(every)[:, at]])

    ends = np.array(block_intervals(scores, truth.length - first, truth.fps, presence_in(truth))).T
    return [tuple(CATALOGUE[SCORE].within(x, difference=bool(k)).tolist()) for k, x in enumerate(ends)]


def play(
    name: str, recordings: Mapping[str, Sequence], scenes: Mapping[str, tuple[Path, int]], trials: int, found: Found,
    keep: Callable[[], None],
) -> None:  # fmt: skip
    """Adds all gains of a tracker that are not yet in `found`, and prints what was changed. scenes: by way a file, and
    the training seeds of each scene in it. keep: called after each gain."""
    kind = KINDS[name]
    configs = dict[str, Config]()

    def config(way: str) -> Config:
        if way not in configs:
            configs[way] = tuned(kind, *scenes[way], trials)
            base, now = kind.config_class().as_dict(), configs[way].as_dict()
            changed = [f"{p}={short(value)}" for p, value in now.items() if value != base[p]]
            print(f"{name}, {way}: {', '.join(changed) or 'nothing changed'}", flush=True)
        return configs[way]

    for place, recording in recordings.items():
        row = found.setdefault(place, {})
        if "default" not in row:
            row["default"] = list(_scores(kind, recording, (kind.config_class(),) * 2)[0])
        ways = {"standard": "standard", "--like": f"like {place}", BOTH: f"both {place}", LABELS: f"third of {place}"}
        ways |= {f"labels of {other}": f"labels of {other}" for other in recordings if other != place}
        for way, scene in ways.items():
            if way not in row:
                first = third(recording) if way == LABELS else 0
                row[way] = list(gain(kind, recording, config(scene), first))
                keep()
        if CHECKED not in row:
            kept = is_no_worse(kind, recording, config(f"third of {place}"))
            row[CHECKED] = row[LABELS] if kept else [0.0, np.nan, np.nan]
            keep()
        if "itself" not in row:
            row["itself"] = list(gain(kind, recording, tuned_on_itself(kind, recording, 4 * trials)))
        print(name, place, {way: round(values[0], 3) for way, values in row.items()}, flush=True)


def is_no_worse(kind: Any, recording: Sequence, config: Config) -> bool:
    """Returns whether the score of a config is no less than that of the defaults on the first third."""
    begin = cut(recording, 1, third(recording))
    before, after = (
        evaluate(begin.truth, run_of(kind, begin, one), similarity="boxes")[SCORE]
        for one in (kind.config_class(), config)
    )
    return after >= before


def third(recording: Sequence) -> int:
    """Returns the number of frames of the first third."""
    return (recording.length or 0) // 3


def show(every: Mapping[str, Found]) -> None:
    """Prints the tables, of the ways that all trackers and recordings have."""
    found = [row for each in every.values() for row in each.values()]
    ways = [way for way in WAYS if all(way in known(row) for row in found)]
    gains = {name: {way: [known(row)[way][0] for row in each.values()] for way in ways} for name, each in every.items()}
    rows = {name: [f"{np.mean(each[way]):+.3f}" for way in ways] for name, each in gains.items()}
    others = [name for name in NAMES if name in gains]
    if others:
        rows["mean of the libraries"] = [f"{np.mean([gains[n][way] for n in others]):+.3f}" for way in ways]
        rows["their worst"] = [f"{np.min([gains[n][way] for n in others]):+.3f}" for way in ways]
    table(f"{SCORE} minus that of the defaults, mean of the recordings", "tracker", ways, rows)
    places = [f"labels of {place}" for place in RECORDINGS] if OTHERS in ways else []
    columns = [*(way for way in ways if way not in (OTHERS, "itself")), *places, "itself"]
    for name, each in every.items():
        cells = {
            place: [interval(*row["default"]), *(signed(*row[way]) if way in row else "–" for way in columns)]
            for place, row in each.items()
        }
        table(f"{name}, {SCORE}", "recording", ["default", *columns], cells)


def known(row: Mapping[str, list[float]]) -> dict[str, list[float]]:
    """Returns the gains of a recording by way, with the mean of those with the labels of other recordings."""
    others = [values[0] for key, values in row.items() if key.startswith("labels of ") and key != LABELS]
    return {**row, **({OTHERS: [float(np.mean(others))]} if len(others) == len(RECORDINGS) - 1 else {})}


def main() -> None:
    parser = new_parser(__doc__)
    add_trackers(parser, KINDS)
    parser.add_argument("--trials", type=int, default=30, help="trials of each search")
    parser.add_argument("--environments", type=Path, default=DEFAULT, metavar="DIR", help="folder of the libraries")
    parser.add_argument("--json", type=Path, help="file that keeps what was played, from which a run goes on")
    add_data(parser)
    args = parser.parse_args()
    one_thread()
    trackers = args.trackers or list(KINDS)
    warnings.simplefilter("ignore")
    make_environments(args.environments, ("roboflow", "norfair"))
    recordings = {name: open_source(args.data / path, images=False)[0] for name, path in RECORDINGS.items()}
    every: dict[str, Found] = json.loads(args.json.read_text()) if args.json and args.json.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        scenes = {"standard": (SUITE, 1)}
        for name, recording in recordings.items():
            begin = cut(recording, 1, third(recording))
            for kind, seen in (("like", recording), ("labels of", recording), ("third of", begin)):
                way = f"{kind} {name}"
                scenes[way] = Path(folder) / f"{way.replace(' ', '-')}.toml", DRAWN
                scenes[way][0].write_text(scene_like(seen, labels=kind != "like").to_toml())
            both, (like, _) = Path(folder) / f"both-{name}.toml", scenes[f"like {name}"]
            both.write_text(f'''about = "scenes with occlusion, and scenes like a recording"
entry = [{{ suite = "{SUITE}" }}, {{ scenario = "{like.name}", repeat = {DRAWN} }}]
''')
            scenes[f"both {name}"] = both, 1

        def keep() -> None:
            if args.json:
                args.json.write_text(json.dumps(every))

        for name in trackers:
            play(name, recordings, scenes, args.trials, every.setdefault(name, {}), keep)
            keep()
    show({name: every[name] for name in trackers})


if __name__ == "__main__":
    main()
