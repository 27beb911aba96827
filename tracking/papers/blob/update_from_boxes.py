"""The cascade of `blob` on boxes: gates (4.3), association (4.4), pieces, update (4.2), management (4.5).

Sections are those of Gonzalez et al. (2006); see tracking.papers.blob.tracker. z (M, 4): x, y, h, w in px, score (M,).
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Detections, Frame, Ints
from tracking import image_scale
from tracking.filters import kalman
from tracking.papers.blob import box_geometry
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.track_management import Population

INSIDE = 0.8  # share of a box within a track's predicted box from which on it may be a piece of that person


class Boxes:
    """From the boxes of each frame to the population's next state; holds the constants of its gates."""

    def __init__(self, config: BlobConfig, people: Population) -> None:
        self.people = people
        self.follow(config)

    def follow(self, config: BlobConfig) -> None:
        """Take on a config, which the population has taken on before."""
        from scipy.special import chdtri

        self.config = config
        self.noise, self.asymptote = self.people.noise, self.people.asymptote
        shares = 1 - np.array([config.gate, config.orphan_gate, config.confirm_gate])
        self.gate, self.orphan_gate, self.confirm_gate = chdtri(4, shares)  # d^2 at these shares (eq. 10)

    def step(self, frame: Frame, detections: Detections | None) -> None:
        """Predict, gate, associate, update, manage."""
        z, score = self._measurements(detections)
        people = self.people
        if len(z):
            image_scale.required(people.context.px_per_m)
        people.predict()
        people.look(z)
        rows, columns, free, d2 = self._associate(z, score)
        rows, columns = self._without_merged(rows, columns, z)
        rows, best, measured, free = self._with_pieces(rows, columns, free, z, score, d2)
        near = self._update(rows, measured)
        people.mark(rows, near <= self.confirm_gate, best)
        people.excuse()
        orphans = self._orphans(z, score, free)
        people.bury(frame.t)
        people.give_birth(z[orphans], score[orphans], frame.t)

    def reported(self, rows: Ints) -> Array:
        """(K, 4) boxes x, y, h, w of tracks, as they are told."""
        return self.people.uprights()[rows]

    def _measurements(self, detections: Detections | None) -> tuple[Array, Array]:
        if detections is None or detections.box is None or not len(detections.box):
            return np.zeros((0, 4)), np.zeros(0)
        box, score = detections.box, detections.score
        score = score if len(score) else np.ones(len(box))
        if score.min() < self.config.score_continue or box[:, 2:].min() <= 0:
            good = (score >= self.config.score_continue) & (box[:, 2:] > 0).all(1)
            box, score = box[good], score[good]
        return box_geometry.from_boxes(box), score

    def _associate(self, z: Array, score: Array) -> tuple[Ints, Ints, Bools, Array]:
        """Tracks and measurements (K,) that belong together, one to one; which measurements (M,) are free; distances
        d^2 (N, M) (eq. 9)."""
        people, free = self.people, np.ones(len(z), bool)
        if not len(z) or not len(people.id):
            return np.zeros(0, np.int64), np.zeros(0, np.int64), free, np.zeros((len(people.id), len(z)))
        d2 = kalman.distances(people.bank, z, self.noise, people.scale)
        cost = np.where(d2 <= self.gate, d2, np.inf)
        strong = score >= self.config.score_start
        if strong.all():
            rows, columns = people.pairs(cost, self.gate)
        else:
            rows, columns = people.pairs(np.where(strong, cost, np.inf), self.gate)
            more = self._weak_pairs(np.where(strong, np.inf, cost), rows)
            rows, columns = np.concatenate([rows, more[0]]), np.concatenate([columns, more[1]])
        free[columns] = False
        return rows, columns, free, d2

    def _weak_pairs(self, cost: Array, taken: Ints) -> tuple[Ints, Ints]:
        """Pairs of the weak measurements with tracks that are not taken; `nearest` knows no second choice."""
        if self.config.association == "optimal":
            cost[taken] = np.inf
            return self.people.pairs(cost, self.gate)
        rows, columns = self.people.pairs(cost, self.gate)
        open_rows = ~np.isin(rows, taken)
        return rows[open_rows], columns[open_rows]

    def _without_merged(self, rows: Ints, columns: Ints, z: Array) -> tuple[Ints, Ints]:
        """The pairs without boxes that are several people at once, which a blind track's wide gate would let in.

        Looked at are pairs whose size is far from the prediction by the measure of a track that is always seen.
        """
        people = self.people
        if len(rows) == len(people.id):
            return rows, columns
        y = (z.take(columns, 0) - people.bank[kalman.PLACE].take(rows, 0))[:, 2:] / people.scale[rows, None]
        odd = (y * y) @ (1 / self.asymptote[2:]) > self.gate
        if not odd.any():
            return rows, columns
        lost = people.confirmed.copy()
        lost[rows[~odd]] = False
        odd[odd] = people.merged(z[columns[odd]], lost)
        return rows[~odd], columns[~odd]

    def _with_pieces(
        self, rows: Ints, columns: Ints, free: Bools, z: Array, score: Array, d2: Array
    ) -> tuple[Ints, Array, Array, Bools]:
        """Measured tracks, their scores and measurements, with pieces fused; and what is still free.

        A piece lies in the gate of a measured track, or almost wholly inside a confirmed track's predicted box. Pieces
        update the track, with its own measurement if it has one, where the fused box is in the gate and nearer.
        """
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
            whole = box_geometry.fused(z[pieces])
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
        """(K,) the track of which each measurement is a piece, or -1; d2 (N, K) their distances."""
        people = self.people
        place, owner = people.bank[kalman.PLACE], np.full(len(pieces), -1)
        possible = box_geometry.inside(pieces, place) & people.confirmed
        if possible.any():
            near = possible.any(1).nonzero()[0]
            smaller = np.prod(pieces[near, 2:], 1)[:, None] < np.prod(place[:, 2:], 1)
            share = box_geometry.covered(pieces[near], place) * (possible[near] & smaller)
            owner[near] = np.where(share.max(1) >= INSIDE, share.argmax(1), -1)
        least = ((people.bank[kalman.VAR] + self.noise) / self.asymptote).min()  # of S / asymptote: d2 least <= away
        if len(rows) and d2.min() * least <= self.orphan_gate:
            y = (pieces[:, None] - place[rows]) / people.scale[rows, None]
            away = (y * y / self.asymptote).sum(2)
            owner = np.where(away.min(1) <= self.orphan_gate, rows[away.argmin(1)], owner)
        return np.asarray(owner)

    def _away(self, rows: Ints, measured: Array) -> Array:
        """(K,) squared distances (eq. 9) of tracks `rows` (K,) and their measurements (K, 4)."""
        people = self.people
        y = (measured - people.bank[kalman.PLACE, rows]) / people.scale[rows, None]
        return np.asarray((y * y / (people.bank[kalman.VAR, rows] + self.noise)).sum(1))

    def _update(self, rows: Ints, measured: Array) -> Array:
        """Update the measured tracks; returns each one's squared distance (K,)."""
        people = self.people
        terms = kalman.update(people.bank, rows, measured, self.noise)
        return np.asarray(np.add.reduce(terms, 1) / np.square(people.scale[rows]))

    def _orphans(self, z: Array, score: Array, free: Bools) -> Ints:
        """Strong measurements that nobody took, no piece of anybody, nor several unseen people at once."""
        left, people = (free & (score >= self.config.score_start)).nonzero()[0], self.people
        if not len(left):
            return left
        return np.asarray(left[~people.merged(z[left], people.confirmed & ~people.hit)])
