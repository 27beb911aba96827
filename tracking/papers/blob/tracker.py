"""`blob`: people tracked from boxes, from pixels or from both by a bank of Kalman filters with track management.

Gonzalez, Rowe, Andrade, Villanueva, "Efficient management of multiple agent tracking through observation handling",
2006. docs/trackers/blob.md has the state, the equations with their modules, and the departures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, cast

import numpy as np

from sim.types import Context, Detections, Frame, Plane, Tracks
from tracking.filters import kalman
from tracking.papers.blob import box_geometry
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.tracked_people import TrackedPeople
from tracking.papers.blob.tracked_people_kernels import image_covariance
from tracking.papers.blob.update_from_boxes import BoxUpdater

if TYPE_CHECKING:
    from tracking.papers.blob.update_from_pixels import PixelUpdater


class Blob:
    """The tracker `blob`: people tracked from pixels if the context has a background sample, and from boxes.

    Made from a BlobConfig; None: the defaults. State: config, a BlobConfig, which may be replaced between two frames;
    people, the table of tracks; updater, which updates the table from boxes, or from pixels and boxes; context, of the
    sequence. All but config exist after `reset` only.
    """

    needs: ClassVar[tuple[str, ...]] = ("pixels", "boxes", "pixels and boxes")
    config_class: ClassVar[type[BlobConfig]] = BlobConfig

    def __init__(self, config: BlobConfig | None = None) -> None:
        self.config = config or BlobConfig()

    def reset(self, context: Context, seed: int) -> None:
        """Deletes all tracks and starts a sequence, from pixels, and boxes if there are any, if the context has a
        background sample, else from boxes alone.

        Ids begin at 1 again. `seed` is not used. If the image's size is unknown, it is taken from the background
        sample. From pixels, raises InputError if the sample has a wrong shape or dtype, too few frames or shows no
        background, or if the scale px_per_m is zero or negative (nan: it is learned).
        """
        c = self.config
        if context.image_size is None and context.background is not None:
            context = context.replace(image_size=context.background.shape[2:0:-1])
        self.context = context
        dynamics = c.dynamics(context.fps)
        self.people: TrackedPeople
        self.updater: BoxUpdater | PixelUpdater
        if context.background is None:
            self.people = TrackedPeople(c, dynamics, context)
            self.updater = BoxUpdater(c, self.people)
        else:
            from tracking.papers.blob.ellipse_tracks import TrackedEllipses
            from tracking.papers.blob.update_from_pixels import PixelUpdater

            people = TrackedEllipses(c, dynamics, context)
            self.people, self.updater = people, PixelUpdater(c, people, context)

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Returns the tracks to report after a frame, unit "person", each `group` -1; updates all tracks.

        They are boxes in the image (plane "image", px). With a camera they are on the ground (plane "ground", m) with
        boxes, and a track above the horizon is left out. detections: None is a frame at which no detector looked. A
        frame without image, or with too much foreground, has no measurement from pixels. If `config` was replaced since
        the last frame, all tracks go on with the new one.

        Raises InputError if the picture's size or dtype is not the background sample's, or if there are boxes and the
        scale px_per_m is unknown, zero or negative.
        """
        if self.config is not self.people.config:
            self.people.follow(self.config, self.config.dynamics(self.context.fps))
            self.updater.follow(self.config)
        self.updater.step(frame, detections)
        camera, every = self.context.camera, np.arange(len(self.people.id))
        if camera is not None:
            self.people.place_on_ground(camera, self.updater.reported_boxes(every))
        found = self._report(frame)
        return (
            found
            if self.context.background is None
            else cast("PixelUpdater", self.updater).foreground.in_picture(found)
        )

    @property
    def camera_moves(self) -> bool:
        """True if the camera was found to move, so that a place in the picture is no place on the ground."""
        return self.updater.camera_moves

    def _report(self, frame: Frame) -> Tracks:
        people = self.people
        rows = people.rows_to_report()
        state, scale = people.bank.take(rows, 1), people.scale[rows]
        box, alone = box_geometry.ltwh_from_centred(self.updater.reported_boxes(rows)), np.full(len(rows), -1)
        if self.context.camera is None:
            pos, vel = state[kalman.PLACE, :, :2].copy(), state[kalman.RATE, :, :2].copy()
            cov, plane = image_covariance(state, scale), "image"
        else:
            shown = np.isfinite(people.stand[rows]).all(1)
            rows, box, alone, plane = rows[shown], box[shown], alone[shown], "ground"
            pos, vel, cov = people.stand[rows, :2], people.stand[rows, 2:4], people.stand_cov[rows, :4, :4]
        id, score, seen = people.id[rows], people.score[rows], people.measured[rows]
        return Tracks(
            frame.index, frame.t, cast(Plane, plane), "person", id, alone, pos, vel, cov, box, score, seen=seen
        )
