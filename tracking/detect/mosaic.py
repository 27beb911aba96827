"""The place round a picture that moves over it: what a camera that turns has shown, kept for when it turns back (ours).

The background model of a moving camera is a window of a mosaic (Irani et al. 1996), an image of all that was shown.
The window follows the camera by whole pixels; what leaves it stays in the mosaic as it was, and comes back unchanged.
"""

from __future__ import annotations

import cv2
import numpy as np

from sim.types import Array, Bools, Image
from tracking.detect.background_kernels import Floats
from tracking.detect.camera_motion import mapped, seen, shifted

LARGEST = 4.0  # sides of a mosaic at most, in sides of a picture
STRIP = 32  # rows that are filled at once


def extent(poses: list[Array], size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Returns left, top, width and height, px, of the image in which pictures of `size` (width, height) lie after the
    homographies `poses` (3, 3). Sides are at most LARGEST of a picture's, about the one whose pose is the identity."""
    corners = np.array([(x, y) for x in (0, size[0]) for y in (0, size[1])], float)
    all_corners, sides = np.concatenate([mapped(one, corners) for one in poses]), np.array(size)
    far = np.rint((LARGEST - 1) / 2 * sides)
    low = np.floor(np.clip(all_corners.min(axis=0), -far, 0)).astype(int)
    high = np.ceil(np.clip(all_corners.max(axis=0), sides, sides + far)).astype(int)
    return int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1])


def on_one_picture(sample: Image, poses: list[Array | None]) -> tuple[Image, Bools, tuple[int, int]]:
    """Returns the pictures of a sample (K, H, W, 3) in one image (N, height, width, 3) in the place of the one whose
    pose is the identity, the pixels (height, width) that at least one of them shows, and where that one's left upper
    corner is in it, px. Pictures without a pose are left out.

    A pixel has the colours of those pictures that show it, again and again, in each of the N.
    """
    size = sample.shape[2], sample.shape[1]
    kept = [(picture, pose) for picture, pose in zip(sample, poses, strict=True) if pose is not None]
    left, top, width, height = extent([pose for _, pose in kept], size)
    at, whole = shifted(-left, -top), (width, height)
    laid = np.stack([cv2.warpPerspective(picture, at @ pose, whole) for picture, pose in kept]).astype(np.uint8)
    shown = np.stack([seen(at @ pose, size, whole) for _, pose in kept])
    turns = np.arange(len(kept))[:, None, None]
    for first in range(0, whole[1], STRIP):
        rows = slice(first, first + STRIP)
        here = shown[:, rows]
        order, count = np.argsort(~here, axis=0, kind="stable"), np.maximum(here.sum(axis=0), 1)
        chosen = np.take_along_axis(order, turns % count, axis=0)
        laid[:, rows] = np.take_along_axis(laid[:, rows], chosen[..., None], axis=0)
    return laid, np.asarray(shown.any(axis=0)), (-left, -top)


class Mosaic:
    """Planes of a model, of which a window is in use.

    State: planes (P, H, W), float32; known (H, W), where they have a meaning; at, left and top of the window, px;
    size, width and height of the window.
    """

    def __init__(self, planes: Floats, known: Bools, at: tuple[int, int], size: tuple[int, int]) -> None:
        self.planes, self.known, self.at, self.size = planes, known, at, size

    def window(self) -> tuple[Floats, Bools]:
        """Returns copies of the planes (P, h, w) of the window, and of where they are known (h, w)."""
        part = self._part()
        return self.planes[:, *part].copy(), self.known[part].copy()

    def store(self, planes: Floats, known: Bools) -> None:
        """Takes the planes (P, h, w) of the window, and where they are known (h, w)."""
        part = self._part()
        self.planes[:, *part], self.known[part] = planes, known

    def move(self, right: int, down: int) -> None:
        """Moves the window by whole px. The mosaic grows, and forgets what is far away."""
        self.at = self.at[0] + right, self.at[1] + down
        for axis, (at, side) in enumerate(zip(self.at, self.size, strict=True)):
            have, most = self.known.shape[1 - axis], round(LARGEST * side)
            before, after = max(-at, 0), max(at + side - have, 0)
            if not before and not after:
                continue
            drop = max(have + before + after - most, 0)
            cut = slice(drop, None) if after else slice(None, have - min(drop, have))
            pad = [(0, 0), (0, 0), (0, 0)]
            pad[2 - axis] = before, after
            keep: list[slice] = [slice(None)] * 3
            keep[2 - axis] = cut
            self.planes = np.pad(self.planes[tuple(keep)], pad, constant_values=1.0)
            self.known = np.pad(self.known[tuple(keep[1:])], pad[1:])
            moved = list(self.at)
            moved[axis] += before - (drop if after else 0)
            self.at = moved[0], moved[1]

    def bend(self, step: Array) -> None:
        """Lays the mosaic anew by a homography `step` (3, 3) of the window, px."""
        size, back = self.known.shape[::-1], shifted(*self.at)
        whole = back @ step @ shifted(-self.at[0], -self.at[1])
        self.planes = np.stack([cv2.warpPerspective(p, whole, size, borderValue=1.0) for p in self.planes])
        self.known = cv2.warpPerspective(self.known.astype(np.uint8) * 255, whole, size) == 255

    def _part(self) -> tuple[slice, slice]:
        (left, top), (width, height) = self.at, self.size
        return slice(top, top + height), slice(left, left + width)
