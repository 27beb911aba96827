"""`blob`: gates, association, a bank of Kalman filters and track management on boxes.

Gonzalez, Rowe, Andrade, Villanueva, "Efficient management of multiple agent tracking through observation handling",
2006. State per track: (x, x', y, y', h, h', w, w') in image px, its covariance in m^2, constant speed with white
acceleration (tracking.kalman). The measurement is (x, y, h, w), a box's centre, height and width; a box has no axis, so
the paper's angle rests until ellipses are measured.

    gate       d^2 = (z - z_pred)' S^-1 (z - z_pred) <= chi2_4(gate)              (eq. 9; d^2, not d)
    associate  each measurement to the nearest track in whose gate it lies         (4.4)
    manage     rho = sqrt|S| / asymptote: confirm low, delete high                 (4.5; tracking.lifecycle)

Departures, all ours:
- Persons only. Lengths are metres: a track's scale is px per metre, the longer side of its box being 1.7 m (half to
  twice the sequence's), so that near and far people have the same noise in metres; from straight above it is the
  camera's. Accelerations are densities.
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

from sim.types import Array, Bools, Context, Detections, Frame, Ints, Plane, Tracks
from tracking import assign, kalman
from tracking.papers import blob_measure, blob_report
from tracking.papers.blob_config import BlobConfig
from tracking.papers.blob_tracks import Population

INSIDE = 0.8  # share of a box within a track's predicted box from which on it may be a piece of that person


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
        self.blindest = 2 * float(np.log(max(self.people.excused_death, self.people.birth_rho)))

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Predict, gate, associate, update, manage; boxes in, boxes out."""
        z, score = self._measurements(detections)
        people = self.people
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
        return self._report(frame)

    def _measurements(self, detections: Detections | None) -> tuple[Array, Array]:
        if detections is None or detections.box is None or not len(detections.box):
            return np.zeros((0, 4)), np.zeros(0)
        box, score = detections.box, detections.score
        score = score if len(score) else np.ones(len(box))
        if score.min() < self.config.score_continue or box[:, 2:].min() <= 0:
            good = (score >= self.config.score_continue) & (box[:, 2:] > 0).all(1)
            box, score = box[good], score[good]
        return blob_measure.from_boxes(box), score

    def _associate(self, z: Array, score: Array) -> tuple[Ints, Ints, Bools, Array]:
        """Tracks and measurements that belong together, one to one; which measurements (M,) are free; distances."""
        people, free = self.people, np.ones(len(z), bool)
        if not len(z) or not len(people.id):
            return np.zeros(0, np.int64), np.zeros(0, np.int64), free, np.zeros((len(people.id), len(z)))
        d2 = kalman.distances(people.bank, z, self.noise, people.scale)
        cost = np.where(d2 <= self.gate, d2, np.inf)
        strong = score >= self.config.score_start
        if strong.all():
            rows, columns = self._pairs(cost)
        else:
            rows, columns = self._pairs(np.where(strong, cost, np.inf))
            more = self._weak_pairs(np.where(strong, np.inf, cost), rows)
            rows, columns = np.concatenate([rows, more[0]]), np.concatenate([columns, more[1]])
        free[columns] = False
        return rows, columns, free, d2

    def _pairs(self, cost: Array) -> tuple[Ints, Ints]:
        if self.config.association == "nearest":
            return blob_measure.best_pieces(*assign.nearest(cost), cost)
        blind = np.minimum(2 * np.log(self.people.rho), self.blindest)
        return assign.optimal(cost + blind[:, None], self.gate + self.blindest)

    def _weak_pairs(self, cost: Array, taken: Ints) -> tuple[Ints, Ints]:
        """Pairs of the weak measurements with tracks that are not taken; `nearest` knows no second choice."""
        if self.config.association == "optimal":
            cost[taken] = np.inf
            return self._pairs(cost)
        rows, columns = self._pairs(cost)
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
            whole = blob_measure.fused(z[pieces])
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
        possible = blob_measure.inside(pieces, place) & people.confirmed
        if possible.any():
            near = possible.any(1).nonzero()[0]
            smaller = np.prod(pieces[near, 2:], 1)[:, None] < np.prod(place[:, 2:], 1)
            share = blob_measure.covered(pieces[near], place) * (possible[near] & smaller)
            owner[near] = np.where(share.max(1) >= INSIDE, share.argmax(1), -1)
        least = ((people.bank[kalman.VAR] + self.noise) / self.asymptote).min()  # of S / asymptote: d2 least <= away
        if len(rows) and d2.min() * least <= self.orphan_gate:
            y = (pieces[:, None] - place[rows]) / people.scale[rows, None]
            away = (y * y / self.asymptote).sum(2)
            owner = np.where(away.min(1) <= self.orphan_gate, rows[away.argmin(1)], owner)
        return np.asarray(owner)

    def _away(self, rows: Ints, measured: Array) -> Array:
        """(K,) squared distances of tracks and their measurements."""
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

    def _report(self, frame: Frame) -> Tracks:
        people = self.people
        rows = people.reported(frame.t)
        state, scale = people.bank.take(rows, 1), people.scale[rows]
        camera = self.context.camera
        box, alone = blob_measure.to_boxes(state[kalman.PLACE]), np.full(len(rows), -1)
        if camera is None:
            pos, vel = state[kalman.PLACE, :, :2].copy(), state[kalman.RATE, :, :2].copy()
            cov, plane = blob_report.image_covariance(state, scale), "image"
        else:
            pos, vel, cov, seen = blob_report.on_ground(camera, state, scale)
            rows, box, alone, plane = rows[seen], box[seen], alone[seen], "ground"
        id, score = people.id[rows], people.score[rows]
        return Tracks(frame.index, frame.t, cast(Plane, plane), "person", id, alone, pos, vel, cov, box, score)
