"""The pictures in a contact sheet's panels: the left view with the truth drawn over it, right view, ids, disparity.

Ids are a picture of who is seen at each pixel; disparity is the shift in px between left and right view.
"""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np

from sim.types import Array, Frame, Image, Ints, PixelTruth, Sequence, Truth
from tracking.drawing.canvas import FLOOR, GRID, INK, Canvas, colour
from tracking.drawing.layer_painting import LayerStyle, draw_label, paint_layer
from tracking.drawing.layers import Layer, layer_of_truth

OBJECTS = (150, 140, 132)  # Colour of walls and pillars in a picture of ids.

GREY = 128
QUANTILE = 0.99  # The scale of disparity runs from the 1 % to the 99 % quantile of the frame's disparities.


class PanelPictures:
    """Draws the pictures of chosen frames for a contact sheet's panels; they are read at construction."""

    def __init__(self, sequence: Sequence, truth: Truth, chosen: Iterable[int]) -> None:
        self.size, self.fps = sequence.image_size, truth.fps
        self.frames = _frames(sequence, set(chosen)) if sequence.has_images and self.size is not None else {}
        pixels = sequence.load_pixels
        self.pixels = {} if pixels is None else {index: pixels(index) for index in self.frames}
        self.layer = layer_of_truth(truth) if self.frames else Layer("true", "G", {})

    def kinds(self) -> tuple[str, ...]:
        """Returns the small pictures that can be drawn, of "right", "ids", "disparity", in this order."""
        some = next(iter(self.pixels.values()), None)
        available = {
            "right": any(frame.right is not None for frame in self.frames.values()),
            "ids": some is not None and some.ids.size > 0,
            "disparity": some is not None and some.disparity is not None,
        }
        kinds = tuple(kind for kind, is_available in available.items() if is_available)
        return ("left", *kinds) if len(kinds) == 1 else kinds

    def heights(self, width: int) -> tuple[int, int]:
        """Returns the heights in px of the large picture and of the row of small ones at this width; 0 if absent."""
        if self.size is None or not self.frames:
            return 0, 0
        aspect = self.size[1] / self.size[0]
        kinds = self.kinds()
        return round(width * aspect), round(width * aspect / len(kinds)) if kinds else 0

    def draw_large(self, area: Image, index: int) -> None:
        """Fills `area` in place with the left picture of frame `index` (from 1) and draws the truth over it."""
        assert self.size is not None
        picture = self.frames[index].image if index in self.frames else None
        _fill(area, picture)
        canvas = Canvas.fit(area, np.zeros(2), np.array(self.size, float), upwards=False)
        paint_layer(canvas, self.layer, index, self.fps, LayerStyle(rim=False))

    def draw_small(self, area: Image, index: int) -> None:
        """Fills `area` in place with the small pictures of frame `index` (from 1) side by side, each with its name."""
        kinds = self.kinds()
        width = area.shape[1] // len(kinds)
        for k, kind in enumerate(kinds):
            part = area[:, k * width : (k + 1) * width]
            words = _draw(part, kind, self.frames.get(index), self.pixels.get(index))
            draw_label(part, words, (4, 30), 0.62, INK)


def _frames(sequence: Sequence, chosen: set[int]) -> dict[int, Frame]:
    """Returns the chosen frames by number from 1; reading stops after the last of them."""
    found = {}
    for frame in sequence:
        if frame.index in chosen:
            found[frame.index] = frame
        if len(found) == len(chosen):
            break
    return found


def _draw(area: Image, kind: str, frame: Frame | None, pixels: PixelTruth | None) -> str:
    if kind in ("left", "right") or pixels is None:
        _fill(area, None if frame is None else frame.right if kind == "right" else frame.image)
        return kind
    if kind == "ids":
        _fill(area, coloured_ids(pixels.ids), cv2.INTER_NEAREST)
        return kind
    assert pixels.disparity is not None
    known = pixels.disparity[np.isfinite(pixels.disparity)]
    low, high = (np.quantile(known, [1 - QUANTILE, QUANTILE])) if len(known) else (0.0, 1.0)
    _fill(area, coloured_disparity(pixels.disparity, float(low), float(high)), cv2.INTER_NEAREST)
    return f"disparity {low:.1f} to {high:.1f} px"


def _fill(area: Image, picture: Image | None, interpolation: int = cv2.INTER_AREA) -> None:
    area[:] = GREY if picture is None else cv2.resize(picture, area.shape[1::-1], interpolation=interpolation)


def coloured_ids(ids: Ints) -> Image:
    """Returns a BGR picture of ids (H, W): people above 0, walls and pillars below 0 dark, ground 0 light."""
    out = np.full((*ids.shape, 3), FLOOR, np.uint8)
    out[ids < 0] = OBJECTS
    for identity in np.unique(ids[ids > 0]).tolist():
        out[ids == identity] = colour(identity)
    return out


def coloured_disparity(disparity: Array, low: float, high: float) -> Image:
    """Returns an (H, W, 3) BGR picture of disparities (H, W) px."""
    share = np.clip((np.nan_to_num(disparity, nan=low) - low) / max(high - low, 1e-9), 0, 1)
    out = np.asarray(cv2.applyColorMap((share * 255).astype(np.uint8), cv2.COLORMAP_VIRIDIS), np.uint8)
    out[~np.isfinite(disparity)] = GRID
    return out
