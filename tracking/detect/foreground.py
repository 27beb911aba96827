"""The pipeline from a picture to foreground blobs that all trackers from pixels share.

For each picture, in this order:
    segment    average noisy pictures over small windows (smoothing, ours);
               classify each pixel (Gonzalez et al. 2006, sec. 3.2), fuse the foreground classes, clean them (sec. 3.3);
               where the background adapts, the result is implausible if more of the image is foreground than people
               can cover (ours)
    ...        the tracker measures its people and says which pixels they cover (protected)
    adapt      the background model learns from all other pixels (ours)
From the background sample the pipeline also learns the size of people, and the scale of the image if none is given
(ours).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from sim.types import Array, Bools, Context, Image
from tracking.detect import blobs
from tracking.detect.background import Background, fused_foreground
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.ghosts import Ghosts, uncovered_in_sample
from tracking.detect.person_size import PersonSize
from tracking.detect.picture_check import PictureCheck
from tracking.detect.smoothing import independent_noise, smoothed, window

# m^2 at the image's scale, and px: a blob that is smaller than either is noise.
LEAST_AREA, LEAST_PIXELS = 0.0125, 12.0
ASSUMED_HEIGHT = 18.0  # m that the image is assumed to be high while its scale is unknown.
MOST_FOREGROUND = 0.6  # Share of the image: a frame with more foreground is not measured (ours).
SAMPLED = 25  # About so many frames of the background sample are searched for people who stand alone.


@dataclass(frozen=True, eq=False)
class Segmented:
    """One picture of H x W px after `Foreground.segment`.

    image (H, W, 3): the picture, BGR uint8, smoothed if the background sample is noisy. classes (H, W) uint8: class of
    each pixel: 0 BACKGROUND, 1 FOREGROUND, 2 DARK (dark foreground), 3 SHADOW, 4 HIGHLIGHT. mask (H, W) bool: the
    foreground (1 and 2) after cleaning. plausible: False if the background adapts and a share of the mask above
    MOST_FOREGROUND = 0.6 is foreground: then a light was switched or the camera moved.
    """

    image: Image
    classes: Image
    mask: Bools
    plausible: bool


class Foreground:
    """The pipeline from a picture to foreground blobs: classify the pixels, clean the mask, find blobs, adapt.

    State: model, the background model; window, side of the window (px) over which pictures are averaged, 1: none;
    check, which warns of pictures that cannot be measured; px_per_m, the scale of the image: the context's, or, if that
    is nan, learned from lone people, nan until then. Raises InputError for an unusable background sample,
    AssertionError for none.
    """

    def __init__(self, context: Context, settings: BackgroundSettings) -> None:
        """Trains the background model on the context's background sample, which must not be None (AssertionError).

        Raises InputError if the sample has a wrong shape or dtype, fewer than 10 frames or shows too little background.
        """
        assert context.background is not None
        self.px_per_m, self._learns = context.px_per_m, bool(np.isnan(context.px_per_m))
        self.window = window(independent_noise(context.background)) if settings.adaptive else 1
        sample = context.background
        if self.window > 1:
            sample = np.stack([smoothed(image, self.window) for image in sample])
        self.model = Background(sample, context.fps, settings)
        self.check, self._complete = PictureCheck(), True
        self.ghosts = Ghosts(self.shape, self.model.noise(), context.fps) if settings.adaptive else None
        if settings.adaptive:
            self.model.mend(uncovered_in_sample(self.model.mean, self.model.second, self.scale), self.model.second)

    def follow(self, settings: BackgroundSettings) -> None:
        """Replaces the settings of the background model; what the model learned stays."""
        self.model.follow(settings)

    @property
    def shape(self) -> tuple[int, ...]:
        """(H, W): height and width of the pictures, px."""
        return self.model.valid.shape

    @property
    def scale(self) -> float:
        """Scale of the image, px per m. While it is unknown: that of an image that is ASSUMED_HEIGHT = 18 m high."""
        return self.px_per_m if self.px_per_m > 0 else self.shape[0] / ASSUMED_HEIGHT

    @property
    def least_area(self) -> float:
        """Least area, in pixels, of a blob that may be a person or a part of one."""
        return max(LEAST_AREA * self.scale**2, LEAST_PIXELS)

    def segment(self, image: Image) -> Segmented:
        """Returns the pixel classes and the cleaned foreground mask of a picture (H, W, 3) BGR uint8 (secs. 3.2, 3.3).

        The background model does not learn from the picture; only its estimate of the picture's brightness changes.
        Raises InputError if the picture's size or dtype is not that of the background sample.
        """
        image = smoothed(image, self.window)
        classes = self.model.classify(image)
        mask = blobs.clean(fused_foreground(classes), self.scale)
        flooded = self.model.settings.adaptive and np.count_nonzero(mask) / mask.size > MOST_FOREGROUND
        return Segmented(image, classes, mask, not flooded)

    def adapt(self, seen: Segmented, protected: Bools) -> None:
        """Lets the background model learn from a segmented picture, except at pixels where `protected` (H, W) is True.

        seen: the result of the last `segment`, as that call also set the brightness of the model. Each call changes
        every fourth row. Ghosts are replaced also where `protected` is True, but not in an implausible picture.
        """
        self.model.adapt(seen.image, seen.classes, protected)
        self.check.add(seen.plausible, self._complete, self.model.noise)
        if seen.plausible and self.ghosts is not None:
            model = self.model
            found = self.ghosts.find(seen.image, model.gain, seen.mask, model.mean, self.scale, self.least_area)
            if found is not None:
                model.mend(found, self.ghosts.colour)

    def person_blobs(self, mask: Bools) -> blobs.Blobs:
        """Returns the blobs of a cleaned mask (H, W) bool that are large enough to be people or parts of them, the
        largest first.

        They have at least 0.0125 m^2 at the image's scale, and at least 12 pixels (sec. 3.3). No such blob gives 0
        rows; of more than 500 the largest are returned.
        """
        found = blobs.find(mask, self.least_area)
        self._complete = len(found) < blobs.MOST
        return found

    def learn_person_size(self, size: PersonSize, sample: Image) -> None:
        """Lets `size` learn, in place, from the blobs of a background sample (K, H, W, 3) BGR uint8.

        All frames of fewer than 50 are used, else 25 to 37 evenly spaced ones. Blobs that the image's edge cuts are
        left out; `size` itself chooses those that may be one person. The model's estimate of brightness changes. Raises
        InputError if the size or dtype of the frames is not that of the model's own sample.
        """
        for image in sample[:: max(len(sample) // SAMPLED, 1)]:
            found = self.person_blobs(self.segment(image).mask)
            size.learn(found.box, found.ellipse, ~found.cut())
        self.take_scale(size)

    def take_scale(self, size: PersonSize) -> None:
        """Takes the scale that `size` has learned, if the context has none."""
        if self._learns:
            self.px_per_m = size.px_per_m


def convex_areas(shape: tuple[int, ...], outlines: list[Array]) -> Bools:
    """Returns an (H, W) bool mask, True inside and on the convex hull of each outline."""
    inside = np.zeros(shape, np.uint8)
    for outline in outlines:
        cv2.fillConvexPoly(inside, cv2.convexHull(np.rint(outline).astype(np.int32)), 1)
    return inside.astype(bool)
