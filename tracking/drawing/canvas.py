"""A picture in memory that is drawn on in world or image coordinates: lines, discs, arrows, polygons, text, id colours.

Coordinates are rounded to 1/16 px. Colours are BGR.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from sim.types import Array, Image

INK, QUIET, GRID = (36, 31, 27), (120, 112, 104), (238, 234, 230)
FLOOR, THING, WALL = (253, 252, 251), (144, 133, 125), (60, 51, 45)
# Colours of ids as RRGGBB; an id takes the colour at its number modulo 10.
PALETTE = ("0072b2", "b84a00", "00805e", "a33a7a", "6a51a3", "8a6d00", "b2182b", "20708c", "4d7c0f", "7a4a2a")

SHIFT = 4  # Fractional bits of the coordinates that cv2 is given.

TRAIL_SECONDS = 3.0  # s: how far back trails reach.

Colour = tuple[int, int, int]


def colour(identity: int) -> Colour:
    """Returns the BGR colour of an id, the same as on the replay page; grey for a negative id."""
    if identity < 0:
        return THING
    text = PALETTE[identity % len(PALETTE)]
    return int(text[4:], 16), int(text[2:4], 16), int(text[:2], 16)


@dataclass(frozen=True, eq=False)
class Canvas:
    """A picture with a mapping from drawing coordinates to its pixels."""

    image: Image  # (H, W, 3) uint8 BGR, drawn on in place
    scale: float  # px per drawing unit: m on a plan, px over a picture
    # low, high (2,): drawing coordinates, x and y, of the image's edges: the smallest and the largest
    low: Array
    high: Array
    upwards: bool  # True if y grows upwards, as on a plan; else downwards, as in a picture

    @classmethod
    def fit(cls, image: Image, low: Array, high: Array, upwards: bool) -> Canvas:
        """Returns a canvas that shows the rectangle low … high (2,), centred, as large as it fits on the image."""
        height, width = image.shape[:2]
        span = high - low
        scale = min(width / span[0], height / span[1])
        spare = (np.array([width, height]) / scale - span) / 2
        return cls(image, float(scale), low - spare, high + spare, upwards)

    def map(self, points: Array) -> Array:
        """Returns pixel coordinates (N, 2) of points in drawing coordinates, (N, 2) or (2,); nan stays nan."""
        points = np.asarray(points, float).reshape(-1, 2)
        y = self.high[1] - points[:, 1] if self.upwards else points[:, 1] - self.low[1]
        return np.stack([points[:, 0] - self.low[0], y], axis=1) * self.scale

    def line(self, points: Array, ink: Colour, width: int, closed: bool = False) -> None:
        """Draws a polyline through points (N, 2), not nan, in place; width: px."""
        cv2.polylines(self.image, [fixed_point(self.map(points))], closed, ink, width, cv2.LINE_AA, SHIFT)

    def disc(self, at: Array, radius: float, ink: Colour, width: int = -1) -> None:
        """Draws a disc round a point (2,), or with `width` > 0 a ring, in place; radius, width: px."""
        x, y = fixed_point(self.map(at))[0]
        cv2.circle(self.image, (int(x), int(y)), round(radius * 2**SHIFT), ink, width, cv2.LINE_AA, SHIFT)

    def fill(self, polygon: Array, ink: Colour, opacity: float) -> None:
        """Fills a polygon (V, 2), in pixel coordinates, in place."""
        # blend the polygon's own rectangle only, not the whole image
        low = np.maximum(np.floor(polygon.min(axis=0)).astype(int) - 1, 0)
        high = np.ceil(polygon.max(axis=0)).astype(int) + 2
        patch = self.image[low[1] : high[1], low[0] : high[0]]
        if patch.size == 0:
            return
        over = patch.copy()
        cv2.fillPoly(over, [fixed_point(polygon - low)], ink, cv2.LINE_AA, SHIFT)
        cv2.addWeighted(over, opacity, patch, 1 - opacity, 0, dst=patch)


def fixed_point(points: Array) -> np.ndarray:
    """Returns pixel coordinates (N, 2) as int32 with 4 fractional bits, as cv2's drawing functions take them."""
    # cv2's whole coordinates are pixel centres
    limited = np.clip(points - 0.5, -30_000, 30_000)
    return np.asarray(np.rint(limited * 2**SHIFT), np.int32)


def box_corners(box: Array) -> Array:
    """Returns the corners (…, 4, 2) of boxes (…, 4), clockwise from the upper left one where y grows downwards."""
    return np.asarray(box[..., None, :2] + box[..., None, 2:] * np.array([[0, 0], [1, 0], [1, 1], [0, 1]]))


def ascii_only(words: str) -> str:
    """Returns the text with a question mark for each character outside ASCII."""
    # cv2 cannot draw such a character, and a lone surrogate ends the process
    return words.encode("ascii", "replace").decode()


def text_width(words: str, size: float, bold: int = 1) -> int:
    """Returns the width in px of words that `text` draws with this font scale and these strokes."""
    (width, _), _ = cv2.getTextSize(ascii_only(words), cv2.FONT_HERSHEY_SIMPLEX, size, bold)
    return int(width)


def text(image: Image, words: str, at: tuple[float, float], size: float, ink: Colour = INK, bold: int = 1) -> None:
    """Writes words with a light rim in place; at: lower left corner of the first letter, px; size: cv2's font scale."""
    place = (round(at[0]), round(at[1]))
    words = ascii_only(words)
    cv2.putText(image, words, place, cv2.FONT_HERSHEY_SIMPLEX, size, FLOOR, bold + 4, cv2.LINE_AA)
    cv2.putText(image, words, place, cv2.FONT_HERSHEY_SIMPLEX, size, ink, bold, cv2.LINE_AA)


def draw_label(image: Image, words: str, at: tuple[float, float] | Array, size: float, ink: Colour) -> int:
    """Writes light words on a rectangle, kept inside the image, in place, and returns its height in px."""
    words = ascii_only(words)
    (width, height), baseline = cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, size, 1)
    x = int(np.clip(at[0], 0, max(image.shape[1] - width - 5, 0)))
    y = int(np.clip(at[1], height + baseline + 2, image.shape[0] - 1))
    cv2.rectangle(image, (x, y - height - baseline - 1), (x + width + 4, y), ink, -1)
    cv2.putText(image, words, (x + 2, y - baseline), cv2.FONT_HERSHEY_SIMPLEX, size, FLOOR, 1, cv2.LINE_AA)
    return height + baseline + 2
