"""The tracks of `blob` from pixels: ellipses, with a direction and a nominal covariance for each track.

The state's h, w are the axes of the person's ellipse, the longer one first as measured, and theta is the direction of h
from the abscissa, v down, modulo pi. theta is a random walk (Gonzalez et al. 2006, sec. 4.1). The box of a track is the
bounding box of its ellipse. The filter's covariance contains that a partly hidden person is measured with more noise,
and that axes return to expected ones (both ours). So rho, which counts measurements (sec. 4.5), is computed from a
second, nominal covariance, which is updated with the nominal R (variance of a measurement) only.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sim.types import Array, Context, Ints
from tracking.detect.camera_motion import mapped
from tracking.detect.person_size import upright
from tracking.filters import existence, kalman, track_uncertainty
from tracking.papers.blob import person_look_kernels
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.tracked_people import TrackedPeople

ANGLE_RATE = 15.0  # deg/s^0.5, random walk of the direction: its standard deviation after one second
RELAXATION = 0.5  # s, time constant with which axes return to the expected ones
HEADING = 6.0  # seen from straight above, the direction turns with the heading: so many times faster than a body leans


class TrackedEllipses(TrackedPeople):
    """The table of N tracks from pixels: filters of ellipses, with a direction and a nominal covariance for each track.

    Made from config, its nominal filter and context, as TrackedPeople. State, beside that of TrackedPeople: angle (2,
    N), rows: direction of the first axis h (rad, from the abscissa, v down) and its variance (rad^2);
    nominal (5, N, 4), a bank of filters as `bank`, updated with the nominal noise, from which the uncertainty rho
    follows; look (N, POINTS, 5), the colours of each person (person_look_kernels); detector, lasting, standing (N,):
    shown, lasting and standing of `existence.update_by_detector`; angle_var_per_step, growth of the direction's
    variance in a frame. In `bank` the coordinates are x, y, h, w: centre and full axes of the ellipse.
    """

    columns: ClassVar[dict[str, int]] = {
        **TrackedPeople.columns,
        "angle": 1,
        "nominal": 1,
        "look": 0,
        "detector": 0,
        "lasting": 0,
        "standing": 0,
    }

    def __init__(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics, context: Context) -> None:
        self.detector, self.lasting, self.standing = np.zeros((3, 0))
        self.angle, self.nominal, self.look = np.zeros((2, 0)), np.zeros((5, 0, 4)), person_look_kernels.unknown(0)
        super().__init__(config, dynamics, context)

    def follow(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics) -> None:
        """Replaces the config and its nominal filter `dynamics` (of the config at the frame rate); the tracks stay as
        they are."""
        super().follow(config, dynamics)
        rate = ANGLE_RATE * (HEADING if self.top else 1.0)
        self.angle_var_per_step = np.radians(rate) ** 2 * dynamics.dt

    def predict(self, observed: bool = True) -> None:
        """Predicts all tracks one frame ahead, in place (eqs 1, 2), and computes their uncertainty rho; directions
        stay, their variances grow."""
        kalman.predict(self.nominal, self.dynamics.dt, self.q)
        self.angle[kalman.DIRECTION_VAR] += self.angle_var_per_step
        nothing, person = 1 - self.states.sum(0), self.existence()
        standing = self.states[existence.HIDDEN] * self.standing
        super().predict(observed)
        self._keep_standing(standing)
        lost = person * -np.expm1(-self.dynamics.dt / existence.LIFETIME)
        lasting = (nothing * self.lasting + existence.LASTING * lost) / np.maximum(1 - self.states.sum(0), 1e-12)
        self.lasting = np.minimum(lasting, 1.0)
        shown, hidden = self.transition[:2, :2]
        self.detector = (shown[0] * self.detector + shown[1] * (1 - self.detector)) / (shown[0] + hidden[0])

    def _keep_standing(self, standing: Array) -> None:
        """Corrects the predicted `states` for people who stood in the background with the probability standing (N,):
        they walk off, and are shown then, at the rate 1 / LIFETIME."""
        show, stay = self.transition[:2, existence.HIDDEN]
        left = standing * np.exp(-self.dynamics.dt / existence.LIFETIME)
        stand = left * np.exp(-self.dynamics.dt / existence.LIFETIME)
        self.states[existence.SHOWN] += left - stand - show * standing
        self.states[existence.HIDDEN] += stand - stay * standing
        self.standing = stand / np.maximum(self.states[existence.HIDDEN], 1e-300)

    def seen_by_detector(self) -> Array:
        """Returns the probability (N,) that a person exists whom the detector can see."""
        walking = self.existence() - self.states[existence.HIDDEN] * self.standing
        return np.asarray(self.existence() - walking * (1 - self.detector))

    def carry(self, step: Array) -> None:
        """Moves all tracks in the image by a homography `step` (3, 3), as its reference follows the camera."""
        self.bank[kalman.PLACE, :, :2] = mapped(step, self.bank[kalman.PLACE, :, :2])

    def compute_rho(self) -> Array:
        """Returns rho (N,) of all tracks: sqrt|S| over its asymptote, S the innovation covariance by the nominal
        covariance of x, y, h, w; 1 in the steady state."""
        return track_uncertainty.rho(self.nominal, self.noise, self.asymptote)

    def upright_boxes(self) -> Array:
        """Returns the bounding boxes (N, 4) of the tracks' ellipses: centre x, y, height, width, px."""
        return upright(self.bank[kalman.PLACE], self.angle[kalman.DIRECTION])

    def start_tracks(self, z: Array, score: Array, t: float, person: Array, *, boxed: bool = False) -> None:
        """Appends a track at rest for each ellipse z (K, 5): centre x, y, full axes h, w, px, direction theta, rad.
        boxed: a detector shows it, and perhaps the detector only."""
        super().start_tracks(z, score, t, person)
        if boxed:
            new = self.states[:, self.states.shape[1] - len(z) :]
            new[existence.FALSE] *= 1 - existence.LASTING
            new[existence.HIDDEN] = (
                existence.STANDING * self.unseen_from_start / self.unseen_time * new[existence.SHOWN]
            )
            new[existence.SHOWN] -= new[existence.HIDDEN]
        self._append(
            detector=np.full(len(z), 1.0 if boxed else existence.shown_share(self.config.hidden_time)),
            lasting=np.full(len(z), float(boxed)), standing=np.full(len(z), float(boxed)),
            angle=np.stack([z[:, 4], np.full(len(z), kalman.VAGUE)]), look=person_look_kernels.unknown(len(z)),
            nominal=self.bank[:, self.bank.shape[1] - len(z) :],
        )  # fmt: skip

    def direction_distances(self, z: Array, angle_var: Array) -> Array:
        """Returns the direction's part y^2 / S of the squared distance d^2 (eq. 9) of N tracks and M ellipses, (N,
        M)."""
        s = self.angle[kalman.DIRECTION_VAR][:, None] + angle_var
        turn = kalman.angle_innovation(z, self.angle[kalman.DIRECTION][:, None])
        return np.where(kalman.directed(angle_var), turn * turn / s, 0.0)

    def directed_innovations(self, z: Array, angle_var: Array) -> tuple[Array, Array]:
        """Returns d^2 (eq. 9) and ln |2 pi S|, (N, M) each, of N tracks and M ellipses; a direction counts relative to
        a uniform one."""
        d2, log_det = self.innovations(np.ascontiguousarray(z[:, :4]))
        angle_s = self.angle[kalman.DIRECTION_VAR][:, None] + np.where(kalman.directed(angle_var), angle_var, np.inf)
        turned = np.log(np.minimum(2 / np.pi * angle_s, 1.0))
        return d2 + self.direction_distances(z[:, 4], angle_var), log_det[:, None] + turned

    def update(self, rows: Ints, z: Array, noise: Array, angle_var: Array) -> Array:
        """Updates the tracks at table positions `rows` (K,), each at most once, with ellipses z (K, 5), in place (eqs 3
        to 7)."""
        terms = kalman.update(self.bank, rows, z[:, :4], noise)
        turn = self.direction_distances(z[:, 4], angle_var)[rows, np.arange(len(rows))]
        kalman.update(self.nominal, rows, z[:, :4], self.noise)
        kalman.angle_update(self.angle, rows, z[:, 4], angle_var)
        return np.asarray(np.add.reduce(terms, 1) / np.square(self.scale[rows]) + turn)

    def relax_axes(self, rows: Ints, axes: Array, var: float) -> None:
        """Moves the axes of the tracks at positions `rows` (K,) towards expected axes (K, 2), px, in place (ours)."""
        stay = np.exp(-self.dynamics.dt / RELAXATION)
        bank = self.bank[:, rows, 2:]
        bank[kalman.PLACE] += (1 - stay) * (axes - bank[kalman.PLACE])
        bank[kalman.VAR] = stay**2 * bank[kalman.VAR] + (1 - stay**2) * var
        bank[kalman.COV] *= stay
        self.bank[:, rows, 2:] = bank
