"""The tracks of `blob` from pixels: the population of boxes, and for each track an angle and a nominal covariance.

Where a person is partly hidden the measurement is noisier than R; the paper's rho, which counts measurements, is then
taken from a second covariance that knows the nominal R only. The state's h, w are the ellipse's axes and theta the
angle of the longer one, so that a track's upright box is the box round its ellipse.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Context, Ints
from tracking import kalman, lifecycle
from tracking.papers import blob_measure
from tracking.papers.blob_config import BlobConfig
from tracking.papers.blob_tracks import Population

HEADING = 6.0  # times faster than they lean people turn: from straight above the direction is the heading's


class People(Population):
    """N tracks; angle (2, N): direction rad and its variance; nominal (5, N, 4): as bank, with nominal noise."""

    def __init__(self, config: BlobConfig, dynamics: lifecycle.Dynamics, context: Context) -> None:
        self.angle, self.nominal = np.zeros((2, 0)), np.zeros((5, 0, 4))
        super().__init__(config, dynamics, context)
        rate = config.angle_rate * (HEADING if self.top else 1.0)
        self.turn = np.radians(rate) ** 2 * dynamics.dt

    def predict(self) -> None:
        """One frame on."""
        kalman.predict(self.nominal, self.dynamics.dt, self.q)
        self.angle[1] += self.turn
        super().predict()

    def quality(self) -> Array:
        """(N,) rho by the nominal covariance."""
        return lifecycle.rho(self.nominal, self.noise, self.asymptote)

    def uprights(self) -> Array:
        """(N, 4) boxes x, y, h, w round the predicted ellipses."""
        return blob_measure.upright(self.bank[kalman.PLACE], self.angle[0])

    def keep(self, rows: Ints) -> None:
        """Forget all other tracks."""
        self.angle, self.nominal = self.angle.take(rows, 1), self.nominal.take(rows, 1)
        super().keep(rows)

    def give_birth(self, z: Array, score: Array, t: float) -> None:
        """A tentative track for each z (K, 5)."""
        super().give_birth(z[:, :4], score, t)
        new = np.stack([z[:, 4], np.full(len(z), np.radians(30.0) ** 2)])
        self.angle = np.concatenate([self.angle, new], 1)
        self.nominal = np.concatenate([self.nominal, self.bank[:, self.bank.shape[1] - len(z) :]], 1)

    def update(self, rows: Ints, z: Array, noise: Array, angle_var: Array) -> Array:
        """Measure tracks at z (K, 5) with variances noise (K, 4) m^2 and angle_var (K,); squared distances (K,)."""
        terms = kalman.update(self.bank, rows, z[:, :4], noise)
        kalman.update(self.nominal, rows, z[:, :4], self.noise)
        kalman.angle_update(self.angle, rows, z[:, 4], angle_var)
        return np.asarray(np.add.reduce(terms, 1) / np.square(self.scale[rows]))

    def expect(self, rows: Ints, z: Array, var: float) -> None:
        """Measure the axes of tracks at z (K, 5), x, y left out, with variance `var` m^2; rho does not see it."""
        noise = np.tile([np.inf, np.inf, var, var], (len(rows), 1))
        kalman.update(self.bank, rows, z[:, :4], noise)
