"""The tracks of `blob`: filters, ages and flags, and which tracks are started, confirmed, deleted and reported.

Track management of Gonzalez et al. (2006), secs. 4.5 and 5, by rho = sqrt|S| / its asymptote, S the covariance of the
innovation: the uncertainty of a track, no unit, 1 in the steady state (tracking.filters.track_uncertainty). Association
by cost, explained misses, the rules of reporting and the field of view are ours.

Also here: the tracks of `blob` from pixels: the table of tracks, with a direction and a nominal covariance for each
track.

The state's h, w are the axes of the person's ellipse, the longer one first as measured, and theta is the direction of h
from the abscissa, v down, modulo pi. theta is a random walk (Gonzalez et al. 2006, sec. 4.1). The box of a track is the
bounding box of its ellipse.

The paper's rho is sqrt|S| over its asymptote, S the covariance of the innovation (measurement less prediction). It
counts measurements by the covariance (sec. 4.5). Here the covariance also knows that a partly hidden person
is measured with more noise, and that axes return to expected ones (both ours). So rho is computed from a second,
nominal covariance, which is updated with the nominal R (variance of a measurement) only.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sim.scene.body import PERSON_HEIGHT
from sim.types import Array, Bools, Context, Ints
from tracking.detect.person_size import upright
from tracking.filters import assignment, kalman, track_uncertainty
from tracking.papers.blob import box_geometry
from tracking.papers.blob.config import BlobConfig

HIDDEN = 0.4  # share of a predicted box that a track in front must cover to explain a miss
SAME = 0.5  # IoU of a box with the hull of several predicted boxes from which on it is taken for all of them
# Relative margin of rho: deletion comes earlier, the end of reporting later, so that filters near their steady state
# count as in it. With the default noises a miss adds more than this up to 60 fps. Above 60 fps the times are off by a
# frame or two.
SLACK = 0.02
LARGEST_SCALE = 2.0  # largest scale of a track relative to the sequence's; the least is its inverse

SCALE, RHO, BORN, SCORE, HITS, MISSES = range(6)  # Rows of `numbers`.
CONFIRMED, MEASURED, MISS_EXPLAINED = range(3)  # Rows of `flags`.
# Attributes that are views of the rows of `numbers` and `flags`.
NUMBERS, FLAGS = ("scale", "rho", "born", "score", "hits", "misses"), ("confirmed", "measured", "miss_explained")


class TrackedPeople:
    """The table of N tracks of `blob`: their filters, ages and flags. Tracks are columns of the stacked arrays.

    Made from config, its nominal filter at the frame rate, and context. State; `numbers` (6, N) and `flags` (3, N)
    stack the named rows, so that few arrays change their length:
        bank (5, N, 4)      Kalman filters of x, y, h, w (tracking.filters.kalman); places px, covariances m^2
        id (N,)             never used again; next_id: that of the next track, from 1
        scale (N,)          px per m
        rho (N,)            uncertainty: sqrt|S| (innovation covariance) over its asymptote at the last prediction,
                            in the frame of birth that of every new track
        born (N,)           time of the first measurement, s
        score (N,)          score of the last measurement, 0 to 1
        hits (N,)           frames with a measurement
        misses (N,)         frames since the last measurement
        confirmed (N,)      True once confirmed; else the track is tentative
        measured (N,)       True if measured in this frame
        miss_explained (N,) True if another track or a merged box explained a miss since the last measurement
        view_low, view_high (2,)   corners x, y of the field of view, px; inf and -inf before it is known
    px_per_m: the image's scale; from pixels that of the frame. Also config, context, dynamics (the nominal filter), top
    (True from straight above), and thresholds of rho by `follow`.
    """

    def __init__(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics, context: Context) -> None:
        self.context, self.px_per_m = context, context.px_per_m
        self.top = context.camera is not None and context.camera.kind == "top"
        self.view_low, self.view_high = np.full(2, np.inf), np.full(2, -np.inf)
        self.bank, self.id, self.next_id = np.zeros((5, 0, 4)), np.zeros(0, np.int64), 1
        self._bind(np.zeros((6, 0)), np.zeros((3, 0), bool))
        self.follow(config, dynamics)

    def follow(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics) -> None:
        """Replace the config and its nominal filter `dynamics` (of the config at the frame rate); the tracks stay as
        they are."""
        self.config, self.dynamics = config, dynamics
        self.q, self.noise, self.asymptote = dynamics.q, dynamics.noise, dynamics.asymptote
        self.birth_rho = track_uncertainty.at_birth(dynamics)
        confirmation = track_uncertainty.time_to_confirm(dynamics, config.confirm_ratio)
        self.tentative_limit = max(config.tentative_time, confirmation)
        self.death_rho = self._rho_after(config.coast_time)
        self.explained_death_rho = max(self.death_rho, self._rho_after(config.merged_time))
        self.largest_log_det = 2 * float(np.log(max(self.explained_death_rho, self.birth_rho)))
        self.silence_rho = self._rho_after(config.report_coast)
        self.explained_silence_rho = max(self.silence_rho, self._rho_after(config.report_hidden))

    def __getstate__(self) -> dict[str, Any]:
        # A copy of a view has memory of its own: the rows are bound anew in the copy.
        return {name: value for name, value in self.__dict__.items() if name not in (*NUMBERS, *FLAGS)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._bind(self.numbers, self.flags)

    def _bind(self, numbers: Array, flags: Bools) -> None:
        self.numbers, self.flags = numbers, flags
        self.scale, self.rho, self.born, self.score, self.hits, self.misses = numbers
        self.confirmed, self.measured, self.miss_explained = flags

    def _rho_after(self, seconds: float) -> float:
        frames = int(np.ceil(seconds * self.context.fps - 1e-6))
        return track_uncertainty.after_misses(self.dynamics, frames - 1)

    def predict(self) -> None:
        """Predict all tracks one frame ahead, in place (eqs 1, 2), and compute their uncertainty rho."""
        kalman.predict(self.bank, self.dynamics.dt, self.q)
        self.rho[:] = self.compute_rho()

    def compute_rho(self) -> Array:
        """Returns rho (N,) of all tracks as predicted: sqrt|S| over its asymptote, S the innovation covariance; 1 in
        the steady state."""
        return track_uncertainty.rho(self.bank, self.noise, self.asymptote)

    def upright_boxes(self) -> Array:
        """Returns the boxes (N, 4) of all tracks: centre x, y, height, width, px; predicted or updated, as the bank
        is."""
        return np.asarray(self.bank[kalman.PLACE])

    def record_measured(self, rows: Ints, near: Bools, score: Array) -> None:
        """Record that the tracks at positions `rows` (K,) were measured in this frame and all others missed; confirm
        tracks."""
        self.measured[:] = False
        self.measured[rows] = True
        self.hits += self.measured
        self.misses += 1
        self.misses[rows] = 0
        self.miss_explained[rows] = False
        self.score[rows] = score
        self.confirmed[rows] |= near & (self.rho[rows] <= self.config.confirm_ratio)
        self.scale[:] = self._scale_of(self.bank[kalman.PLACE])

    def _scale_of(self, place: Array) -> Array:
        whole = self.px_per_m
        if self.top:
            return np.full(len(place), whole)
        size = np.maximum(place[:, 2], place[:, 3]) / PERSON_HEIGHT
        return np.asarray(np.clip(size, whole / LARGEST_SCALE, whole * LARGEST_SCALE))

    def associate(self, d2: Array, log_det: Array, gate: float) -> tuple[Ints, Ints]:
        """Returns rows and columns (K,) of associated tracks and measurements, one to one."""
        if self.config.association == "nearest":
            return assignment.cheapest_per_track(*assignment.nearest(d2), d2)
        return assignment.optimal(d2 + np.minimum(log_det, self.largest_log_det), gate + self.largest_log_det)

    def rho_log_det(self) -> Array:
        """Returns 2 ln rho (N, 1): ln |S| of each track, in metres, less that of a track in the steady state."""
        return np.asarray(2 * np.log(self.rho)[:, None])

    def explain_misses(self) -> None:
        """Set miss_explained of each missed confirmed track that is hidden: one measured track with a lower foot covers
        at least the share HIDDEN = 0.4 of its box."""
        lost = (self.confirmed & ~self.measured & ~self.miss_explained).nonzero()[0]
        if not len(lost) or self.top:
            return
        place = self.upright_boxes()
        foot, hidden = place[:, 1] + place[:, 2] / 2, place.take(lost, 0)
        in_front = self.measured & (foot > foot[lost, None])
        in_front &= np.abs(hidden[:, :1] - place[:, 0]) < (hidden[:, 3:] + place[:, 3]) / 2
        if in_front.any():
            share = np.where(in_front, box_geometry.covered_share(hidden, place), 0.0)
            self.miss_explained[lost[share.max(1) >= HIDDEN]] = True

    def cover_several(self, z: Array, unseen: Bools) -> Bools:
        """Returns flags (M,): True for each box z (M, 4) that covers several confirmed tracks, at least one of them
        unseen."""
        found = np.zeros(len(z), bool)
        if not self.config.merged_time or not len(z) or not unseen.any():
            return found
        place = self.bank[kalman.PLACE]
        inside = box_geometry.points_inside(place, z) & self.confirmed[:, None]
        several = np.add.reduce(inside, 0) > 1
        if not several.any():
            return found
        for column in np.flatnonzero(several & inside[unseen].any(0)):
            members = inside[:, column]
            alone = max(box_geometry.hull_iou(one[None], z[column]) for one in place[members])
            if box_geometry.hull_iou(place[members], z[column]) >= max(SAME, alone):
                found[column] = True
                self.miss_explained[members & unseen] = True
        return found

    def delete_tracks(self, t: float) -> None:
        """Delete tracks from the table at time t, s (sec. 5, and ours)."""
        lost = (~(self.measured & self.confirmed)).nonzero()[0]
        if not len(lost):
            return
        unseen, sure, rho = ~self.measured[lost], self.confirmed[lost], self.rho[lost]
        limit = np.where(self.miss_explained[lost], self.explained_death_rho, self.death_rho) * (1 - SLACK)
        over = unseen & (rho >= np.where(sure, limit, self.birth_rho * (1 - 1e-9)))
        over |= ~sure & (t - self.born[lost] > self.tentative_limit + 1e-6)
        over |= unseen & self._outside(self.bank[kalman.PLACE, lost])
        if over.any():
            stay = np.ones(len(self.id), bool)
            stay[lost[over]] = False
            self.keep_only(stay.nonzero()[0])

    def keep_only(self, rows: Ints) -> None:
        """Delete all tracks except those at table positions `rows` (K,); they are in the order of `rows` afterwards."""
        self.bank, self.id = self.bank.take(rows, 1), self.id.take(rows)
        self._bind(self.numbers.take(rows, 1), self.flags.take(rows, 1))

    def _outside(self, place: Array) -> Bools:
        if self.context.image_size is None:
            return np.zeros(len(place), bool)
        return np.asarray(((place[:, :2] < 0) | (place[:, :2] > self.context.image_size)).any(1))

    def start_tracks(self, z: Array, score: Array, t: float) -> None:
        """Append a tentative track at rest for each box z (K, 4): centre x, y, height, width, px."""
        n = len(z)
        if not n:
            return
        numbers, flags = np.zeros((6, n)), np.zeros((3, n), bool)
        numbers[SCALE], numbers[RHO], numbers[BORN] = self._scale_of(z), self.birth_rho, t
        numbers[SCORE], numbers[HITS] = score, 1
        flags[MEASURED] = True
        self.id = np.concatenate([self.id, np.arange(self.next_id, self.next_id + n)])
        self.next_id += n
        self._bind(np.concatenate([self.numbers, numbers], 1), np.concatenate([self.flags, flags], 1))
        self.bank = np.concatenate([self.bank, kalman.born(z, self.noise, self.dynamics.birth_rate_var)], 1)

    def rows_to_report(self, t: float) -> Ints:
        """Returns the table positions (K,), ascending, of the tracks to report at time t, s (ours)."""
        reported = self.measured & (self.confirmed | (t - self.born >= self.config.report_delay - 1e-6))
        lost = (self.confirmed & ~self.measured).nonzero()[0]
        if len(lost):
            limit = np.where(self.miss_explained[lost], self.explained_silence_rho, self.silence_rho) * (1 + SLACK)
            fresh = (self.rho[lost] <= limit) & (self.misses[lost] <= self.config.report_credit * self.hits[lost])
            reported[lost] = fresh & ~self._leaving(lost)
        return np.asarray(reported.nonzero()[0])

    def widen_view(self, z: Array) -> None:
        """Set the field of view to the image, or, if its size is unknown, widen it to hold the boxes z (M, 4)."""
        if self.context.image_size is not None:
            self.view_low, self.view_high = np.zeros(2), np.array(self.context.image_size, float)
        elif len(z):
            self.view_low = np.minimum(self.view_low, (z[:, :2] - z[:, :1:-1] / 2).min(0))
            self.view_high = np.maximum(self.view_high, (z[:, :2] + z[:, :1:-1] / 2).max(0))

    def _leaving(self, rows: Ints) -> Bools:
        place, rate = self.upright_boxes()[rows], self.bank[kalman.RATE, rows, :2]
        centre, half = place[:, :2], place[:, :1:-1] / 2
        out = ((centre - half < self.view_low) & (rate < 0)) | ((centre + half > self.view_high) & (rate > 0))
        return np.asarray(out.any(1))


ANGLE_RATE = 15.0  # deg/s^0.5, random walk of the direction: its standard deviation after one second
RELAXATION = 0.5  # s, time constant with which axes return to the expected ones
HEADING = 6.0  # seen from straight above, the direction turns with the heading: so many times faster than a body leans


class TrackedEllipses(TrackedPeople):
    """The table of N tracks from pixels: filters of ellipses, with a direction and a nominal covariance for each track.

    Made from config, its nominal filter and context, as TrackedPeople. State, beside that of TrackedPeople: angle (2,
    N), rows: direction of the first axis h (rad, from the abscissa, v down) and its variance (rad^2);
    nominal (5, N, 4), a bank of filters as `bank`, updated with the nominal noise, from which the uncertainty rho
    follows; angle_var_per_step, growth of the direction's variance in a frame. In `bank` the coordinates are x, y, h,
    w: centre and full axes of the ellipse.
    """

    def __init__(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics, context: Context) -> None:
        self.angle, self.nominal = np.zeros((2, 0)), np.zeros((5, 0, 4))
        super().__init__(config, dynamics, context)

    def follow(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics) -> None:
        """Replace the config and its nominal filter `dynamics` (of the config at the frame rate); the tracks stay as
        they are."""
        super().follow(config, dynamics)
        self.largest_log_det += 2 * dynamics.noise.size * np.log(LARGEST_SCALE)
        rate = ANGLE_RATE * (HEADING if self.top else 1.0)
        self.angle_var_per_step = np.radians(rate) ** 2 * dynamics.dt

    def predict(self) -> None:
        """Predict all tracks one frame ahead, in place (eqs 1, 2), and compute their uncertainty rho; directions stay,
        their variances grow."""
        kalman.predict(self.nominal, self.dynamics.dt, self.q)
        self.angle[kalman.DIRECTION_VAR] += self.angle_var_per_step
        super().predict()

    def compute_rho(self) -> Array:
        """Returns rho (N,) of all tracks: sqrt|S| over its asymptote, S the innovation covariance by the nominal
        covariance of x, y, h, w; 1 in the steady state."""
        return track_uncertainty.rho(self.nominal, self.noise, self.asymptote)

    def upright_boxes(self) -> Array:
        """Returns the bounding boxes (N, 4) of the tracks' ellipses: centre x, y, height, width, px."""
        return upright(self.bank[kalman.PLACE], self.angle[kalman.DIRECTION])

    def keep_only(self, rows: Ints) -> None:
        """Delete all tracks except those at table positions `rows` (K,); they are in the order of `rows` afterwards."""
        self.angle, self.nominal = self.angle.take(rows, 1), self.nominal.take(rows, 1)
        super().keep_only(rows)

    def start_tracks(self, z: Array, score: Array, t: float) -> None:
        """Append a tentative track at rest for each ellipse z (K, 5): centre x, y, full axes h, w (px), direction theta
        (rad)."""
        super().start_tracks(z[:, :4], score, t)
        new = np.stack([z[:, 4], np.full(len(z), kalman.VAGUE)])
        self.angle = np.concatenate([self.angle, new], 1)
        self.nominal = np.concatenate([self.nominal, self.bank[:, self.bank.shape[1] - len(z) :]], 1)

    def direction_distances(self, z: Array, angle_var: Array) -> Array:
        """Returns the direction's part y^2 / S of the squared distance d^2 (eq. 9) of N tracks and M ellipses, (N,
        M)."""
        s = self.angle[kalman.DIRECTION_VAR][:, None] + angle_var
        turn = kalman.angle_innovation(z, self.angle[kalman.DIRECTION][:, None])
        return np.where(kalman.directed(angle_var), turn * turn / s, 0.0)

    def innovations(self, z: Array, angle_var: Array) -> tuple[Array, Array]:
        """Returns d^2 (eq. 9) and ln |S| but for a constant, (N, M) each, of N tracks and M ellipses."""
        d2 = kalman.distances(self.bank, z[:, :4], self.noise, self.scale) + self.direction_distances(
            z[:, 4], angle_var
        )
        angle_s = self.angle[kalman.DIRECTION_VAR][:, None] + np.where(kalman.directed(angle_var), angle_var, np.inf)
        known = np.log((self.bank[kalman.VAR] + self.noise) / self.asymptote).sum(1)
        known += 2 * self.noise.size * np.log(self.scale / self.context.px_per_m)
        return d2, known[:, None] + np.log(np.minimum(2 / np.pi * angle_s, 1.0))

    def update(self, rows: Ints, z: Array, noise: Array, angle_var: Array) -> Array:
        """Update the tracks at table positions `rows` (K,), each at most once, with ellipses z (K, 5), in place (eqs 3
        to 7)."""
        terms = kalman.update(self.bank, rows, z[:, :4], noise)
        turn = self.direction_distances(z[:, 4], angle_var)[rows, np.arange(len(rows))]
        kalman.update(self.nominal, rows, z[:, :4], self.noise)
        kalman.angle_update(self.angle, rows, z[:, 4], angle_var)
        return np.asarray(np.add.reduce(terms, 1) / np.square(self.scale[rows]) + turn)

    def relax_axes(self, rows: Ints, axes: Array, var: float) -> None:
        """Move the axes of the tracks at positions `rows` (K,) towards expected axes (K, 2), px, in place (ours)."""
        stay = np.exp(-self.dynamics.dt / RELAXATION)
        bank = self.bank[:, rows, 2:]
        bank[kalman.PLACE] += (1 - stay) * (axes - bank[kalman.PLACE])
        bank[kalman.VAR] = stay**2 * bank[kalman.VAR] + (1 - stay**2) * var
        bank[kalman.COV] *= stay
        self.bank[:, rows, 2:] = bank
