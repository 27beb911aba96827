"""From a picture to the detections of trackers of points: each foreground blob, or piece of one, is one detection.

The foreground comes from tracking.detect.foreground. A blob that holds several people is one detection, so people who
share a blob are missed but for one, unless blobs are divided (tracking.detect.divided_blobs).
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Context, Detections, Frame
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.divided_blobs import divided
from tracking.detect.foreground import Foreground, convex_areas
from tracking.detect.person_size import PersonSize
from tracking.running.image_scale import required


class ForegroundBlobs:
    """Foreground blobs as detections in the image.

    State: settings; foreground, the pipeline with its background model; size: of a person at each place, from the
    camera or learned from lone people in the background sample, if blobs are divided, else None. scale: px per metre,
    the context's, or, if that is nan, learned from lone people.

    The context must have a background sample (else AssertionError). Raises InputError if the scale is neither known nor
    learned, if it is zero or negative, or if the sample cannot be used.
    """

    def __init__(self, settings: BackgroundSettings, context: Context, divide: bool = False) -> None:
        """Train the background model; divide: blobs of several people are divided (tracking.detect.divided_blobs)."""
        assert context.background is not None
        self.settings = settings
        self.foreground = Foreground(context, settings)
        self.size: PersonSize | None = None
        if divide or np.isnan(context.px_per_m):
            size = PersonSize(context)
            self.foreground.learn_person_size(size, context.background)
            self.size = size if divide else None
            if np.isnan(context.px_per_m):
                self.foreground.px_per_m = size.px_per_m
        self.scale = self.foreground.px_per_m = required(self.foreground.px_per_m)

    def follow(self, settings: BackgroundSettings) -> None:
        """Replace the settings of the background model; what the model learned and the scale stay."""
        self.settings = settings
        self.foreground.follow(settings)

    def detections(self, frame: Frame, people: Array) -> Detections | None:
        """Returns the blobs of the frame's picture as detections; None without a picture, or if too much of it is
        foreground."""
        if frame.image is None:
            return None
        seen = self.foreground.segment(frame.image)
        corners = [box[:2] + box[2:] * np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) for box in people]
        self.foreground.adapt(seen, convex_areas(self.foreground.shape, corners))
        if not seen.plausible:
            return None
        found = self.foreground.person_blobs(seen.mask)
        box = found.box if self.size is None else divided(found, people, self.size)
        centre = box[:, :2] + box[:, 2:] / 2
        return Detections(frame.index, frame.t, "image", centre, None, box, np.ones(len(box)))
