"""The picture of docs/rendering.md: a few scenarios as they are rendered, the same frame as ids and as disparities.

PYTHONPATH=. python benchmarks/gallery.py [docs/rendering.jpg]
"""

from __future__ import annotations

import sys

import cv2
import numpy as np

from scenarios.loading.resolve import load
from sim.crowd.world import run
from sim.render.renderer import Renderer, make_renderer
from sim.scene.camera_placement import place_camera

SHOWN = (
    ("crowd", 60),
    ("stairs", 110),
    ("pillar", 80),
    ("lights", 60),
    ("mixed", 80),
    ("clutter", 60),
    ("street", 150),
)
SEED, QUALITY = 40_001, 82


def made(name: str) -> Renderer:
    above = ["camera.kind=top"] if name == "mixed" else []
    scenario = load(name, above)
    motion = run(scenario, SEED)
    return make_renderer(motion, place_camera(scenario.camera, motion), scenario.light, scenario.picture)


def truth(shown: Renderer, index: int) -> np.ndarray:
    """Left half: who is where, in colours; right half: disparity, dark where it is unknown."""
    pixels = shown.pixels(index, disparity=True)
    assert pixels.disparity is not None
    hues = (pixels.ids * 47 % 180).astype(np.uint8)
    people = cv2.cvtColor(
        np.dstack([hues, *2 * [np.where(pixels.ids > 0, 230, 0).astype(np.uint8)]]), cv2.COLOR_HSV2BGR
    )
    d = pixels.disparity
    near = np.nan_to_num(255 * (d - np.nanmin(d)) / (np.nanmax(d) - np.nanmin(d))).astype(np.uint8)
    far = np.where(np.isnan(d)[..., None], 0, cv2.applyColorMap(near, cv2.COLORMAP_VIRIDIS)).astype(np.uint8)
    middle = d.shape[1] // 2
    return np.hstack([people[:, :middle], far[:, middle:]])


def main() -> None:
    file = sys.argv[1] if len(sys.argv) > 1 else "docs/rendering.jpg"
    cells = []
    for name, index in SHOWN:
        shown = made(name)
        cells.append(shown.frame(index))
        if name == "crowd":
            cells.append(truth(shown, index))
    rows = [np.hstack(cells[k : k + 2]) for k in range(0, len(cells), 2)]
    small = cv2.resize(np.vstack(rows), None, fx=0.75, fy=0.75, interpolation=cv2.INTER_AREA)
    cv2.imwrite(file, small, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])


if __name__ == "__main__":
    main()
