"""The tracks of `blob`: filters, ages and flags, and which tracks are started, confirmed, deleted and reported.

Two kinds of `management`:
- rho, of Gonzalez et al. (2006), secs. 4.4, 4.5 and 5: by rho = sqrt|S| / its asymptote, S the covariance of the
  innovation: the uncertainty of a track, no unit, 1 in the steady state (tracking.filters.track_uncertainty).
- existence (ours): by the probability that a track is a person (existence). A measurement is associated where that is
  more likely than that it is false or new. A track is reported if it is a person, and where predicted, with the
  probability LIKELY. A person whose feet are nearer to the camera hides others.

With a camera (ours): an extended Kalman filter of each person on the ground, with the state s = (x, y, x', y', height)
and the measurement z = (u, v, h), centre and height of the box, px:

    s = F s,  P = F P F' + Q                                 F, Q: constant velocity; the height stays
    K = P H' (H P H' + R)^-1,  s = s + K (z - f(s)),  P = (I - K H) P

f(s) is the box between the projected foot and head (`seen_boxes`), H its derivative at the height of the ground there.
It does not change the filters of the bank, from which gates, association and boxes follow.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sim.scene.body import PERSON_HEIGHT
from sim.scene.camera import project
from sim.scene.standing import standing_points
from sim.scene.terrain import height_at
from sim.types import Array, Bools, Camera, Context, Ints
from tracking.filters import assignment, existence, kalman, kalman_kernels, track_uncertainty
from tracking.papers.blob import box_geometry
from tracking.papers.blob import tracked_people_kernels as kernels
from tracking.papers.blob.config import BlobConfig

# Relative margin of rho, with which deletion comes earlier, so that filters near their steady state count as in it.
SLACK = 0.02
LARGEST_SCALE = 2.0  # largest scale of a track relative to the sequence's; the least is its inverse
LEAST_EXISTENCE = 0.01  # a track with a lower existence probability is deleted, or not started
SIZE_SPREAD = 0.3  # m: standard deviation of height and width of false boxes
LEAST_VIEW = 5.0  # m: least width and height of the field of view
DOUBLES = 0.05  # boxes per frame that a person has beside the own one, on average
HEIGHT_SPREAD = 0.1  # m: standard deviation of people's heights
PLACE_SPREAD = 10.0  # m: standard deviation of the place on the ground before the first box
NUDGE = 1e-4  # m: step of the numerical derivatives of `seen_boxes`
SEEN = [0, 1, 4]  # the parts of `stand` on which a box depends


def seen_boxes(camera: Camera, stand: Array, z: Array) -> Array:
    """Returns the boxes (N, 3) in which a camera sees people: centre x, y, height, px. stand (N, 5): as of
    TrackedPeople; z (N,): height of the ground, m."""
    foot = np.column_stack([stand[:, :2], z])
    ends, _ = project(camera, np.concatenate([foot, np.column_stack([stand[:, :2], z + stand[:, 4]])]))
    foot, head = np.split(ends, 2)
    return np.column_stack([(foot + head) / 2, np.abs(foot - head)[:, 1]])


class TrackedPeople:
    """The table of N tracks of `blob`: their filters, ages and flags.

    Made from config, its nominal filter at the frame rate, and context. State:
        bank (5, N, 4)      Kalman filters of x, y, h, w (tracking.filters.kalman); places px, covariances m^2
        id (N,)             never used again; next_id: that of the next track, from 1
        scale (N,)          px per m
        born (N,)           time of the first measurement, s
        score (N,)          score of the last measurement, 0 to 1; from pixels its support
        states (3, N)       probabilities of a person who is shown, who is not, and of a false object (existence)
        confirmed (N,)      True if confirmed; else the track is tentative
        measured (N,)       True if measured in this frame
        stand (N, 5)        with a camera: where the person stands on the ground, x, y, vx, vy, and how tall the person
                            is, m and m/s; nan: above the horizon. stand_cov (N, 5, 5): covariance
        image (2, 2)        lower and higher corner x, y of the image, px; -inf and inf if its size is unknown
        view (2, 2)         the same of the field of view; inf and -inf before it is known
    detect_prob: that of the config, 0 in a frame that was not observed; detectable (N,): probability that a person who
    exists and is shown is measured in this frame; rho (N,): with "rho", sqrt|S| (innovation covariance) over its
    asymptote, as predicted; unseen_time: s, BIRTH_RATE times it is the expected number of people in view without a
    track; unseen_from_start: its part of people who were there in the first frame; false_density: expected false boxes
    in this frame per px^2 of place and m^2 of size; px_per_m: the image's scale; from pixels that of the frame. Also
    config, context, dynamics (the nominal filter), top (True from straight above), and what `follow` derives.
    """

    # Axis of the tracks in each column of the table.
    columns: ClassVar[dict[str, int]] = {
        "bank": 1, "id": 0, "scale": 0, "born": 0, "score": 0, "states": 1, "confirmed": 0, "measured": 0
    }  # fmt: skip

    def __init__(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics, context: Context) -> None:
        self.context, self.px_per_m = context, context.px_per_m
        self.top = context.camera is not None and context.camera.kind == "top"
        size = context.image_size
        self.image = np.full((2, 2), [[-np.inf], [np.inf]]) if size is None else np.array([(0.0, 0.0), size])
        self.view = -self.image if size is None else self.image
        self.bank, self.id, self.next_id = np.zeros((5, 0, 4)), np.zeros(0, np.int64), 1
        self.scale, self.born, self.score = np.zeros((3, 0))
        self.confirmed, self.measured = np.zeros((2, 0), bool)
        if context.camera is not None:
            self.stand, self.stand_cov = np.zeros((0, 5)), np.zeros((0, 5, 5))
            self.columns = {**self.columns, "stand": 0, "stand_cov": 0}  # type: ignore[misc]
        self.states, self.unseen_time = np.zeros((3, 0)), existence.LIFETIME
        self.unseen_from_start = self.unseen_time
        self.follow(config, dynamics)

    def follow(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics) -> None:
        """Replaces the config and its nominal filter `dynamics` (of the config at the frame rate); the tracks stay as
        they are."""
        self.config, self.dynamics = config, dynamics
        self.q, self.noise, self.asymptote = dynamics.q, dynamics.noise, dynamics.asymptote
        self.by_existence = config.management == "existence"
        self.transition = existence.transition(dynamics.dt, config.hidden_time)
        self.birth_rho = track_uncertainty.at_birth(dynamics)
        confirmation = track_uncertainty.time_to_confirm(dynamics, config.confirm_ratio)
        self.tentative_limit = max(config.tentative_time, confirmation)
        frames = int(np.ceil(config.coast_time * self.context.fps - 1e-6))
        self.death_rho = track_uncertainty.after_misses(dynamics, frames - 1)
        walk, noise = kalman.constant_velocity(dynamics.dt, 2)
        self.walk, self.walk_noise = np.eye(5), np.zeros((5, 5))
        self.walk[:4, :4], self.walk_noise[:4, :4] = walk, config.accel_noise**2 * self.context.fps * noise

    def predict(self, observed: bool = True) -> None:
        """Predicts all tracks one frame ahead, in place (eqs 1, 2), with their uncertainty rho and their existence.
        observed: False if nobody looks at this frame, so that nobody is detectable in it."""
        kalman.predict(self.bank, self.dynamics.dt, self.q)
        if self.context.camera is not None:
            self.stand = self.stand @ self.walk.T
            self.stand_cov = self.walk @ self.stand_cov @ self.walk.T + self.walk_noise
        if not self.by_existence:
            self.rho = self.compute_rho()
        self.states[:] = self.transition @ self.states
        self.expect(observed * self.config.detect_prob)

    def expect(self, detect_prob: float) -> None:
        """Computes the probability that each track is measured, where a person who can be detected and whom nobody
        hides is detected with the probability `detect_prob`."""
        self.detect_prob = detect_prob
        boxes, var = self.upright_boxes(), self.bank[kalman.VAR]
        shown = 1.0 if self.top else kernels.visible_shares(boxes, self.scale, self.existence(), var)
        self.detectable = self.detect_prob * shown * np.ones(len(self.id))

    def compute_rho(self) -> Array:
        """Returns rho (N,) of all tracks as predicted: sqrt|S| over its asymptote, S the innovation covariance; 1 in
        the steady state."""
        return track_uncertainty.rho(self.bank, self.noise, self.asymptote)

    def upright_boxes(self) -> Array:
        """Returns the boxes (N, 4) of all tracks: centre x, y, height, width, px; predicted or updated, as the bank
        is."""
        return np.asarray(self.bank[kalman.PLACE])

    def existence(self) -> Array:
        """Returns the existence probability (N,) of all tracks."""
        return np.asarray(self.states[existence.SHOWN] + self.states[existence.HIDDEN])

    def innovations(self, z: Array, noise: Array | None = None) -> tuple[Array, Array]:
        """Returns d^2 (N, M) (eq. 9), and ln |2 pi S| (N,), in m, of N tracks and M boxes z (M, 4). noise (4,):
        variances of the boxes, m^2; None: the config's."""
        S = self.bank[kalman.VAR] + (self.noise if noise is None else noise)
        return kalman_kernels.distances(self.bank[kalman.PLACE], S, z, self.scale)

    def evidence(self, rows: Ints, d2: Array, log_det: Array) -> Array:
        """Returns ln N(z; z_pred, S) over the density of false boxes, of P pairs of tracks `rows` and boxes, from d^2
        and ln |2 pi S|; all (P,)."""
        return np.asarray(-0.5 * (d2 + log_det) - np.log(self.false_density * np.square(self.scale[rows])))

    def associate(
        self, rows: Ints, columns: Ints, d2: Array, evidence: Array, ratio: Array | float = 1.0,
        states: Array | None = None,
    ) -> Ints:  # fmt: skip
        """Returns the indices (K,) of the associated pairs, one to one, of P pairs of tracks `rows` and measurements
        `columns`, row by row. d2, evidence (P,): of `innovations` and `evidence`; ratio (P,): of the score;
        states (3, N): None takes those of the tracks."""
        if not self.by_existence:
            best = assignment.cheapest(columns, d2, rows)
            return best[assignment.cheapest(rows[best], d2[best], columns[best])]
        new, ratio = self._new_people() / self.config.clutter_rate, ratio * np.ones(len(rows))
        cost = kernels.pair_costs(
            rows, evidence, ratio, new, self.detectable, self.states if states is None else states
        )
        likely = np.flatnonzero(cost < 0)
        return likely[assignment.one_to_one(rows[likely], columns[likely], cost[likely])]

    def _new_people(self) -> float:
        return existence.BIRTH_RATE * self.unseen_time * self.config.detect_prob

    def record_measured(
        self, rows: Ints, near: Bools, score: Array, evidence: Array, ratio: Array | float = 1.0
    ) -> None:
        """Records that the tracks at positions `rows` (K,) were measured in this frame and all others missed; confirms
        tracks."""
        self.measured[:] = False
        self.measured[rows] = True
        self.score[rows] = score
        self.scale[:] = self.scale_of(self.bank[kalman.PLACE])
        if self.by_existence:
            existence.update(self.states, rows, self.detectable, np.exp(evidence), ratio)
            self.confirmed[:] = self.existence() >= kernels.LIKELY
        else:
            self.confirmed[rows] |= near & (self.rho[rows] <= self.config.confirm_ratio)

    def measure_on_ground(self, rows: Ints, box: Array, noise: Array) -> None:
        """Updates `stand` of the tracks at positions `rows` (K,), each at most once, with measured boxes (K, 4): centre
        x, y, height, width, px; noise: variances, m^2, (4,) or (K, 4). An extended Kalman filter."""
        if self.context.camera is None:
            return
        # x, P: state and covariance; H: derivative of the box; R: noise; K: gain
        x, P = self.stand[rows], self.stand_cov[rows]
        near = np.repeat(x[:, None], 4, 1)
        near[:, range(1, 4), SEEN] += NUDGE
        # A flight of stairs has edges, at which its slope says nothing.
        ground = np.zeros(len(x)) if self.context.scene is None else height_at(self.context.scene, x[:, :2])
        z = seen_boxes(self.context.camera, near.reshape(-1, 5), np.repeat(ground, 4)).reshape(-1, 4, 3)
        H = np.zeros((len(x), 3, 5))
        H[:, :, SEEN] = np.swapaxes(z[:, 1:] - z[:, :1], 1, 2) / NUDGE
        R = (noise * np.square(self.scale[rows])[:, None])[:, :3, None] * np.eye(3)
        HP = H @ P
        K = np.swapaxes(np.linalg.solve(HP @ np.swapaxes(H, 1, 2) + R, HP), 1, 2)
        self.stand[rows] = x + (K @ (box[:, :3] - z[:, 0])[..., None])[..., 0]
        known = K @ HP
        self.stand_cov[rows] = P - (known + np.swapaxes(known, 1, 2)) / 2

    def place_on_ground(self, camera: Camera, box: Array) -> None:
        """Starts `stand` of tracks without it where their boxes stand; box (N, 4): centre x, y, height, width, px."""
        new = np.flatnonzero(np.isnan(self.stand).any(1))
        if not len(new):
            return
        ground = standing_points(box_geometry.ltwh_from_centred(box[new]), camera, self.context.scene)
        if camera.kind == "pinhole":  # just below the horizon feet say little: the height of a box says how far at most
            away, most = ground - camera.position[:2], camera.focal_px[1] * PERSON_HEIGHT / box[new, 2]
            far = np.hypot(*away.T)
            ground -= away * np.where(far > most + PLACE_SPREAD, 1 - most / np.maximum(far, most), 0.0)[:, None]
        speed = self.dynamics.birth_rate_var[0]
        self.stand[new] = np.column_stack([ground, np.zeros((len(new), 2)), np.full(len(new), PERSON_HEIGHT)])
        self.stand_cov[new] = np.diag([PLACE_SPREAD**2, PLACE_SPREAD**2, speed, speed, HEIGHT_SPREAD**2])
        self.measure_on_ground(new, box[new], self.noise)

    def scale_of(self, place: Array) -> Array:
        """Returns the scale (M,), px per m, of people with the boxes `place` (M, 4): centre x, y, height, width, px."""
        whole = self.px_per_m
        if self.top:
            return np.full(len(place), whole)
        size = np.maximum(place[:, 2], place[:, 3]) / PERSON_HEIGHT
        return np.asarray(np.minimum(np.maximum(size, whole / LARGEST_SCALE), whole * LARGEST_SCALE))

    def new_people(self, z: Array, free: Bools, ratio: Array | float = 1.0, *, last: bool = True) -> Array:
        """Returns the probability (M,) that each box z (M, 4), as no track's, is of a person without a track.

        It may also be false, or a second box of a measured person or of an earlier one of the boxes `free` (M,), which
        no track has. last: also counts the people without a track, which must be done once a frame.
        """
        c, new, double = self.config, self._new_people() * (ratio * np.ones(len(z))), np.zeros(len(z))
        person = new / (new + c.clutter_rate)
        kernels.add_doubles(double, z, self.bank[kalman.PLACE], self.scale, self.existence() * self.measured, False)
        kernels.add_doubles(double, z, z, self.scale_of(z), person * free, True)
        double *= c.clutter_rate * DOUBLES / (2 * np.pi * kernels.DOUBLE_SPREAD**2) ** 2 / self.false_density
        if last and (len(z) or len(self.id)):
            stay = np.exp(-self.dynamics.dt / existence.LIFETIME)
            self.unseen_time = stay * (1 - self.detect_prob) * self.unseen_time + self.dynamics.dt
            self.unseen_from_start *= stay * (1 - self.detect_prob)
        return np.asarray(new / (new + c.clutter_rate + double))

    def delete_tracks(self, t: float) -> None:
        """Deletes tracks from the table at time t, s (sec. 5, and ours)."""
        unseen = ~self.measured
        place = self.bank[kalman.PLACE, :, :2]
        over = unseen & ((place < self.image[0]) | (place > self.image[1])).any(1)
        if self.by_existence:
            over |= self.existence() < LEAST_EXISTENCE
        else:
            limit = np.where(self.confirmed, self.death_rho * (1 - SLACK), self.birth_rho * (1 - 1e-9))
            over |= unseen & (self.rho >= limit)
            over |= ~self.confirmed & (t - self.born > self.tentative_limit + 1e-6)
        if over.any():
            self.keep_only((~over).nonzero()[0])

    def keep_only(self, rows: Ints) -> None:
        """Deletes all tracks except those at table positions `rows` (K,), which are then in the order of `rows`."""
        for name, axis in self.columns.items():
            setattr(self, name, getattr(self, name).take(rows, axis))

    def start_tracks(self, z: Array, score: Array, t: float, person: Array) -> None:
        """Appends a track at rest for each box z (K, 4): centre x, y, height, width, px; person (K,): probability that
        it is one."""
        n = len(z)
        if not n:
            return
        self._append(
            bank=kalman.born(z[:, :4], self.noise, self.dynamics.birth_rate_var),
            id=np.arange(self.next_id, self.next_id + n), scale=self.scale_of(z), born=np.full(n, t), score=score,
            states=existence.newborn(person),
            confirmed=self.by_existence & (person >= kernels.LIKELY), measured=np.ones(n, bool),
        )  # fmt: skip
        if self.context.camera is not None:
            self._append(stand=np.full((n, 5), np.nan), stand_cov=np.full((n, 5, 5), np.nan))
        if not self.by_existence:
            self.rho = np.append(self.rho, np.full(n, self.birth_rho))
        self.next_id += n

    def _append(self, **new: Array | Ints | Bools) -> None:
        for name, values in new.items():
            setattr(self, name, np.concatenate([getattr(self, name), values], self.columns[name]))

    def rows_to_report(self) -> Ints:
        """Returns the table positions (K,), ascending, of the tracks to report (ours)."""
        if not self.by_existence:
            return np.asarray(self.confirmed.nonzero()[0])
        boxes, existence = self.upright_boxes(), self.existence()
        return kernels.reported(boxes, self.bank, existence, self.measured, self.view).nonzero()[0]

    def widen_view(self, z: Array) -> None:
        """Widens the field of view to hold the boxes z (M, 4) if the image's size is unknown, and computes the density
        of false boxes in it."""
        if self.context.image_size is None and len(z):
            low, high = (z[:, :2] - z[:, :1:-1] / 2).min(0), (z[:, :2] + z[:, :1:-1] / 2).max(0)
            self.view = np.array([np.minimum(self.view[0], low), np.maximum(self.view[1], high)])
        wide, high = np.maximum(self.view[1] - self.view[0], LEAST_VIEW * self.px_per_m)
        self.false_density = self.config.clutter_rate / (wide * high) / (2 * np.pi * SIZE_SPREAD**2)
