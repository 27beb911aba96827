"""Ghosts: places where the background model shows something that has left (ours).

People who stand through most of the background sample are learned as background. When they leave, the ground that they
uncover differs from the model, and is foreground without anybody there: a ghost. A ghost and a person who stands differ
in one respect. At the edge of the region, either the picture or the model has a step in colour: the picture if
something came, the model if something left.

A region of the foreground is a ghost if
    still    its pixels have kept their colour for GHOST_TIME
    open     more than half of its edge borders on background, not on other foreground
    left     along that edge the steps of the model sum to at least STEPS times those of the picture
The step at a pixel of the edge is the difference of the mean colours inside the region and outside the foreground,
within BAND_M of the pixel, in the channel where it is largest.

People who walk off within the sample leave no ghost (`uncovered_in_sample`): they and the ground are the two colours
that a pixel has in the sample. The one that continues the surroundings is background. The surroundings are the pixels
with one colour, filled in from the outside by a pyramid of means. Within BAND_M, the colours of people must be off by
at least STEPS times as much as those of the ground.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from sim.types import Array, Bools, Image
from tracking.detect import background_kernels, blobs
from tracking.detect.background import colour_planes
from tracking.detect.background_kernels import Floats

GHOST_TIME = 1.0  # s: a region that has been still for this time can be a ghost.
SIGHTING = 0.25  # s from one look at the pixels to the next. A walking person uncovers a pixel in about this time.
REACH = 3.5  # Noises (standard deviations of the camera) within which a pixel's colour is the same.
LEAST_SIGHTINGS = 3  # Fewest looks at a still pixel, whatever the frame rate.
# m and px: half width of the window in which colours on both sides of an edge are averaged. People and pictures of them
# in a background model have soft edges, as people sway.
BAND_M, LEAST_BAND = 0.1, 2
# Least share of the edge that borders on background. Without it, parts of people are mended away: 1 in 20 of the pixels
# mended in 12 videos were of people.
OPEN = 0.5
# Least ratio of the model's steps to the picture's. At 1 the scores are the same, but people who stand are mended away:
# 3200 px of them instead of 150 in 72 still pictures.
STEPS = 2.0
# Least share of pixels with one colour within BAND_M of a pixel that belongs to the surroundings. Single pixels of
# people who stand have one colour, too, where others hide the ground while they are away.
SURE = 0.7
LEAST_SURE = 0.5  # Least share of the image that belongs to the surroundings; with less, nothing is decided.
COVERED = 0.1  # A pixel of a coarser picture is known if more than this share of it is.


class Ghosts:
    """Finds ghosts in the foreground of a still camera, H x W px.

    State: colour (3, H, W), float32, the mean colour at gain 1 of each pixel since it last changed, grey levels;
    sightings (H, W), the looks at it since then; reach (3,), grey levels, the largest change that is noise.
    """

    def __init__(self, shape: tuple[int, ...], noise: Floats, fps: float) -> None:
        """noise (3,): standard deviation of the camera's noise per channel, grey levels; fps: frames per second."""
        self.reach = np.asarray(REACH * noise, np.float32)
        self.colour: Floats = np.zeros((3, *shape), np.float32)
        self.sightings: Floats = np.zeros(shape, np.float32)
        self._every = max(1, round(SIGHTING * fps))
        self._step = self._every / fps
        self._frames = 0

    def carry(self, step: Array) -> None:
        """Moves what was seen in the image by a homography `step` (3, 3), px."""
        size = self.sightings.shape[::-1]
        for plane in (*self.colour, self.sightings):
            plane[:] = cv2.warpPerspective(plane, step, size, flags=cv2.INTER_NEAREST)

    def find(
        self, image: Image, gain: Floats, mask: Bools, model: Floats, px_per_m: float, least: float
    ) -> Bools | None:
        """Adds a picture; returns the pixels (H, W) of ghosts with the unchanging pixels in a band round them, or None.

        It is None if there is no ghost, and in most frames, as only some are looked at. least: fewest pixels of one.
        """
        self._frames += 1
        if self._frames % self._every:
            return None
        background_kernels.watch(colour_planes(image), gain, self.reach, self.colour, self.sightings)
        still = self.sightings >= max(math.ceil(GHOST_TIME / self._step) + 1, LEAST_SIGHTINGS)
        regions = blobs.find(mask & still, least)
        band = max(round(BAND_M * px_per_m), LEAST_BAND)
        found = np.zeros(mask.shape, bool)
        for k in range(len(regions)):
            part = regions.window(k, 2 * band)
            region = regions.label[part] == k + 1
            if has_left(region, mask[part], model[:, *part], self.colour[:, *part], band):
                found[part] |= cv2.dilate(region.astype(np.uint8), blobs.disc(2 * band + 1)).astype(bool)
        return np.asarray(found & still) if found.any() else None


