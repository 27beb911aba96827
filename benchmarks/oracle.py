"""Exact pixels against a slow renderer, and geometric visibility against that of pixels, over the catalogue.

    PYTHONPATH=. python benchmarks/oracle.py [--seed 40000] [--step 20]

`ids`, `disparity`: pixels in 100,000 of one frame (half size) in which the id differs, and in which one of the two says
that the right camera sees the point and the other does not; `px`: largest difference of disparities but for those 10
pixels. The rest is of every `step`-th frame in full size. `box`: largest difference of an edge of the analytic box from
that of the pixels, of people wholly visible. `visibility - visibility_px`: mean, mean absolute, 95 % and largest
difference of the column of gt.txt from visible / amodal pixels, of people with at least 50 amodal pixels and nothing
outside the image. The geometric one knows a grid of 16 × 32 samples a person, orders people by their distance, and
takes a person for flat where stairs come before it.
"""

from __future__ import annotations

import argparse

import numpy as np

from scenarios.loading.resolve import load, names
from sim.crowd.world import run
from sim.render.renderer import Renderer, make_renderer
from sim.scene.camera_placement import place_camera
from sim.truth.label import bodies
from sim.types import Camera, Motion
from tests import reference_render as slow


def halved(camera: Camera) -> Camera:
    """The same view on a quarter of the pixels."""
    width, height = (n // 2 for n in camera.image)
    focal = (camera.focal_px[0] / 2, camera.focal_px[1] / 2)
    scale = camera.px_per_m / 2
    return camera.replace(image=(width, height), focal_px=focal, centre_px=(width / 2, height / 2), px_per_m=scale)


def exactness(motion: Motion, camera: Camera, index: int) -> tuple[float, float, float]:
    """Wrong ids, wrong validity (each in 100,000 pixels), largest difference of disparities but for 10."""
    paired = camera.kind == "pinhole" and camera.baseline > 0
    found, wanted = make_renderer(motion, camera).pixels(index, disparity=paired), slow.look(camera, motion, index)
    wrong = 1e5 * float((found.ids != wanted.ids).mean())
    if not paired:
        return wrong, np.nan, np.nan
    assert found.disparity is not None
    true = slow.disparity(camera, motion, index)
    validity = 1e5 * float((np.isfinite(true) != np.isfinite(found.disparity)).mean())
    off = np.abs(true - found.disparity)
    return wrong, validity, float(np.sort(off[np.isfinite(off)])[-11])


def against_geometry(made: Renderer, step: int) -> tuple[np.ndarray, float]:
    """visibility - visibility_px of all people asked, and the largest difference of a box's edge."""
    truth, size = bodies(made.motion, made.camera), np.array(made.camera.image)
    assert truth.box is not None
    assert truth.truncation is not None
    off, edge = [np.zeros(0)], 0.0
    for index in range(1, truth.length + 1, step):
        rows, pixels = truth.rows(index), made.pixels(index)
        box, seen = truth.box[rows], truth.visibility[rows]
        inside = (box[:, :2] >= 0).all(axis=1) & (box[:, :2] + box[:, 2:] <= size).all(axis=1)
        inside &= pixels.amodal_px >= 50
        off.append((seen - pixels.visibility)[inside])
        whole = inside & (pixels.visibility == 1)
        low, high = box[whole, :2] - pixels.box[whole, :2], (box[:, :2] + box[:, 2:] - pixels.box[:, :2])[whole]
        edge = max(edge, float(np.abs(low).max(initial=0)), float(np.abs(high - pixels.box[whole, 2:]).max(initial=0)))
    return np.concatenate(off), edge


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=40_000)
    parser.add_argument("--step", type=int, default=20)
    args = parser.parse_args()
    print(f"{'':18}{'in 100,000 pixels':>20}{'':8}{'':7}{'visibility - visibility_px':>40}")
    print(
        f"{'':18}{'ids':>8}{'disparity':>12}{'px':>8}{'box':>7}{'people':>8}{'mean':>8}{'abs':>8}{'95 %':>8}{'most':>8}"
    )
    every = []
    for name in names():
        scenario = load(name)
        motion = run(scenario, args.seed)
        camera = place_camera(scenario.camera, motion)
        wrong = exactness(motion, halved(camera), len(motion.present) // 2)
        off, edge = against_geometry(make_renderer(motion, camera), args.step)
        every.append(off)
        size = np.abs(off)
        print(
            f"{name:18}{wrong[0]:8.1f}{wrong[1]:12.1f}{wrong[2]:8.0e}{edge:7.2f}{len(off):8}"
            f"{off.mean():8.3f}{size.mean():8.3f}{np.percentile(size, 95):8.3f}{size.max():8.3f}",
            flush=True,
        )
    off = np.concatenate(every)
    print(f"all: {len(off)} people, mean {off.mean():.4f}, absolute {np.abs(off).mean():.4f}, "
          f"95 % {np.percentile(np.abs(off), 95):.3f}, 99 % {np.percentile(np.abs(off), 99):.3f}")  # fmt: skip


if __name__ == "__main__":
    main()
