"""Does what was tuned on simulated scenes help on a recording?

    python -m benchmarks.tuning [--trials 24] [--data FOLDER]

For each recording: the profile of its detector, fitted to the first half; a tracker tuned on the scenes of
tuning_suites/boxes.toml with this detector at the recording's frame rate, training seeds; then HOTA of defaults and
tuned parameters on the test seeds of these scenes, and on the second half of the recording. Differences have 95 %
intervals: of scenes by sequences, of recordings by blocks of frames. The trackers: `blob`, and Follower, which stands
for a tracker that nobody has tuned.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from scipy.optimize import linear_sum_assignment

from benchmarks.fit_sensor import part
from benchmarks.support.options import PETS, TOWN_CENTRE, add_data, new_parser
from benchmarks.support.tables import interval, number, signed, table
from scenarios import sensor_settings
from scenarios.loading.resolve import dump_sensor
from sim.types import Array, Context, Detections, Frame, Sequence, Tracks
from tracking.config import Config, param
from tracking.fitting.detection_matching import match_sequence
from tracking.fitting.sensor import fit_matched
from tracking.papers.blob.tracker import Blob
from tracking.recording_ranking import presence_in
from tracking.recordings.source import open_source
from tracking.running.run import track
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scorer
from tracking.stats import block_intervals
from tracking.tuning.result import TuningResult, short
from tracking.tuning.search import tune

SUITE = Path(__file__).parent / "tuning_suites" / "boxes.toml"
SCORE = "HOTA"
COLUMNS = ["scenes: default", "tuned minus default", "recording: default", "tuned minus default", "changed"]


@dataclass(frozen=True)
class FollowerConfig(Config):
    """Parameters of `Follower`."""

    tracker: ClassVar[str] = "follower"
    reach: float = param(1.0, (0.1, 5.0), "m", "greatest distance from where a track is expected", "log")
    patience: float = param(0.0, (0.0, 4.0), "s", "time for which a track waits for its next detection")
    least_score: float = param(0.0, (0.0, 1.0), "", "detections with a lower score are left out")


class Follower:
    """Gives each detection to the track that is expected nearest to it if it goes on as before."""

    needs = ("boxes", "points")
    config_class = FollowerConfig

    def __init__(self, config: FollowerConfig) -> None:
        self.config = config

    def reset(self, context: Context, seed: int) -> None:
        """Forgets all tracks."""
        self.wait, self.px_per_m = self.config.patience + 1.5 / context.fps, context.px_per_m
        self.id, self.seen, self.next_id = np.zeros(0, np.int64), np.zeros(0), 0
        self.pos, self.vel = np.zeros((0, 2)), np.zeros((0, 2))

    def step(self, frame: Frame, detections: Detections) -> Tracks:
        """Returns a track for each detection."""
        kept = detections.score >= self.config.least_score
        pos, box = detections.pos[kept], None if detections.box is None else detections.box[kept]
        reach = self.config.reach * (1.0 if detections.plane == "ground" else self.px_per_m)
        waiting = frame.t - self.seen <= self.wait
        old_id, seen, old, vel = (x[waiting] for x in (self.id, self.seen, self.pos, self.vel))
        gone = (frame.t - seen)[:, None]
        distance = np.linalg.norm(pos[:, None] - (old + gone * vel)[None], axis=2)
        new, at = linear_sum_assignment(np.minimum(distance, reach))
        near = distance[new, at] < reach
        new, at = new[near], at[near]
        id = self.next_id + np.arange(len(pos))
        self.next_id += len(id)
        moved = np.zeros((len(id), 2))
        id[new], moved[new] = old_id[at], (pos[new] - old[at]) / gone[at]
        lost = np.delete(np.arange(len(old)), at)
        self.id, self.seen = np.append(id, old_id[lost]), np.append(np.full(len(id), frame.t), seen[lost])
        self.pos, self.vel = np.vstack([pos, old[lost]]), np.vstack([moved, vel[lost]])
        alone, cov = np.full(len(id), -1), np.tile(np.eye(4), (len(id), 1, 1))
        return Tracks(frame.index, frame.t, detections.plane, "person", id, alone, pos, moved, cov, box)


def tuned(tracker: type, recording: Sequence, trials: int) -> TuningResult:
    """Returns the result of a search on scenes with the detector and the frame rate of a recording."""
    half = part(recording, 1, (recording.length or 0) // 2, match_sequence(recording).size)
    with tempfile.TemporaryDirectory() as folder:
        sensor = Path(folder) / "sensor.toml"
        sensor.write_text(dump_sensor(fit_matched([half]), ""))
        settings = (*sensor_settings(sensor), f"scenario.camera.fps={recording.fps:g}")
    return tune(
        tracker, SUITE, trials, objective=SCORE, detections="file", set=settings, check=None,
        seeds=range(3), validation=range(10_000, 10_005), test=range(20_000, 20_008),
    )  # fmt: skip


def on_second_half(tracker: type, recording: Sequence, config: Config) -> list[tuple[float, float, float]]:
    """Returns the score of the defaults on the second half, and the difference of `config`, each with its interval."""
    truth = recording.truth
    assert truth is not None
    runs = [list(track(tracker, recording, params=c, detections="file")) for c in (type(config)(), config)]
    default, other = (one.weighted_scores("hull") for one in Scorer(truth).compare(runs))
    first, at = truth.length // 2, list(CATALOGUE).index(SCORE)

    def scores(weights: Array) -> Array:
        every = np.hstack([np.zeros((len(weights), first)), weights])
        return np.column_stack([default(every)[:, at], other(every)[:, at] - default(every)[:, at]])

    ends = np.array(block_intervals(scores, truth.length - first, truth.fps, presence_in(truth))).T
    return [tuple(CATALOGUE[SCORE].within(x, difference=bool(k)).tolist()) for k, x in enumerate(ends)]


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("--trials", type=int, default=24)
    add_data(parser)
    args = parser.parse_args()
    for tracker in (Follower, Blob):
        rows = {}
        for name in (PETS, TOWN_CENTRE):
            (recording,) = open_source(args.data / name, images=False)
            found = tuned(tracker, recording, args.trials)
            old, new = on_second_half(tracker, recording, found.config)
            ours = next((c for c in found.comparisons if c.key == SCORE), None)
            scenes = ["–", "–"] if ours is None else [number(ours.before), signed(ours.difference, ours.low, ours.high)]
            changed = ", ".join(f"{key} {short(before)} → {short(now)}" for key, (before, now) in found.changed.items())
            rows[Path(name).name] = [*scenes, interval(*old), signed(*new), changed or "nothing"]
        table(f"{tracker.__name__}, {SCORE}", "recording", COLUMNS, rows)


if __name__ == "__main__":
    main()
