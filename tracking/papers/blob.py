"""`blob`: gates, association, a bank of Kalman filters and track management on boxes.

Gonzalez, Rowe, Andrade, Villanueva, "Efficient management of multiple agent tracking through observation handling",
2006. State per track: (x, x', y, y', h, h', w, w') in image px, constant speed with white acceleration
(tracking.kalman). The measurement is (x, y, h, w), a box's centre, height and width; a box has no axis, so the paper's
angle rests until ellipses are measured.

    gate       d^2 = (z - z_pred)' S^-1 (z - z_pred) <= chi2_4(gate)              (eq. 9; d^2, not d)
    associate  each measurement to the nearest track in whose gate it lies         (4.4)
    manage     rho = sqrt|S| / asymptote: confirm low, delete high                 (4.5; tracking.lifecycle)

Departures, all ours:
- Lengths are metres. A track's scale is px per metre at its own size (half to twice the sequence's), so that near and
  far people have the same noise in metres; from straight above it is the camera's. Accelerations are densities.
- association = "optimal": least total cost d^2 + ln |S| (a track that has long been blind pays for its wide gate).
- Several measurements of one track (a person in pieces): the pieces are fused by moments where the fused box fits
  better than the best piece alone. A measurement left over starts no track in the gate of an updated track.
- A box that covers several unseen tracks as a whole starts no track; those tracks, and any that are hidden behind
  another person, may coast for merged_time rather than coast_time.
- Detections below score_start continue tracks but start none, and choose after the others (ByteTrack, Zhang et al.
  2022).
- Reported are confirmed tracks, and tentative ones from report_delay on, until report_coast (hidden ones:
  report_hidden) after the last measurement. An unseen track dies when its centre leaves the image.
"""

from __future__ import annotations

from typing import ClassVar, cast

import numpy as np

from sim.types import Array, Context, Detections, Frame, Ints, Plane, Tracks
from tracking import assign, kalman
from tracking.papers import blob_measure, blob_report
from tracking.papers.blob_config import BlobConfig
from tracking.papers.blob_tracks import Population


