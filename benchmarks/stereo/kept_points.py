"""Points of `stereo` that several variants share: those whose image processing is the same get the same points.

Image processing knows nothing of groups. So its points are made once per sequence and set of its parameters, and the
tracks are the same as without sharing. `surface_offset` moves finished points. The training on a background sample is
shared, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from unittest import mock

from sim.types import Context, Image
from tracking.detect import background
from tracking.detect.background_training import train
from tracking.detect.features import SpacePoints
from tracking.papers.stereo import tracker
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.picture_points import PicturePoints, moved_away, stereo_camera

# Parameters that change no points, or move finished points.
TRACKING = frozenset({
    "gate", "velocity_weight", "point_covariance",
    "person_spread", "spread_weight", "spread_time", "accel_noise", "centroid_noise",
    "density_width", "radius", "point_radius", "group_points", "point_noise", "merge_gate", "split_time",
    "confirm_time", "coast_time", "surface_offset", "top_offset",
})  # fmt: skip


@contextmanager
def shared_points() -> Iterator[None]:
    """Shares points and training between all runs of `stereo` within the context, which are of one sequence."""
    known: dict[tuple[object, ...], list[SpacePoints]] = {}
    trained = {}

    class Kept:
        """In place of PicturePoints: makes the points at the first run, and returns those at the others."""

        def __init__(self, config: StereoConfig, context: Context) -> None:
            self.config, self.camera = config, stereo_camera(context.camera)
            key = tuple((name, value) for name, value in config.as_dict().items() if name not in TRACKING)
            still = replace(config, surface_offset=0.0)
            self.source = None if key in known else PicturePoints(still, context)
            self.made = known.setdefault(key, [])
            self.given = iter(self.made)

        def points(self, image: Image, right: Image) -> SpacePoints:
            if self.source is not None:
                self.made.append(self.source.points(image, right))
            return moved_away(next(self.given), self.camera, self.config.surface_offset)

    def once(sample, rate, follow_gain):  # type: ignore[no-untyped-def]
        if (rate, follow_gain) not in trained:
            trained[rate, follow_gain] = train(sample, rate, follow_gain)
        return trained[rate, follow_gain]

    with mock.patch.object(tracker, "PicturePoints", Kept), mock.patch.object(background, "train", once):
        yield
