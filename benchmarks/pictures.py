"""Are rendered pictures and their pixel truth exact? And pictures of the documentation.

    python -m benchmarks pictures exactness [--seed 40000] [--step 20] [scenario …]
    python -m benchmarks pictures gallery [--out docs/rendering.jpg]
    python -m benchmarks pictures looks [--out docs/guides/looks.jpg]
    python -m benchmarks pictures trackers
    python -m benchmarks pictures guides

exactness: the renderer against a slow one that casts every ray against everything (tests/reference_render.py), and the
geometric visibility against that of the pixels, over the catalogue. Columns `ids`, `disparity`: pixels of 100,000, in
one frame of half size, whose id differs, and for which only one of the two sees the point with the right camera; `px`:
largest difference of disparities, the 10 largest left out. The rest is of every --step-th frame in full size. `box`:
largest difference, px, of an edge of the analytic box from that of the pixels, of people wholly visible. `visibility -
visibility_px`: number of people, then mean, mean absolute, 95 % and largest difference of the column of gt.txt from
visible / amodal pixels, of people with at least 50 amodal pixels and no part outside the image. The geometric
visibility samples a grid of 16 x 32 points per person, orders people by distance, and takes people behind stairs for
flat.
gallery: one frame of several scenarios, most of them the quarter with most people; of `crowd` also the ids (left half)
and disparities (right half, black where unknown). looks: one frame of each of 24 entries of the suite looks. trackers:
the idea of each tracker, in docs/trackers. guides: pictures of docs/guides, and of docs/start with the data of their
replays.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from benchmarks.support import guide_pictures, idea_pictures
from benchmarks.support.options import new_parser
from benchmarks.support.tables import head, row
from scenarios.loading.resolve import load, names, resolve
from sim.crowd.world import run
from sim.render.renderer import Renderer
from sim.scene.camera_placement import place_camera
from sim.sequence import simulate
from sim.truth.label import bodies
from sim.types import Camera, Motion
from tests import reference_render

FRAMES = {"crowd": 60, "stairs": 110, "pillar": 80, "lights": 60, "mixed": 80, "clutter": 60, "street": 150}
WHOLE = ("stairs", "clutter")  # not cut
GALLERY_SEED, QUALITY = 40_001, 82
LEAST_PX = 50
SHEET, LOOK = (4, 6), 25  # rows and columns of the sheet of looks; its frames' number
COLUMNS = "scenario", "ids", "disparity", "px", "box", "people", "mean", "abs", "95 %", "largest"


def resized(camera: Camera, factor: float) -> Camera:
    """Returns the same view with `factor` times the width and height in pixels."""
    width, height = (int(n * factor) for n in camera.image)
    focal = (camera.focal_px[0] * factor, camera.focal_px[1] * factor)
    scale = camera.px_per_m * factor
    return camera.replace(image=(width, height), focal_px=focal, centre_px=(width / 2, height / 2), px_per_m=scale)


def differences_from_slow(motion: Motion, camera: Camera, index: int) -> tuple[float, float, float]:
    """Returns wrong ids and wrong validities (of 100,000 pixels), and the 11th largest difference of disparities.

    The last two are nan for a camera without a second view.
    """
    paired = camera.kind == "pinhole" and camera.baseline > 0
    found = Renderer(motion, camera).pixels(index, disparity=paired)
    wrong = 1e5 * float((found.ids != reference_render.look(camera, motion, index).ids).mean())
    if not paired:
        return wrong, np.nan, np.nan
    assert found.disparity is not None
    true = reference_render.disparity(camera, motion, index)
    validity = 1e5 * float((np.isfinite(true) != np.isfinite(found.disparity)).mean())
    off = np.abs(true - found.disparity)
    return wrong, validity, float(np.sort(off[np.isfinite(off)])[-11])


def differences_from_geometry(made: Renderer, step: int) -> tuple[np.ndarray, float]:
    """Returns visibility - visibility_px of all people compared, and the largest difference of a box's edge, px."""
    truth, size = bodies(made.motion, made.camera), np.array(made.camera.image)
    assert truth.box is not None
    off, edge = [np.zeros(0)], 0.0
    for index in range(1, truth.length + 1, step):
        rows, pixels = truth.rows(index), made.pixels(index)
        box, seen = truth.box[rows], truth.visibility[rows]
        inside = (box[:, :2] >= 0).all(axis=1) & (box[:, :2] + box[:, 2:] <= size).all(axis=1)
        inside &= pixels.amodal_px >= LEAST_PX
        off.append((seen - pixels.visibility)[inside])
        whole = inside & (pixels.visibility == 1)
        low, high = box[whole, :2] - pixels.box[whole, :2], (box[:, :2] + box[:, 2:] - pixels.box[:, :2])[whole]
        edge = max(edge, float(np.abs(low).max(initial=0)), float(np.abs(high - pixels.box[whole, 2:]).max(initial=0)))
    return np.concatenate(off), edge