class Blob:
    """The tracker. State: the population (filters and what is known of each track) and the constants of `reset`."""

    needs: ClassVar[tuple[str, ...]] = ("boxes",)
    config_class: ClassVar[type[BlobConfig]] = BlobConfig

    def __init__(self, config: BlobConfig | None = None) -> None:
        self.config = config or BlobConfig()

    def reset(self, context: Context, seed: int) -> None:
        """Forget everything; `seed` is unused, nothing here is random."""
        from scipy.special import chdtri

        c = self.config
        self.context = context
        self.dynamics = c.dynamics(context.fps)
        self.noise, self.asymptote, self.q = self.dynamics.noise, self.dynamics.asymptote, self.dynamics.q
        shares = 1 - np.array([c.gate, c.orphan_gate, c.confirm_gate])
        self.gate, self.orphan_gate, self.confirm_gate = chdtri(4, shares)
        self.people = Population(c, self.dynamics, context)

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Predict, gate, associate, update, manage; boxes in, boxes out."""
        z, score = self._measurements(detections)
        people = self.people
        people.predict()
        rows, columns, spare = self._associate(z, score)
        near = self._update(rows, columns, spare, z)
        people.mark(rows, near <= self.confirm_gate, score[columns])
        orphans = self._orphans(z, score, columns)
        people.excuse()
        orphans = orphans[~people.merged(z[orphans])]
        people.bury(frame.t)
        people.give_birth(z[orphans], score[orphans], frame.t)
        return self._report(frame)

    def _measurements(self, detections: Detections | None) -> tuple[Array, Array]:
        if detections is None or detections.box is None or not len(detections.box):
            return np.zeros((0, 4)), np.zeros(0)
        box, score = detections.box, detections.score
        score = score if len(score) else np.ones(len(box))
        good = (score >= self.config.score_continue) & (box[:, 2:] > 0).all(1)
        return blob_measure.from_boxes(box[good]), score[good]

    def _associate(self, z: Array, score: Array) -> tuple[Ints, Ints, list[tuple[int, int]]]:
        """Tracks and measurements that belong together, one to one, and spare pieces as (track, measurement)."""
        people = self.people
        if not len(z) or not len(people.id):
            none = np.zeros(0, np.int64)
            return none, none, []
        d2 = kalman.distances(people.bank, z, self.noise, people.scale)
        cost = np.where(d2 <= self.gate, d2, np.inf)
        strong = score >= self.config.score_start
        if strong.all():
            return self._pairs(cost)
        first = self._pairs(np.where(strong, cost, np.inf))
        cost[first[0]] = np.inf
        cost[:, strong] = np.inf
        second = self._pairs(cost)
        rows, columns = (np.concatenate([first[i], second[i]]) for i in (0, 1))
        return rows, columns, first[2] + second[2]

    def _pairs(self, cost: Array) -> tuple[Ints, Ints, list[tuple[int, int]]]:
        if self.config.association == "optimal":
            blind = 2 * np.log(self.people.rho)
            rows, columns = assign.optimal(cost + blind[:, None], self.gate + blind.max())
            return rows, columns, self._gated_spares(cost, rows, columns)
        pairs = assign.nearest(cost)
        rows, columns, spare_rows, spare_columns = blob_measure.best_pieces(*pairs, cost)
        return rows, columns, list(zip(spare_rows.tolist(), spare_columns.tolist(), strict=True))

    def _gated_spares(self, cost: Array, rows: Ints, columns: Ints) -> list[tuple[int, int]]:
        """Measurements left over, each with the assigned track in whose gate it is deepest."""
        if len(columns) == cost.shape[1] or not len(rows):
            return []
        left = np.ones(cost.shape[1], bool)
        left[columns] = False
        r, c = assign.nearest(cost[rows][:, left])
        return list(zip(rows[r].tolist(), np.flatnonzero(left)[c].tolist(), strict=True))

    def _update(self, rows: Ints, columns: Ints, spare: list[tuple[int, int]], z: Array) -> Array:
        """Update the measured tracks, with pieces fused; returns each one's squared distance (K,)."""
        people = self.people
        measured = z[columns]
        place, s = people.bank[kalman.PLACE][rows], people.bank[kalman.VAR][rows] + self.noise
        s = s * np.square(people.scale[rows])[:, None]
        distance = np.sum((measured - place) ** 2 / s, 1)
        for row in sorted({row for row, _ in spare}):
            k = int(np.flatnonzero(rows == row)[0])
            pieces = [columns[k]] + [column for other, column in spare if other == row]
            whole = blob_measure.fused(z[pieces])
            away = float(np.sum((whole - place[k]) ** 2 / s[k]))
            if away < distance[k]:
                measured[k], distance[k] = whole, away
        kalman.update(people.bank, rows, measured, self.noise)
        return np.asarray(distance)

    def _orphans(self, z: Array, score: Array, columns: Ints) -> Ints:
        """Strong measurements that no track took and that lie in nobody's gate, the gates taken after the update."""
        free = score >= self.config.score_start
        free[columns] = False
        left = np.flatnonzero(free)
        if not len(left) or not len(self.people.id):
            return left
        people = self.people
        y = z[left][None] - people.bank[kalman.PLACE][people.hit][:, None]
        s = self.asymptote * np.square(people.scale[people.hit])[:, None]
        d2 = np.sum(y * y / s[:, None], 2)
        return np.asarray(left[~(d2 <= self.orphan_gate).any(0)])

    def _report(self, frame: Frame) -> Tracks:
        people = self.people
        rows = np.flatnonzero(people.reported(frame.t))
        state, scale = people.bank[:, rows], people.scale[rows]
        camera = self.context.camera
        box, alone = blob_measure.to_boxes(state[kalman.PLACE]), np.full(len(rows), -1)
        if camera is None:
            pos, vel = state[kalman.PLACE, :, :2].copy(), state[kalman.RATE, :, :2].copy()
            cov, plane = blob_report.image_covariance(state, scale), "image"
        else:
            pos, vel, cov, seen = blob_report.on_ground(camera, state, scale)
            rows, box, alone, plane = rows[seen], box[seen], alone[seen], "ground"
            pos, vel, cov = pos[seen], vel[seen], cov[seen]
        id, score = people.id[rows], people.score[rows]
        return Tracks(frame.index, frame.t, cast(Plane, plane), "person", id, alone, pos, vel, cov, box, score)