def has_left(region: Bools, mask: Bools, model: Floats, colour: Floats, band: int) -> bool:
    """Returns True if the background model has clear colour steps at the edge of a region, and the picture has not: the
    object of the model has left. region, mask (H, W); model, colour (3, H, W), grey levels; band: px."""
    edge = cv2.dilate(region.astype(np.uint8), blobs.disc(3)).astype(bool) & ~region
    border = edge & ~mask
    if np.count_nonzero(border) <= OPEN * np.count_nonzero(edge):
        return False
    of_model, of_picture = (steps(region, ~mask, planes, band)[border].sum() for planes in (model, colour))
    return bool(of_model >= STEPS * of_picture)


def steps(inside: Bools, outside: Bools, planes: Floats, band: int) -> Floats:
    """Returns at each pixel the difference (H, W) between the mean colours, near it, of the pixels `inside` and of
    those `outside`, in the colour channel where it is largest, grey levels. band: half width of "near", px."""
    means = [_means(planes, where.astype(np.float32), band) for where in (inside, outside)]
    return np.asarray(np.max(np.abs(means[0] - means[1]), axis=0), np.float32)


def _means(planes: Floats, where: Floats, band: int) -> Floats:
    size = (2 * band + 1, 2 * band + 1)
    count = np.maximum(cv2.boxFilter(where, -1, size, normalize=False), 1)
    return np.stack([cv2.boxFilter(plane * where, -1, size, normalize=False) / count for plane in planes])


def uncovered_in_sample(first: Floats, second: Floats, px_per_m: float) -> Bools:
    """Returns the pixels (H, W) whose second colour continues their surroundings better than the first.

    first, second (3, H, W): the two colours of a pixel in a background sample, the second nan if there is only one.
    """
    single = np.isnan(second[0])
    band = max(round(BAND_M * px_per_m), LEAST_BAND)
    size = (2 * band + 1, 2 * band + 1)
    sure = single & (cv2.boxFilter(single.astype(np.float32), -1, size) > SURE)
    if sure.mean() < LEAST_SURE:
        return np.zeros(sure.shape, bool)
    around = filled(first, sure)
    of_first, of_second = (np.where(single, 0, np.abs(colour - around).max(0)) for colour in (first, second))
    nearer = of_second < of_first
    first_sum, second_sum = (cv2.boxFilter(off * nearer, -1, size, normalize=False) for off in (of_first, of_second))
    return np.asarray(nearer & (first_sum >= STEPS * second_sum))


def filled(planes: Floats, known: Bools) -> Floats:
    """Returns planes (3, H, W) in which pixels that are not known have the mean colour of known pixels near them."""
    if known.all() or min(known.shape) < 2:
        return planes
    weight = known.astype(np.float32)
    share = cv2.pyrDown(weight)
    mean = np.stack([cv2.pyrDown(plane * weight) for plane in planes]) / np.maximum(share, 1e-6)
    coarse = filled(np.asarray(mean, np.float32), np.asarray(share > COVERED))
    wide = np.stack([cv2.pyrUp(plane, dstsize=known.shape[::-1]) for plane in coarse])
    return np.where(known, planes, wide)