def exactness(args: argparse.Namespace) -> None:
    head(COLUMNS)
    every = []
    for name in args.scenario or names():
        scenario = load(name)
        motion = run(scenario, args.seed)
        camera = place_camera(scenario.camera, motion)
        wrong = differences_from_slow(motion, resized(camera, 0.5), len(motion.present) // 2)
        off, edge = differences_from_geometry(Renderer(motion, camera), args.step)
        every.append(off)
        size = np.abs(off)
        shares = [f"{v:.3f}" for v in (off.mean(), size.mean(), np.percentile(size, 95), size.max())]
        row([name, f"{wrong[0]:.1f}", f"{wrong[1]:.1f}", f"{wrong[2]:.0e}", f"{edge:.2f}", str(len(off)), *shares])
    off = np.concatenate(every)
    size = np.abs(off)
    print(f"all: {len(off)} people, mean {off.mean():.4f}, absolute {size.mean():.4f}, ", end="")
    print(f"95 % {np.percentile(size, 95):.3f}, 99 % {np.percentile(size, 99):.3f}")


def gallery_renderer(name: str) -> Renderer:
    settings = ["camera.kind=top"] if name == "mixed" else []
    scenario = load(name, settings)
    motion = run(scenario, GALLERY_SEED)
    camera = resized(place_camera(scenario.camera, motion), 1 if name in WHOLE else 2)
    return Renderer(motion, camera, scenario.light, scenario.picture)


def window(made: Renderer, index: int) -> tuple[slice, slice]:
    """Returns the rows and columns of a quarter of the picture, the one that shows most of the people."""
    ids, (width, height) = made.pixels(index).ids, made.camera.image
    corners = [(top, left) for top in range(0, height // 2, height // 16) for left in range(0, width // 2, width // 16)]
    parts = [(slice(top, top + height // 2), slice(left, left + width // 2)) for top, left in corners]
    inner = [(slice(r.start + 30, r.stop - 30), slice(c.start + 30, c.stop - 30)) for r, c in parts]
    return parts[int(np.argmax([np.count_nonzero(ids[part]) for part in inner]))]


def truth_picture(made: Renderer, index: int, near: tuple[slice, slice]) -> np.ndarray:
    """Returns a BGR picture: ids in colours in the left half, disparities in the right half."""
    pixels = made.pixels(index, disparity=True)
    assert pixels.disparity is not None
    hues, value = (pixels.ids * 47 % 180).astype(np.uint8), np.where(pixels.ids > 0, 230, 0).astype(np.uint8)
    people = cv2.cvtColor(np.dstack([hues, value, value]), cv2.COLOR_HSV2BGR)
    d, people = pixels.disparity[near], people[near]
    scaled = np.nan_to_num(255 * (d - np.nanmin(d)) / (np.nanmax(d) - np.nanmin(d))).astype(np.uint8)
    depth = np.where(np.isnan(d)[..., None], 0, cv2.applyColorMap(scaled, cv2.COLORMAP_VIRIDIS)).astype(np.uint8)
    middle = d.shape[1] // 2
    return np.hstack([people[:, :middle], depth[:, middle:]])


def gallery(args: argparse.Namespace) -> None:
    cells = []
    for name, index in FRAMES.items():
        made = gallery_renderer(name)
        near = (slice(None), slice(None)) if name in WHOLE else window(made, index)
        cells.append(made.frame(index)[near])
        if name == "crowd":
            cells.append(truth_picture(made, index, near))
    pairs = [np.hstack(cells[k : k + 2]) for k in range(0, len(cells), 2)]
    small = cv2.resize(np.vstack(pairs), None, fx=0.75, fy=0.75, interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(args.out or "docs/rendering.jpg"), small, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])


def looks(args: argparse.Namespace) -> None:
    cells = []
    for entry in resolve("suite:looks")[:: 200 // SHEET[0] // SHEET[1]][: SHEET[0] * SHEET[1]]:
        sequence = simulate(entry.scenario, GALLERY_SEED, entry.repeat)
        frame = next(frame for frame in sequence.frames() if frame.index == LOOK)
        cells.append(cv2.resize(frame.image, (240, 180), interpolation=cv2.INTER_AREA))
    rows = [np.hstack(cells[k : k + SHEET[1]]) for k in range(0, len(cells), SHEET[1])]
    cv2.imwrite(str(args.out or "docs/guides/looks.jpg"), np.vstack(rows), [cv2.IMWRITE_JPEG_QUALITY, QUALITY])


def trackers(_: argparse.Namespace) -> None:
    for name, draw in idea_pictures.PICTURES.items():
        draw(Path("docs/trackers") / name)
        print(name)


def guides(_: argparse.Namespace) -> None:
    for path in guide_pictures.write(Path("docs")):
        print(path)


MODES = {"exactness": exactness, "gallery": gallery, "looks": looks, "trackers": trackers, "guides": guides}


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=MODES)
    parser.add_argument("scenario", nargs="*", help="exactness: of the catalogue; all by default")
    parser.add_argument("--seed", type=int, default=40_000, help="exactness: seed of every scenario")
    parser.add_argument("--step", type=int, default=20, help="exactness: frames from one compared to the next")
    parser.add_argument("--out", type=Path, help="gallery, looks: the picture")
    args = parser.parse_intermixed_args()
    MODES[args.mode](args)


if __name__ == "__main__":
    main()
