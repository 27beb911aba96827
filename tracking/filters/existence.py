"""The existence probability of a track, and what a detector's score says of it (ours).

A track began with one detection (of `blob`, a box). It, and the track with it, is in one of four states: a person who
can be detected (S, shown) or not (H, hidden), a false object (F) that the detector takes for a person for a while, or
nothing any more (0). r = P(S) + P(H) is the existence probability. As in IPDA (Musicki, Evans, Stankovic 1994, "Markov
chain two") and JIPDA:

    predict   S, H -> 0 at the rate 1 / LIFETIME, F -> 0 at 1 / CLUTTER_TIME, S -> H at 1 / SHOWN_TIME, H -> S at
              1 / hidden_time: the same at each frame rate, as boxes within CLUTTER_TIME are no independent evidence
    missed    S, F times 1 - p                                p = P_D times the visible share of the box
    measured  S times 1 - p + p g e^l, F times 1 - p + p g    g = N(z; z_pred, S) / density of false boxes
    birth     S : F = U e^l : C + D                           U new people, C false boxes, D second boxes of people
                                                              expected there in a frame
All states are normalised to the sum 1 afterwards. l is the log-likelihood ratio of the score. `joint` has no scores
(l = 0) and no D; what is learned of scores serves `blob` alone.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints

SHOWN, HIDDEN, FALSE = range(3)  # Rows of probabilities.
BINS = 5  # ranges of scores, of as many boxes each
LEARNED = 2000  # boxes after which the calibration of scores is kept
DOUBT = 10.0  # boxes of each kind that each range of scores has in advance
LIFETIME = 15.0  # s: mean time that a person is in view
CLUTTER_TIME = 0.05  # s: mean time that a false box lasts
LASTING = 0.05  # share of a detector's false boxes that last, as on a poster
BIRTH_RATE = 0.5  # 1/s: new people
STANDING = 0.05  # share of the people in the first picture who stand in all pictures of the background
SHOWN_TIME = 1.0  # s: mean time in which a person can be detected


def transition(dt: float, hidden_time: float) -> Array:
    """Returns the matrix (3, 3) that maps the probabilities of shown, hidden and false to those dt s later. Sums that
    fall below 1 are objects that have gone. hidden_time: mean time for which a person is hidden, s."""
    hide, show = 1 / SHOWN_TIME, 1 / hidden_time
    left = (1 - np.exp(-(hide + show) * dt)) / (hide + show)
    stay, false = np.exp(-dt / LIFETIME), np.exp(-dt / CLUTTER_TIME)
    return np.array([
        [stay * (1 - hide * left), stay * show * left, 0],
        [stay * hide * left, stay * (1 - show * left), 0],
        [0, 0, false],
    ])  # fmt: skip


def newborn(person: Array) -> Array:
    """Returns the probabilities (3, K) of the states shown, hidden and false of K new tracks; person (K,): probability
    that each is a person, who is then shown."""
    return np.array([person, 0 * person, 1 - person])


def update(states: Array, rows: Ints, p: Array, g: Array, ratio: Array | float) -> None:
    """Updates the probabilities `states` (3, N) in place: tracks at `rows` (K,) were measured, all others missed. p
    (N,): probability of detection; g (K,): density of the measurement over that of false ones; ratio: of scores."""
    nothing, shown, false = 1 - states.sum(0), 1 - p, 1 - p
    measured = p[rows] * g
    shown[rows] += measured * ratio
    false[rows] += measured
    states[SHOWN] *= shown
    states[FALSE] *= false
    states /= states.sum(0) + nothing


def shown_share(hidden_time: float) -> float:
    """Returns the share of time in which a person can be detected; hidden_time: as of `transition`."""
    return SHOWN_TIME / (SHOWN_TIME + hidden_time)


def update_by_detector(
    states: Array, shown: Array, lasting: Array, standing: Array, rows: Ints, p: Array, g: Array, ratio: Array
) -> None:
    """Updates `states` (3, N), `shown`, `lasting` and `standing` (N,) in place with a detector's boxes beside pictures.

    rows, p, g, ratio: as of `update`. shown: probability that a person who walks can be seen by the detector, whether
    or not in the picture. lasting: probability that what is no person and no passing false object is a lasting false
    one. standing: probability that a hidden person stands in the background, and can be seen by the detector only.
    """
    nothing, person, false = 1 - states.sum(0), 1 - p, 1 - p
    measured = p[rows] * g
    person[rows] += measured * ratio
    false[rows] += measured
    walking = shown * person + (1 - shown)
    hidden = standing * person + (1 - standing) * walking
    shown *= person / walking
    standing *= person / hidden
    states[SHOWN] *= walking
    states[HIDDEN] *= hidden
    states[FALSE] *= false
    lasts, gone = nothing * lasting * false, nothing * (1 - lasting)
    lasting[:] = lasts / np.maximum(lasts + gone, 1e-300)
    states /= states.sum(0) + lasts + gone


class ScoreCalibration:
    """Log-likelihood ratios of scores, learned from the existence of the tracks that the boxes belong to.

    State: score, weight (M,): of the first boxes, the weight is the existence probability of the box's track.
    """

    def __init__(self) -> None:
        self.score, self.weight = np.zeros(0), np.zeros(0)
        self._learn()

    def ratios(self, score: Array) -> Array:
        """Returns p(score | person) / p(score | false box), (M,), of scores (M,)."""
        return np.asarray(self.table[np.searchsorted(self.edges, score)])

    def add(self, score: Array, weight: Array) -> None:
        """Adds boxes with scores (M,) and weights (M,), the probability that each is a person; only the first boxes
        count, later ones are ignored."""
        if len(self.score) < LEARNED and len(score):
            self.score, self.weight = np.append(self.score, score), np.append(self.weight, weight)
            self._learn()

    def _learn(self) -> None:
        if len(self.score) < 2:
            self.edges, self.table = np.zeros(0), np.ones(1)
            return
        self.edges = np.quantile(self.score, np.arange(1, BINS) / BINS)
        at = np.searchsorted(self.edges, self.score)
        person, false = (np.bincount(at, w, BINS) for w in (self.weight, 1 - self.weight))
        # prior boxes are divided among the ranges as all boxes are, so that equal scores have the ratio 1
        prior = np.bincount(at, minlength=BINS) / len(at) * DOUBT * BINS + 1e-9
        self.table = (person + prior) / (person + prior).sum() / (false + prior) * (false + prior).sum()
