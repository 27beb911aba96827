"""One frame of `blob` from boxes: the cascade of Gonzalez et al. (2006) on a detector's boxes.

Order of a frame, with the paper's sections: predict (sec. 4.2, eqs 1, 2), gate (sec. 4.3, eqs 8 to 10), associate (sec.
4.4), fuse the pieces of one person (ours), update (sec. 4.2, eqs 3 to 7), manage the tracks (secs. 4.5, 5;
track_management). A measurement z is a centred box (x, y, h, w),
px, with a score from 0 to 1.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Detections, Frame, Ints
from tracking.filters import kalman
from tracking.papers.blob import box_geometry
from tracking.papers.blob.config import CONFIRM_GATE, BlobConfig
from tracking.papers.blob.track_management import TrackedPeople
from tracking.running import image_scale

INSIDE = 0.8  # share of a box that must lie in a larger predicted box to be a piece of that track's person


class BoxUpdater:
    """Updates the tracks of `people`, a table that must follow `config` already, from the boxes of each frame.

    State: people, the table of tracks; config; noise (4,): variance of a measurement of x, y, h, w, m^2; asymptote
    (4,): innovation variance S of a track measured in every frame, m^2; gate, orphan_gate, confirm_gate: largest d^2
    (squared Mahalanobis distance) at the config's shares.
    """

    def __init__(self, config: BlobConfig, people: TrackedPeople) -> None:
        self.people = people
        self.follow(config)

    def follow(self, config: BlobConfig) -> None:
        """Replace the config and compute the gates anew; `people` must follow the config already."""
        from scipy.special import chdtri

        self.config = config
        self.noise, self.asymptote = self.people.noise, self.people.asymptote
        shares = 1 - np.array([config.gate, config.orphan_gate, CONFIRM_GATE])
        self.gate, self.orphan_gate, self.confirm_gate = chdtri(4, shares)  # largest d^2 at these shares (eq. 10)

    def step(self, frame: Frame, detections: Detections | None) -> None:
        """Update the tracks with a frame's detections: predict, associate, update, confirm, delete, start."""
        z, score = self._measurements(detections)
        people = self.people
        if len(z):
            image_scale.required(people.px_per_m)
        people.predict()
        people.widen_view(z)
        rows, columns, free, d2 = self._associate(z, score)
        rows, columns = self._without_merged_boxes(rows, columns, z)
        rows, best, measured, free = self._with_pieces(rows, columns, free, z, score, d2)
        near = self._update(rows, measured)
        people.record_measured(rows, near <= self.confirm_gate, best)
        people.explain_misses()
        orphans = self._orphans(z, score, free)
        people.delete_tracks(frame.t)
        people.start_tracks(z[orphans], score[orphans], frame.t)

    def reported_boxes(self, rows: Ints) -> Array:
        """Returns the boxes (K, 4) that the tracker reports for the tracks at positions `rows` (K,): centre x, y,
        height, width, px."""
        return self.people.upright_boxes()[rows]

    def _measurements(self, detections: Detections | None) -> tuple[Array, Array]:
        if detections is None or detections.box is None or not len(detections.box):
            return np.zeros((0, 4)), np.zeros(0)
        box, score = detections.box, detections.score
        score = score if len(score) else np.ones(len(box))
        if score.min() < self.config.score_continue or box[:, 2:].min() <= 0:
            good = (score >= self.config.score_continue) & (box[:, 2:] > 0).all(1)
            box, score = box[good], score[good]
        return box_geometry.centred_from_ltwh(box), score

    def _associate(self, z: Array, score: Array) -> tuple[Ints, Ints, Bools, Array]:
        people, free = self.people, np.ones(len(z), bool)
        if not len(z) or not len(people.id):
            return np.zeros(0, np.int64), np.zeros(0, np.int64), free, np.zeros((len(people.id), len(z)))
        d2 = kalman.distances(people.bank, z, self.noise, people.scale)
        cost = np.where(d2 <= self.gate, d2, np.inf)
        strong = score >= self.config.score_start
        if strong.all():
            rows, columns = people.associate(cost, people.rho_log_det(), self.gate)
        else:
            rows, columns = people.associate(np.where(strong, cost, np.inf), people.rho_log_det(), self.gate)
            more = self._weak_pairs(np.where(strong, np.inf, cost), rows)
            rows, columns = np.concatenate([rows, more[0]]), np.concatenate([columns, more[1]])
        free[columns] = False
        return rows, columns, free, d2

    def _weak_pairs(self, cost: Array, taken: Ints) -> tuple[Ints, Ints]:
        if self.config.association == "optimal":
            cost[taken] = np.inf
            return self.people.associate(cost, self.people.rho_log_det(), self.gate)
        rows, columns = self.people.associate(cost, self.people.rho_log_det(), self.gate)
        open_rows = ~np.isin(rows, taken)
        return rows[open_rows], columns[open_rows]

    def _without_merged_boxes(self, rows: Ints, columns: Ints, z: Array) -> tuple[Ints, Ints]:
        people = self.people
        if len(rows) == len(people.id):
            return rows, columns
        y = (z.take(columns, 0) - people.bank[kalman.PLACE].take(rows, 0))[:, 2:] / people.scale[rows, None]
        odd = (y * y) @ (1 / self.asymptote[2:]) > self.gate
        if not odd.any():
            return rows, columns
        lost = people.confirmed.copy()
        lost[rows[~odd]] = False
        odd[odd] = people.cover_several(z[columns[odd]], lost)
        return rows[~odd], columns[~odd]

    def _with_pieces(
        self, rows: Ints, columns: Ints, free: Bools, z: Array, score: Array, d2: Array
    ) -> tuple[Ints, Array, Array, Bools]:
        people, measured, best = self.people, z[columns], score[columns]
        left = free.nonzero()[0]
        if not len(left) or not len(people.id):
            return rows, best, measured, free
        owner = self._owners(rows, z.take(left, 0), d2.take(left, 1))
        if owner.max() < 0:
            return rows, best, measured, free
        free[left[owner >= 0]] = False
        own = dict(zip(rows.tolist(), range(len(rows)), strict=True))
        for row in np.unique(owner[owner >= 0]).tolist():
            k = own.get(row)
            pieces = np.concatenate([columns[k : k + 1] if k is not None else [], left[owner == row]]).astype(np.int64)
            whole = box_geometry.fuse_pieces(z[pieces])
            limit = self.gate if k is None else self._away(np.array([row]), z[columns[k]][None])[0]
            if self._away(np.array([row]), whole[None])[0] >= limit:
                continue
            if k is None:
                rows, measured = np.append(rows, row), np.concatenate([measured, whole[None]])
                best = np.append(best, score[pieces].max())
            else:
                measured[k] = whole
        return rows, best, measured, free

    def _owners(self, rows: Ints, pieces: Array, d2: Array) -> Ints:
        people = self.people
        place, owner = people.bank[kalman.PLACE], np.full(len(pieces), -1)
        possible = box_geometry.points_inside(pieces, place) & people.confirmed
        if possible.any():
            near = possible.any(1).nonzero()[0]
            smaller = np.prod(pieces[near, 2:], 1)[:, None] < np.prod(place[:, 2:], 1)
            share = box_geometry.covered_share(pieces[near], place) * (possible[near] & smaller)
            owner[near] = np.where(share.max(1) >= INSIDE, share.argmax(1), -1)
        smallest = ((people.bank[kalman.VAR] + self.noise) / self.asymptote).min()  # S / asymptote; d2 * it <= away
        if len(rows) and d2.min() * smallest <= self.orphan_gate:
            y = (pieces[:, None] - place[rows]) / people.scale[rows, None]
            away = (y * y / self.asymptote).sum(2)
            owner = np.where(away.min(1) <= self.orphan_gate, rows[away.argmin(1)], owner)
        return np.asarray(owner)

    def _away(self, rows: Ints, measured: Array) -> Array:
        people = self.people
        y = (measured - people.bank[kalman.PLACE, rows]) / people.scale[rows, None]
        return np.asarray((y * y / (people.bank[kalman.VAR, rows] + self.noise)).sum(1))

    def _update(self, rows: Ints, measured: Array) -> Array:
        people = self.people
        terms = kalman.update(people.bank, rows, measured, self.noise)
        return np.asarray(np.add.reduce(terms, 1) / np.square(people.scale[rows]))

    def _orphans(self, z: Array, score: Array, free: Bools) -> Ints:
        left, people = (free & (score >= self.config.score_start)).nonzero()[0], self.people
        if not len(left):
            return left
        return np.asarray(left[~people.cover_several(z[left], people.confirmed & ~people.measured)])
