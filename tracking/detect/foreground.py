"""The pipeline from a picture to foreground blobs that all trackers from pixels share.

For each picture, in this order:
    segment    classify each pixel (Gonzalez et al. 2006, 3.2), fuse the two foreground classes and clean them (3.3);
               the result is implausible if more of the image is foreground than people can cover (ours)
    ...        the tracker measures its people and says which pixels they cover (protected)
    adapt      the background model learns from all other pixels (ours)
The pipeline also learns the scale of the image and the size of people from the background sample, if no camera and no
scale are given (ours).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from sim.types import Array, Bools, Context, Image
from tracking.detect import blobs
from tracking.detect.background import Background, fused_foreground
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.mog2 import Mog2, Mog2Settings
from tracking.detect.person_size import PersonSize

LEAST_AREA, LEAST_PIXELS = 0.0125, 12.0
"""m^2 at the image's scale, and px: a blob that is smaller than either is noise."""
ASSUMED_HEIGHT = 18.0
"""m that the image is assumed to be high while its scale is unknown."""
SAMPLED = 25
"""About so many frames of the background sample are searched for people who stand alone."""


@dataclass(frozen=True, eq=False)
class Segmented:
    """One picture after `Foreground.segment`.

    image (H, W, 3): the picture. classes (H, W) uint8: of each pixel. mask (H, W): the cleaned foreground.
    plausible: False if more than most_foreground of the image is foreground; a light was switched or the camera moved.
    """

    image: Image
    classes: Image
    mask: Bools
    plausible: bool


class Foreground:
    """State: the background model (`model`) and the scale of the image (`px_per_m`; nan or 0 while unknown)."""

    def __init__(
        self,
        context: Context,
        settings: BackgroundSettings,
        most_foreground: float,
        segmentation: str = "horprasert",
    ) -> None:
        """Train the model on the context's background sample.

        most_foreground: largest plausible share of foreground. segmentation: "horprasert" (five classes) or "mog2".
        Raises InputError if the sample cannot be used; see `background_training.train`.
        """
        assert context.background is not None
        self.px_per_m = context.px_per_m
        self.most_foreground = most_foreground
        self.model: Background | Mog2
        if segmentation == "mog2":
            self.model = Mog2(context.background, context.fps, Mog2Settings.like(settings))
        else:
            self.model = Background(context.background, context.fps, settings)

    def follow(self, settings: BackgroundSettings, most_foreground: float) -> None:
        """Use other settings from now on; everything learned stays."""
        self.most_foreground = most_foreground
        if isinstance(self.model, Mog2):
            self.model.follow(Mog2Settings.like(settings))
        else:
            self.model.follow(settings)

    @property
    def shape(self) -> tuple[int, ...]:
        """(H, W) of the pictures, px."""
        return self.model.valid.shape

    @property
    def scale(self) -> float:
        """px per m; while the scale is unknown, that of an image ASSUMED_HEIGHT high."""
        return self.px_per_m if self.px_per_m > 0 else self.shape[0] / ASSUMED_HEIGHT

    def segment(self, image: Image) -> Segmented:
        """Returns the classes and the cleaned foreground of a picture (H, W, 3) BGR uint8 (3.2, 3.3).

        Raises InputError if the picture's size or dtype is not that of the background sample.
        """
        classes = self.model.classify(image)
        mask = blobs.clean(fused_foreground(classes), self.scale)
        return Segmented(image, classes, mask, not np.count_nonzero(mask) / mask.size > self.most_foreground)

    def adapt(self, seen: Segmented, protected: Bools) -> None:
        """Let the model learn from the last segmented picture, except where `protected` (H, W) is True."""
        self.model.adapt(seen.image, seen.classes, protected)

    def person_blobs(self, mask: Bools) -> blobs.Blobs:
        """Returns the blobs of a cleaned mask (H, W) that are large enough to be people (3.3), the largest first."""
        return blobs.find(mask, max(LEAST_AREA * self.scale**2, LEAST_PIXELS))

    def learn_person_size(self, size: PersonSize, sample: Image) -> None:
        """Let `size` learn from the blobs in a background sample (K, H, W, 3) that the image's edge does not cut."""
        for image in sample[:: max(len(sample) // SAMPLED, 1)]:
            found = self.person_blobs(self.segment(image).mask)
            size.learn(found.box, found.ellipse, ~found.cut())


def convex_areas(shape: tuple[int, ...], outlines: list[Array]) -> Bools:
    """Returns an (H, W) mask, True inside the convex hull of each outline (V, 2) px; `shape` is (H, W)."""
    inside = np.zeros(shape, np.uint8)
    for outline in outlines:
        cv2.fillConvexPoly(inside, cv2.convexHull(np.rint(outline).astype(np.int32)), 1)
    return inside.astype(bool)
