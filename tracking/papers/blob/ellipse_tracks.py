"""The tracks of `blob` from pixels: the population of boxes, and for each track an angle and a nominal covariance.

Where a person is partly hidden the measurement is noisier than R, and axes are drawn to the expected ones; the paper's
rho, which counts measurements (4.5), is therefore taken from a second covariance that knows the nominal R only. The
state's h, w are the ellipse's axes, the longer one first as they are measured, and theta is the direction of h from the
abscissa, v down, modulo pi: a random walk (4.1). A track's upright box is the box round its ellipse.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Context, Ints
from tracking.detect.person_size import upright
from tracking.filters import kalman, track_uncertainty
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.track_management import Population

SETTLING = 0.5  # s in which the axes return to the expected ones
HEADING = 6.0  # times faster than they lean people turn: from straight above the direction turns with the heading


class People(Population):
    """N tracks; angle (2, N): direction rad and its variance; nominal (5, N, 4): as bank, with nominal noise."""

    def __init__(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics, context: Context) -> None:
        self.angle, self.nominal = np.zeros((2, 0)), np.zeros((5, 0, 4))
        super().__init__(config, dynamics, context)

    def follow(self, config: BlobConfig, dynamics: track_uncertainty.Dynamics) -> None:
        """Take on a config and the nominal filter that follows from it; the tracks stay as they are."""
        super().follow(config, dynamics)
        rate = config.angle_rate * (HEADING if self.top else 1.0)
        self.turn = np.radians(rate) ** 2 * dynamics.dt

    def predict(self) -> None:
        """One frame on."""
        kalman.predict(self.nominal, self.dynamics.dt, self.q)
        self.angle[1] += self.turn
        super().predict()

    def quality(self) -> Array:
        """(N,) rho by the nominal covariance."""
        return track_uncertainty.rho(self.nominal, self.noise, self.asymptote)

    def uprights(self) -> Array:
        """(N, 4) boxes x, y, h, w round the predicted ellipses."""
        return upright(self.bank[kalman.PLACE], self.angle[0])

    def keep(self, rows: Ints) -> None:
        """Forget all other tracks."""
        self.angle, self.nominal = self.angle.take(rows, 1), self.nominal.take(rows, 1)
        super().keep(rows)

    def give_birth(self, z: Array, score: Array, t: float) -> None:
        """A tentative track for each z (K, 5), its direction hardly known, so that the next one counts for more."""
        super().give_birth(z[:, :4], score, t)
        new = np.stack([z[:, 4], np.full(len(z), kalman.VAGUE)])
        self.angle = np.concatenate([self.angle, new], 1)
        self.nominal = np.concatenate([self.nominal, self.bank[:, self.bank.shape[1] - len(z) :]], 1)

    def turned(self, z: Array, angle_var: Array) -> Array:
        """(N, M) the direction's term y^2 / S of d^2 (eq. 9); z (M,) rad, angle_var (M,) rad^2; 0 for z without one."""
        s = self.angle[1][:, None] + angle_var
        turn = kalman.angle_innovation(z, self.angle[0][:, None])
        return np.where(kalman.directed(angle_var), turn * turn / s, 0.0)

    def update(self, rows: Ints, z: Array, noise: Array, angle_var: Array) -> Array:
        """Measure tracks at z (K, 5) with R noise (K, 4) m^2 and angle_var (K,) rad^2; d^2 (K,), direction included."""
        terms = kalman.update(self.bank, rows, z[:, :4], noise)
        turn = self.turned(z[:, 4], angle_var)[rows, np.arange(len(rows))]
        kalman.update(self.nominal, rows, z[:, :4], self.noise)
        kalman.angle_update(self.angle, rows, z[:, 4], angle_var)
        return np.asarray(np.add.reduce(terms, 1) / np.square(self.scale[rows]) + turn)

    def settle(self, rows: Ints, axes: Array, var: float) -> None:
        """Axes of tracks return to those (K, 2) px expected there, with variance `var` m^2; rho does not know of it.

        An Ornstein-Uhlenbeck step: s = e^(-dt / SETTLING), x = s x + (1 - s) expected, P = s^2 P + (1 - s^2) var.
        What is expected is the same in every frame, so it must not be counted as a measurement of each.
        """
        stay = np.exp(-self.dynamics.dt / SETTLING)
        bank = self.bank[:, rows, 2:]
        bank[kalman.PLACE] += (1 - stay) * (axes - bank[kalman.PLACE])
        bank[kalman.VAR] = stay**2 * bank[kalman.VAR] + (1 - stay**2) * var
        bank[kalman.COV] *= stay
        self.bank[:, rows, 2:] = bank
