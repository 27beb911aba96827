"""`blob`: gates, association, a bank of Kalman filters and track management, on boxes or from pixels.

Gonzalez, Rowe, Andrade, Villanueva, "Efficient management of multiple agent tracking through observation handling",
2006. State per track: (x, x', y, y', h, h', w, w') in image px and s, its covariance in m and s, constant speed with
white acceleration (tracking.filters.kalman). The measurement is (x, y, h, w), a box's centre, height and width; a box
has no
axis, so the paper's angle, its ninth state, is measured from pixels only, by a blob's ellipse; h and w are then its
axes (tracking.papers.blob.update_from_pixels, with what is ours).

    predict    x = A x, P = A P A' + Q                                             (eqs 1, 2; tracking.filters.kalman)
    gate       z_pred = C A x, d^2 = (z - z_pred)' S^-1 (z - z_pred) <= q          (eqs 8, 9; d^2, not d, is chi2)
               q the quantile `gate` of chi2 of 4 degrees of freedom, 5 with the angle  (eq. 10)
    associate  each measurement to the nearest track in whose gate it lies         (4.4)
    update     y, S, K, x, P                                                       (eqs 3 to 7; tracking.filters.kalman)
    manage     rho = sqrt|S| / asymptote: confirm low, delete high      (4.5, 5; tracking.filters.track_uncertainty)

Departures, all ours:
- Persons only. Lengths are metres: a track's scale is px per metre, the longer side of its box being 1.7 m (half to
  twice the sequence's), so that near and far people have the same noise in metres; from straight above it is the
  camera's. Accelerations are densities.
- rho is that of x, y, h, w; the angle's S is no part of it.
- association = "optimal": one to one, least total cost d^2 + 2 ln rho, which is ln |S| in metres less a constant (a
  track that has long been blind pays for its wide gate). A track left out costs the gate + 2 ln rho where a track dies
  at the latest, whoever else there is, so that a pair in a gate, alone, is better than none.
- Of several measurements whose nearest track is the same one, the nearest updates it.
- A person in pieces: boxes in the orphan_gate of a measured track (as wide as that of a track always seen, so narrower
  than the gate: the paper has the gate), or inside the predicted box of a confirmed one, start no track; they are fused
  by moments where that fits better than one alone.
- A box that covers several confirmed tracks as a whole, an unseen one among them, starts no track; the unseen ones, and
  any that are hidden behind another person, may coast for merged_time rather than coast_time until measured again.
- Detections below score_start continue tracks but start none, and choose after the others (ByteTrack, Zhang et al.
  2022); under `nearest` each still knows only its nearest track.
- Reported are confirmed tracks, and measured tentative ones from report_delay on, until report_coast (hidden ones:
  report_hidden) after the last measurement, but no longer than report_credit times the time they were seen: a track
  that was hardly seen was mostly a false alarm. An unseen track is silent on its way out of view, and dies when its
  centre leaves the image, where its size is known.
"""

from __future__ import annotations

from typing import ClassVar, cast

import numpy as np

from sim.types import Context, Detections, Frame, Plane, Tracks
from tracking.filters import kalman
from tracking.papers.blob import box_geometry, report
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.ellipse_tracks import People
from tracking.papers.blob.track_management import Population
from tracking.papers.blob.update_from_boxes import Boxes
from tracking.papers.blob.update_from_pixels import Pixels


class Blob:
    """The tracker. State: the population (filters and what is known of each track), the cascade that feeds it."""

    needs: ClassVar[tuple[str, ...]] = ("pixels", "boxes")
    config_class: ClassVar[type[BlobConfig]] = BlobConfig

    def __init__(self, config: BlobConfig | None = None) -> None:
        self.config = config or BlobConfig()

    def reset(self, context: Context, seed: int) -> None:
        """Forget everything; with a background sample pixels will be tracked, else boxes. `seed` is unused."""
        c = self.config
        if context.image_size is None and context.background is not None:
            context = context.replace(image_size=context.background.shape[2:0:-1])
        self.context = context
        dynamics = c.dynamics(context.fps)
        self.people: Population
        self.cascade: Boxes | Pixels
        if context.background is None:
            self.people = Population(c, dynamics, context)
            self.cascade = Boxes(c, self.people)
        else:
            people = People(c, dynamics, context)
            self.people, self.cascade = people, Pixels(c, people, context)

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Predict, gate, associate, update, manage; a picture or boxes in, boxes out.

        `config` may have been replaced since the last frame: the tracks go on with the new one. InputError, and all is
        as it was, where it cannot be.
        """
        if self.config is not self.people.config:
            dynamics = self.config.dynamics(self.context.fps)
            self.people.follow(self.config, dynamics)
            self.cascade.follow(self.config)
        self.cascade.step(frame, detections)
        return self._report(frame)

    def _report(self, frame: Frame) -> Tracks:
        people = self.people
        rows = people.reported(frame.t)
        state, scale = people.bank.take(rows, 1), people.scale[rows]
        camera = self.context.camera
        place, alone = self.cascade.reported(rows), np.full(len(rows), -1)
        box = box_geometry.to_boxes(place)
        if camera is None:
            pos, vel = state[kalman.PLACE, :, :2].copy(), state[kalman.RATE, :, :2].copy()
            cov, plane = report.image_covariance(state, scale), "image"
        else:
            state[kalman.PLACE] = place
            pos, vel, cov, seen = report.on_ground(camera, state, scale)
            rows, box, alone, plane = rows[seen], box[seen], alone[seen], "ground"
        id, score = people.id[rows], people.score[rows]
        return Tracks(frame.index, frame.t, cast(Plane, plane), "person", id, alone, pos, vel, cov, box, score)
