"""Does what was tuned on simulated scenes help on a recording?

    python -m benchmarks.tuning [--trials 24] [--data FOLDER]

For each recording: the profile of its detector, fitted to the first half; `blob` tuned on the scenes of
tuning_suites/boxes.toml with this detector at the recording's frame rate, training seeds; then HOTA of defaults and
tuned parameters on the test seeds of these scenes, and on the second half of the recording. Differences have 95 %
intervals: of scenes by sequences, of recordings by blocks of frames.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.fit_sensor import part
from benchmarks.support.options import PETS, TOWN_CENTRE, add_data, new_parser
from benchmarks.support.tables import interval, number, signed, table
from scenarios import sensor_settings
from scenarios.loading.resolve import dump_sensor
from sim.io.source import open_source
from sim.types import Array, Sequence
from tracking.config import Config
from tracking.fitting.detection_matching import match_sequence
from tracking.fitting.sensor import fit_matched
from tracking.papers.blob.config import BlobConfig
from tracking.ranking import presence_in
from tracking.running.run import track
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import weighted_scorers
from tracking.stats import block_intervals
from tracking.tuning import tune
from tracking.tuning.result import TuningResult

SUITE = Path(__file__).parent / "tuning_suites" / "boxes.toml"
SCORE = "HOTA"
COLUMNS = ["scenes: default", "tuned minus default", "recording: default", "tuned minus default", "changed"]


def tuned(recording: Sequence, trials: int) -> TuningResult:
    """Returns the result of a search on scenes with the detector and the frame rate of a recording."""
    half = part(recording, 1, (recording.length or 0) // 2, match_sequence(recording).size)
    with tempfile.TemporaryDirectory() as folder:
        sensor = Path(folder) / "sensor.toml"
        sensor.write_text(dump_sensor(fit_matched([half]), ""))
        settings = (*sensor_settings(sensor), f"scenario.camera.fps={recording.fps:g}")
    return tune(
        "blob", SUITE, trials, objective=SCORE, detections="file", set=settings, check=None,
        seeds=range(3), validation=range(10_000, 10_005), test=range(20_000, 20_008),
    )  # fmt: skip


def on_second_half(recording: Sequence, config: Config) -> list[tuple[float, float, float]]:
    """Returns the score of the defaults on the second half, and the difference of `config`, each with its interval."""
    truth = recording.truth
    assert truth is not None
    runs = [list(track("blob", recording, params=c, detections="file")) for c in (BlobConfig(), config)]
    default, other = weighted_scorers(truth, runs)
    first, at = truth.length // 2, list(CATALOGUE).index(SCORE)

    def scores(weights: Array) -> Array:
        every = np.hstack([np.zeros((len(weights), first)), weights])
        return np.column_stack([default(every)[:, at], other(every)[:, at] - default(every)[:, at]])

    ends = block_intervals(scores, truth.length - first, truth.fps, presence_in(truth))
    return [tuple(map(float, x)) for x in zip(*ends, strict=True)]  # type: ignore[misc]


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("--trials", type=int, default=24)
    add_data(parser)
    args = parser.parse_args()
    rows = {}
    for name in (PETS, TOWN_CENTRE):
        (recording,) = open_source(args.data / name, images=False)
        found = tuned(recording, args.trials)
        print(found, flush=True)
        old, new = on_second_half(recording, found.config)
        ours = next((c for c in found.comparisons if c.key == SCORE), None)
        scenes = ["–", "–"] if ours is None else [number(ours.before), signed(ours.difference, ours.low, ours.high)]
        rows[Path(name).name] = [*scenes, interval(*old), signed(*new), ", ".join(found.changed) or "nothing"]
    table(f"blob, {SCORE}", "recording", COLUMNS, rows)


if __name__ == "__main__":
    main()
