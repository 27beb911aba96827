"""Pictures of a contact sheet's panels: what the camera saw with the truth over it, the right view, ids, disparity."""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np

from sim.types import Array, Frame, Image, Ints, PixelTruth, Sequence, Truth
from tracking.drawing.canvas import FLOOR, GRID, INK, Canvas, colour
from tracking.drawing.layer_painting import LayerStyle, draw_label, paint_layer
from tracking.drawing.layers import Layer, layer_of_truth

STANDING = (150, 140, 132)
GREY = 128
CLOSE = 0.99
"""The share of disparities that the scale of colours spans."""


class Pictures:
    """What a sequence shows in some frames. State: these frames, with what is true of their pixels."""

    def __init__(self, sequence: Sequence, truth: Truth, chosen: Iterable[int]) -> None:
        self.size, self.fps = sequence.image_size, truth.fps
        self.frames = _frames(sequence, set(chosen)) if sequence.has_images and self.size is not None else {}
        pixels = sequence.load_pixels
        self.pixels = {} if pixels is None else {index: pixels(index) for index in self.frames}
        self.side = layer_of_truth(truth) if self.frames else Layer("true", "G", {})

    def kinds(self) -> tuple[str, ...]:
        """Which small pictures there are: right, ids, disparity; the left one itself beside one of these alone."""
        some = next(iter(self.pixels.values()), None)
        there = {
            "right": any(frame.right is not None for frame in self.frames.values()),
            "ids": some is not None and some.ids.size > 0,
            "disparity": some is not None and some.disparity is not None,
        }
        found = tuple(kind for kind, is_there in there.items() if is_there)
        return ("left", *found) if len(found) == 1 else found

    def heights(self, width: int) -> tuple[int, int]:
        """px of the large picture and of the row of small ones, 0 where there are none."""
        if self.size is None or not self.frames:
            return 0, 0
        aspect = self.size[1] / self.size[0]
        kinds = self.kinds()
        return round(width * aspect), round(width * aspect / len(kinds)) if kinds else 0

    def large(self, area: Image, index: int) -> None:
        """The left picture with the truth over it."""
        assert self.size is not None
        picture = self.frames[index].image if index in self.frames else None
        _fill(area, picture)
        view = Canvas.fit(area, np.zeros(2), np.array(self.size, float), upwards=False)
        paint_layer(view, self.side, index, self.fps, LayerStyle(rim=False))

    def small(self, area: Image, index: int) -> None:
        """The right view, ids and disparity, beside each other."""
        kinds = self.kinds()
        width = area.shape[1] // len(kinds)
        for k, kind in enumerate(kinds):
            part = area[:, k * width : (k + 1) * width]
            words = _draw(part, kind, self.frames.get(index), self.pixels.get(index))
            draw_label(part, words, (4, 30), 0.62, INK)


def _frames(sequence: Sequence, chosen: set[int]) -> dict[int, Frame]:
    """The frames asked for; reading ends with the last of them."""
    found = {}
    for frame in sequence:
        if frame.index in chosen:
            found[frame.index] = frame
        if len(found) == len(chosen):
            break
    return found


def _draw(area: Image, kind: str, frame: Frame | None, pixels: PixelTruth | None) -> str:
    """One small picture; its caption."""
    if kind in ("left", "right") or pixels is None:
        _fill(area, None if frame is None else frame.right if kind == "right" else frame.image)
        return kind
    if kind == "ids":
        _fill(area, coloured_ids(pixels.ids), cv2.INTER_NEAREST)
        return kind
    assert pixels.disparity is not None
    known = pixels.disparity[np.isfinite(pixels.disparity)]
    low, high = (np.quantile(known, [1 - CLOSE, CLOSE])) if len(known) else (0.0, 1.0)
    _fill(area, coloured_disparity(pixels.disparity, float(low), float(high)), cv2.INTER_NEAREST)
    return f"disparity {low:.1f} to {high:.1f} px"


def _fill(area: Image, picture: Image | None, how: int = cv2.INTER_AREA) -> None:
    area[:] = GREY if picture is None else cv2.resize(picture, area.shape[1::-1], interpolation=how)


def coloured_ids(ids: Ints) -> Image:
    """(H, W, 3): people in the colours of their ids, walls and pillars dark, the ground light."""
    out = np.full((*ids.shape, 3), FLOOR, np.uint8)
    out[ids < 0] = STANDING
    for name in np.unique(ids[ids > 0]).tolist():
        out[ids == name] = colour(name)
    return out


def coloured_disparity(disparity: Array, low: float, high: float) -> Image:
    """(H, W, 3): far is dark, near is light, unknown is grey."""
    share = np.clip((np.nan_to_num(disparity, nan=low) - low) / max(high - low, 1e-9), 0, 1)
    out = np.asarray(cv2.applyColorMap((share * 255).astype(np.uint8), cv2.COLORMAP_VIRIDIS), np.uint8)
    out[~np.isfinite(disparity)] = GRID
    return out
