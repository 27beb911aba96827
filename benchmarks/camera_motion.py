"""A camera that trembles, turns, drifts or walks: scores of `blob` beside a camera that stands still.

    python -m benchmarks camera_motion [--seeds 20000:20006] [--still 100]

moved: a street for SECONDS, seen at SIZE by a camera that stands still, and by the same one that trembles by 8 px (14
px in one frame of twelve), turns by 3 px a frame, and drifts by 0.5 px a frame. HOTA and MOTA of `blob` from pixels by
IoU of boxes, without and with `tracking.detect.camera_motion`; the difference of HOTA from the still camera, paired by
seeds, and its share. Pictures are turned from wider ones of the still camera, with their noise added afterwards, which
is much quicker than to draw each anew and differs by the interpolation only. robot: the entry `robot` of the suite
`camera-motion`, from the sensor's boxes, where nothing is compensated.

still: of so many sequences of the suite `looks`, each of other ground, light, weather and lens, in how many the camera
was found to move.

cost: ms of a picture at 480 x 360 px that lies on the background, and of the same one if the camera stands still.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from contextlib import contextmanager, nullcontext
from functools import partial
from typing import Any

import cv2
import numpy as np

from benchmarks.support.options import add_seeds, new_parser
from benchmarks.support.tables import difference_cell, head, mean_cell, row, share
from scenarios import load
from scenarios.loading.resolve import resolve
from sim.crowd.world import run
from sim.looks import with_looks
from sim.render.renderer import Renderer
from sim.scene.camera_motion import MovingCamera, camera_at, place_view
from sim.sequence import observe, simulate
from sim.types import Array, Context, Frame, Image, Sequence
from tracking.detect import foreground as pipeline
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.foreground import Foreground
from tracking.running.run import track
from tracking.scoring.evaluation import evaluate

SECONDS, SIZE, FOCAL, FPS = 10, (320, 240), 250, 10
MARGINS = {"still": (0, 0), "shake": (60, 60), "pan": (420, 160), "drift": (140, 140)}  # px beside a picture
SCENE = "street"
LEAST_RATIO = 0.9


def motion_of(kind: str) -> list[str]:
    """Returns the settings of a camera that moves by so many px a frame at FOCAL and FPS."""
    turn = {"pan": 3.0, "drift": 0.5}
    speed = f"deg_per_s={np.degrees(turn.get(kind, 0.0) * FPS / FOCAL):.4f}"
    return {
        "still": [], "shake": ["camera.motion={kind='shake', px=8}"],
        "pan": [f"camera.motion={{kind='pan', {speed}, sweep_deg=30}}"],
        "drift": [f"camera.motion={{kind='drift', {speed}}}"],
    }[kind]  # fmt: skip


def turned_pictures(kind: str, seed: int) -> Sequence:
    """Returns the sequence of a street by a camera that turns, without a known camera or scale."""
    size = f"camera.image=[{SIZE[0]}, {SIZE[1]}]"
    settings = [size, f"camera.focal_px={FOCAL}", f"camera.fps={FPS}", f"duration={SECONDS}", "camera.crop=true"]
    scenario = load(SCENE, [*settings, *motion_of(kind)])
    motion = run(scenario, seed)
    known, view = observe(scenario, motion), place_view(scenario.camera, motion)
    rest, (aside, above) = view.rest if isinstance(view, MovingCamera) else view, MARGINS[kind]
    middle = rest.centre_px[0] + aside, rest.centre_px[1] + above
    wide = rest.replace(image=(SIZE[0] + 2 * aside, SIZE[1] + 2 * above), centre_px=middle)
    clean = scenario.picture.model_copy(update={"noise": 0.0})
    renderer = Renderer(with_looks(motion, scenario.looks), wide, scenario.light, clean)
    noise = np.random.default_rng(seed)

    def turned(picture: Image, t: float) -> Image:
        turn = camera_at(view, t).rotation @ rest.rotation.T
        # OpenCV's points are whole in the middle of a pixel.
        own, other = (lens((u - 0.5, v - 0.5)) for u, v in (rest.centre_px, middle))
        seen = cv2.warpPerspective(picture, own @ turn @ np.linalg.inv(other), SIZE, flags=cv2.INTER_CUBIC)
        noisy = seen + noise.normal(0.0, scenario.picture.noise, seen.shape)
        return np.asarray(np.clip(noisy + 0.5, 0, 255), np.uint8)

    sample = np.stack([turned(renderer.background(k), (k - 50) / FPS) for k in range(50)])
    frames = [Frame(k + 1, k / FPS, turned(renderer.frame(k + 1), k / FPS)) for k in range(SECONDS * FPS)]
    return Sequence(
        kind, FPS, len(frames), lambda: iter(frames), load_truth=lambda: known.truth, image_size=SIZE, has_images=True,
        load_background=lambda: sample, source={"kind": "video"},
    )  # fmt: skip


def lens(centre: tuple[float, float]) -> Array:
    """Returns the matrix (3, 3) of a lens of FOCAL px with its centre at `centre`, px."""
    return np.array([[FOCAL, 0, centre[0]], [0, FOCAL, centre[1]], [0, 0, 1.0]])


@contextmanager
def nothing_moves() -> Any:
    """Within it, no camera is found to move."""
    kept = pipeline.poses_of_sample, Foreground._moves
    pipeline.poses_of_sample, Foreground._moves = lambda sample: None, lambda *_: False  # type: ignore[assignment, method-assign]
    try:
        yield
    finally:
        pipeline.poses_of_sample, Foreground._moves = kept  # type: ignore[method-assign]


def scores(sequence: Sequence, detections: Any, found: Callable[[], Any] = nullcontext) -> Array:
    """Returns HOTA and MOTA, by boxes, of `blob`; (0, 0) if its input is refused."""
    with warnings.catch_warnings(), found():
        warnings.simplefilter("ignore")
        try:
            tracks = track("blob", sequence, detections=detections)
        except ValueError:
            return np.zeros(2)
    made = evaluate(sequence.truth, tracks, similarity="boxes")
    return np.array([made["HOTA"], made["MOTA"]])


def moved(seeds: range) -> None:
    """Prints the table of cameras that move."""
    head(["camera", "HOTA without", "HOTA", "beside the still one", "share", "MOTA without", "MOTA"])
    still: dict[str, Array] = {}
    for kind in MARGINS:
        videos = [turned_pictures(kind, seed) for seed in seeds]
        found = [np.array([scores(v, "image", how) for v in videos]) for how in (nothing_moves, nullcontext)]
        show(kind, found, still.setdefault("pixels", found[1]))
    for name in ("still", "robot"):
        (entry,) = [e for e in resolve("suite:camera-motion") if e.name == name]
        seen = np.array([scores(simulate(entry.scenario, seed, streams=()), "file") for seed in seeds])
        show(f"{name}, boxes", [seen, seen], still.setdefault("boxes", seen))


def show(name: str, found: list[Array], still: Array) -> None:
    """Prints one row: scores (S, 2) without and with compensation, and beside those of the still camera."""
    without, own = found
    part = own[:, 0].mean() / still[:, 0].mean()
    cells = [mean_cell(without[:, 0]), mean_cell(own[:, 0]), difference_cell(own[:, 0] - still[:, 0]), f"{part:.3f}"]
    row([name, *cells, f"{without[:, 1].mean():.3f}", f"{own[:, 1].mean():.3f}"])


def still_videos(count: int) -> None:
    """Prints in how many of so many still videos the camera was found to move."""
    entries = resolve("suite:looks")
    step, found = max(len(entries) // count, 1), 0
    for n, entry in enumerate(entries[::step][:count]):
        scenario = entry.scenario.model_copy(update={"duration": 3.0})
        scenario = scenario.model_copy(update={"camera": scenario.camera.model_copy(update={"image": (320, 240)})})
        video = simulate(scenario, 20_000 + n, entry.repeat)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            seen = Foreground(context(video.background()[::2]), BackgroundSettings())
            for frame in video:
                assert frame.image is not None
                seen.segment(frame.image)
        if any("camera moves" in str(one.message) for one in said):
            found += 1
            print(entry.name, entry.repeat, flush=True)
    head(["still videos", "found to move"])
    row([str(count), share(found, count)])


def context(sample: Image | None) -> Context:
    """Returns the context of a video with a background sample."""
    assert sample is not None
    return Context(FPS, 40.0, None, None, (sample.shape[2], sample.shape[1]), sample)


def cost() -> None:
    """Prints the ms of a picture at 480 x 360 px, on the median of 50 pictures."""
    video = turned_pictures("shake", 40_000)
    frames = [cv2.resize(f.image, (480, 360)) for f in video if f.image is not None]
    empty = video.background()
    assert empty is not None
    sample = np.stack([cv2.resize(picture, (480, 360)) for picture in empty])
    head(["480 × 360 px", "ms"])
    for name, how in (("as if the camera stood still", nothing_moves), ("laid on the background", nullcontext)):
        with warnings.catch_warnings(), how():
            warnings.simplefilter("ignore")
            seen, took = Foreground(context(sample), BackgroundSettings()), []
            for image in frames[:60]:
                begun = time.process_time()
                seen.segment(np.asarray(image, np.uint8))
                took.append(time.process_time() - begun)
        row([name, f"{1e3 * float(np.median(took[10:])):.1f}"])


def main() -> None:
    parser = new_parser(__doc__)
    add_seeds(parser, "20000:20006")
    parser.add_argument("--still", type=int, default=100, help="number of still videos")
    given = parser.parse_args()
    for part in (cost, partial(moved, given.seeds), partial(still_videos, given.still)):
        part()


if __name__ == "__main__":
    main()
