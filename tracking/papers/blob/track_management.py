"""The tracks of `blob`: their filters, ages and marks, and who is born, excused, reported and buried."""

from __future__ import annotations

import numpy as np

from sim.scene.body import PERSON_HEIGHT
from sim.types import Array, Bools, Context, Ints
from tracking.filters import assignment, kalman, track_uncertainty
from tracking.papers.blob import box_geometry
from tracking.papers.blob.config import BlobConfig

HIDDEN = 0.4  # share of a predicted box behind somebody else from which on a miss is explained
SAME = 0.5  # IoU of a box with the hull of several predicted ones from which on it is taken for them all
# Relative, of rho at death (earlier) and silence (later): filters near their steady state count as in it. With the
# default noises a miss adds more than this up to 60 fps; beyond that the times are off by a frame or two.
SLACK = 0.02


class Population:
    """N tracks as arrays; rows of two tables, so that births and deaths touch few arrays.

    bank (5, N, 4): tracking.filters.kalman, places in px, covariances in m^2. scale (N,) px per m. rho (N,) at the last
    prediction. id, born (s), score; confirmed; hit: measured in this frame; excused: found unseen with
    somebody else as the reason, until it is measured again.
    hits, misses: frames measured in all, and since then. low, high (2,) px: the field of view.
    """

    def __init__(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics, context: Context) -> None:
        self.context = context
        self.top = context.camera is not None and context.camera.kind == "top"
        self.low, self.high = np.full(2, np.inf), np.full(2, -np.inf)
        self.bank, self.id, self.next_id = np.zeros((5, 0, 4)), np.zeros(0, np.int64), 1
        self._bind(np.zeros((6, 0)), np.zeros((3, 0), bool))
        self.follow(config, dynamics)

    def follow(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics) -> None:
        """Take on a config and the nominal filter that follows from it; the tracks stay as they are."""
        self.config, self.dynamics = config, dynamics
        self.q, self.noise, self.asymptote = dynamics.q, dynamics.noise, dynamics.asymptote
        self.birth_rho = track_uncertainty.at_birth(dynamics)
        self.tentative = max(config.tentative_time, track_uncertainty.time_to_confirm(dynamics, config.confirm_ratio))
        self.death = self._after(config.coast_time)
        self.excused_death = max(self.death, self._after(config.merged_time))
        self.blindest = 2 * float(np.log(max(self.excused_death, self.birth_rho)))
        self.silence = self._after(config.report_coast)
        self.excused_silence = max(self.silence, self._after(config.report_hidden))

    def _bind(self, book: Array, flags: Bools) -> None:
        """Name the rows of the two tables; whoever changes one writes in place."""
        self.book, self.flags = book, flags
        self.scale, self.rho, self.born, self.score, self.hits, self.misses = book
        self.confirmed, self.hit, self.excused = flags

    def _after(self, seconds: float) -> float:
        """rho in the frame that ends so many seconds without measurement, from the steady state: sooner otherwise."""
        frames = int(np.ceil(seconds * self.context.fps - 1e-6))
        return track_uncertainty.after_misses(self.dynamics, frames - 1)

    def predict(self) -> None:
        """One frame on."""
        kalman.predict(self.bank, self.dynamics.dt, self.q)
        self.rho[:] = self.quality()

    def quality(self) -> Array:
        """(N,) rho: how sure of itself each filter is."""
        return track_uncertainty.rho(self.bank, self.noise, self.asymptote)

    def uprights(self) -> Array:
        """(N, 4) predicted boxes: centre x, y, height, width."""
        return np.asarray(self.bank[kalman.PLACE])

    def mark(self, rows: Ints, near: Bools, score: Array) -> None:
        """Note who was measured (near: well enough to be confirmed), and confirm."""
        self.hit[:] = False
        self.hit[rows] = True
        self.hits += self.hit
        self.misses += 1
        self.misses[rows] = 0
        self.excused[rows] = False
        self.score[rows] = score
        self.confirmed[rows] |= near & (self.rho[rows] <= self.config.confirm_ratio)
        self.scale[:] = self._scale_of(self.bank[kalman.PLACE])

    def _scale_of(self, place: Array) -> Array:
        """px per m at a person of this size, half to twice the sequence's; from straight above the camera's own."""
        whole = self.context.px_per_m
        if self.top:
            return np.full(len(place), whole)
        size = np.maximum(place[:, 2], place[:, 3]) / PERSON_HEIGHT
        return np.asarray(np.minimum(np.maximum(size, whole / 2), whole * 2))

    def pairs(self, cost: Array, gate: float) -> tuple[Ints, Ints]:
        """Tracks and measurements (K,) one to one; cost (N, M): d^2 within gates, the widest `gate`, inf elsewhere."""
        if self.config.association == "nearest":
            return box_geometry.best_pieces(*assignment.nearest(cost), cost)
        blind = np.minimum(2 * np.log(self.rho), self.blindest)
        return assignment.optimal(cost + blind[:, None], gate + self.blindest)

    def excuse(self) -> None:
        """Excuse the unseen confirmed tracks that are behind somebody: covered by a track whose feet are lower."""
        lost = (self.confirmed & ~self.hit & ~self.excused).nonzero()[0]
        if not len(lost) or self.top:
            return
        place = self.uprights()
        foot, hidden = place[:, 1] + place[:, 2] / 2, place.take(lost, 0)
        in_front = self.hit & (foot > foot[lost, None])
        in_front &= np.abs(hidden[:, :1] - place[:, 0]) < (hidden[:, 3:] + place[:, 3]) / 2
        if in_front.any():
            share = np.where(in_front, box_geometry.covered(hidden, place), 0.0)
            self.excused[lost[share.max(1) >= HIDDEN]] = True

    def merged(self, z: Array, unseen: Bools) -> Bools:
        """(M,) is this measurement several confirmed tracks at once, one of them `unseen` (N,) at least?

        It is where the box around all tracks whose centres it holds fits it better than any one of theirs. The unseen
        ones among them are excused.
        """
        found = np.zeros(len(z), bool)
        if not len(z) or not unseen.any():
            return found
        place = self.bank[kalman.PLACE]
        held = box_geometry.inside(place, z) & self.confirmed[:, None]
        several = np.add.reduce(held, 0) > 1
        if not several.any():
            return found
        for column in np.flatnonzero(several & held[unseen].any(0)):
            members = held[:, column]
            alone = max(box_geometry.hull_overlap(one[None], z[column]) for one in place[members])
            if box_geometry.hull_overlap(place[members], z[column]) >= max(SAME, alone):
                found[column] = True
                self.excused[members & unseen] = True
        return found

    def bury(self, t: float) -> None:
        """Forget the tracks whose rho, age or place says that they are over."""
        lost = (~(self.hit & self.confirmed)).nonzero()[0]
        if not len(lost):
            return
        unseen, sure, rho = ~self.hit[lost], self.confirmed[lost], self.rho[lost]
        limit = np.where(self.excused[lost], self.excused_death, self.death) * (1 - SLACK)
        over = unseen & (rho >= np.where(sure, limit, self.birth_rho * (1 - 1e-9)))
        over |= ~sure & (t - self.born[lost] > self.tentative + 1e-6)
        over |= unseen & self._outside(self.bank[kalman.PLACE, lost])
        if over.any():
            stay = np.ones(len(self.id), bool)
            stay[lost[over]] = False
            self.keep(stay.nonzero()[0])

    def keep(self, rows: Ints) -> None:
        """Forget all other tracks."""
        self.bank, self.id = self.bank.take(rows, 1), self.id.take(rows)
        self._bind(self.book.take(rows, 1), self.flags.take(rows, 1))

    def _outside(self, place: Array) -> Bools:
        """Is the centre out of the image?"""
        if self.context.image_size is None:
            return np.zeros(len(place), bool)
        return np.asarray(((place[:, :2] < 0) | (place[:, :2] > self.context.image_size)).any(1))

    def give_birth(self, z: Array, score: Array, t: float) -> None:
        """A tentative track for each orphan."""
        n = len(z)
        if not n:
            return
        book, flags = np.zeros((6, n)), np.zeros((3, n), bool)
        book[0], book[1], book[2], book[3], book[4] = self._scale_of(z), self.birth_rho, t, score, 1
        flags[1] = True
        self.id = np.concatenate([self.id, np.arange(self.next_id, self.next_id + n)])
        self.next_id += n
        self._bind(np.concatenate([self.book, book], 1), np.concatenate([self.flags, flags], 1))
        self.bank = np.concatenate([self.bank, kalman.born(z, self.noise, self.dynamics.birth_rate_var)], 1)

    def reported(self, t: float) -> Ints:
        """Rows that the world hears of; an unseen one no longer than it was seen, nor at the edge on its way out."""
        told = self.hit & (self.confirmed | (t - self.born >= self.config.report_delay - 1e-6))
        lost = (self.confirmed & ~self.hit).nonzero()[0]
        if len(lost):
            limit = np.where(self.excused[lost], self.excused_silence, self.silence) * (1 + SLACK)
            fresh = (self.rho[lost] <= limit) & (self.misses[lost] <= self.config.report_credit * self.hits[lost])
            told[lost] = fresh & ~self._leaving(lost)
        return np.asarray(told.nonzero()[0])

    def look(self, z: Array) -> None:
        """Widen the field of view to these measurements, where the image's size is not known."""
        if self.context.image_size is not None:
            self.low, self.high = np.zeros(2), np.array(self.context.image_size, float)
        elif len(z):
            self.low = np.minimum(self.low, (z[:, :2] - z[:, :1:-1] / 2).min(0))
            self.high = np.maximum(self.high, (z[:, :2] + z[:, :1:-1] / 2).max(0))

    def _leaving(self, rows: Ints) -> Bools:
        """Do the predicted boxes of these reach over the edge of the field of view, moving outwards?"""
        place, rate = self.uprights()[rows], self.bank[kalman.RATE, rows, :2]
        centre, half = place[:, :2], place[:, :1:-1] / 2
        out = ((centre - half < self.low) & (rate < 0)) | ((centre + half > self.high) & (rate > 0))
        return np.asarray(out.any(1))
