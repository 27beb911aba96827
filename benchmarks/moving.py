"""README's moving picture: the truth, `blob` and a tracker of boxes on the same detections, and the errors in words.

    python -m benchmarks moving [--out docs/moving.webp]

The scene is `benchmarks/moving.toml`. ByteTrack (roboflow `trackers`, its defaults) is installed in a folder of its
own; its groups are derived from its tracks as for any tracker without groups. The picture begins and rests where its
dearest error of groups begins.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import cv2
import numpy as np
from PIL import Image as Pillow

import scenarios
import sim
import tracking
from benchmarks.peers.adapters import ByteTrack
from benchmarks.peers.environments import DEFAULT, make_environments
from benchmarks.support.options import new_parser
from sim.types import Image, Sequence
from tracking.app.pictures.overlay import drawn
from tracking.drawing.canvas import FLOOR, text
from tracking.drawing.layers import Layer, layer_of_tracks, layer_of_truth
from tracking.errors.found import FoundError, RunErrors, errors_of_run
from tracking.errors.groups import GroupError
from tracking.running.run import grouped

SEED, STEP, REST = 2, 2, 3500  # of the scene; frames from one picture to the next; ms
ROWS = slice(30, 350)  # of the rendered picture that are shown
SHOWN, LETTERS, LINE = 4, 0.6, 27  # errors of each tracker in words; size of letters; px from line to line


def words(found: FoundError) -> str:
    """Returns an error in words."""
    cause = f", {found.cause.text}" if found.cause.text else ""
    return f"   {found.error.start}-{found.error.end} {found.error.kind}: {found.who}{cause}".replace("→", "->")


def panel(shape: tuple[int, ...], index: int, fps: float, errors: dict[str, RunErrors]) -> Image:
    """Returns the picture of the words: scores of the whole run, and the dearest errors of frame `index`."""
    picture, lines = np.full(shape, FLOOR, np.uint8), [f"frame {index}, {(index - 1) / fps:.1f} s"]
    for name, of in errors.items():
        scores = of.scores
        now = [f for f in of.errors if f.error.start <= index <= f.error.end and f.cost]
        count = sum(f.error.kind == "switch" for f in of.errors if f.error.start <= index)
        lines += [
            f"{name}: HOTA {scores['HOTA']:.2f}, group F1 {scores['group_F1']:.2f}, {count} identity switches so far"
        ]
        lines += map(words, sorted(now, key=lambda f: -(f.cost or 0))[:SHOWN])
    for k, line in enumerate(lines):
        text(picture, line, (8, (k + 1) * LINE), LETTERS)
    return picture


def titled(picture: Image, title: str) -> Image:
    """Returns the shown rows of a picture with a title in the corner."""
    shown = np.ascontiguousarray(picture[ROWS])
    text(shown, title, (8, 20), 0.65, bold=2)
    return shown


def moving(sequence: Sequence, layers: dict[str, list[Layer]], errors: dict[str, RunErrors]) -> list[Image]:
    """Returns the pictures, one for every STEP frames."""
    pictures = []
    for frame in sequence:
        if (frame.index - 1) % STEP == 0:
            assert frame.image is not None
            cells = [titled(drawn(frame.image, sequence.fps, frame.index, of), name) for name, of in layers.items()]
            cells.append(panel(cells[0].shape, frame.index, sequence.fps, errors))
            pictures.append(np.vstack([np.hstack(cells[:2]), np.hstack(cells[2:])]))
    return pictures


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/moving.webp"), help="the picture")
    args = parser.parse_args()
    make_environments(DEFAULT)
    sequence = sim.simulate(scenarios.load(str(Path(__file__).with_name("moving.toml"))), seed=SEED)
    layers, errors = {"truth": [layer_of_truth(sequence.truth)]}, {}
    for name, tracker in (("blob", "blob"), ("ByteTrack", ByteTrack(ByteTrack.config_class()))):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = tracking.track(tracker, sequence, detections="file")
        layers[name] = [layer_of_tracks(grouped(run, sequence), sequence.camera, sequence.scene)]
        errors[name] = errors_of_run(sequence, run)
    dearest = max((f for f in errors["ByteTrack"].errors if isinstance(f.error, GroupError)), key=lambda f: f.cost or 0)
    pictures = moving(sequence, layers, errors)
    times = [int(1000 * STEP / sequence.fps)] * len(pictures)
    first = -(-(dearest.error.start - 1) // STEP)
    times[first] = times[-1] = REST
    pictures, times = pictures[first:] + pictures[:first], times[first:] + times[:first]
    frames = [Pillow.fromarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)) for picture in pictures]
    frames[0].save(args.out, save_all=True, append_images=frames[1:], duration=times, loop=0, quality=50, method=6)
    print(f"{args.out}: {len(frames)} pictures, {args.out.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
