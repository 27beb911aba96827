"""People as templates over a foreground mask: which places of how many people explain it best (ours).

A template is an upright ellipse in a box: x (its middle), foot (lower edge), h, w in px. Every foreground pixel that
some template covers counts 1, every background pixel against EMPTY, once however many templates cover it: so who is
partly hidden is measured by what shows of him, and a gap in the mask (a lamp post, camouflage) costs less than a second
person. Moving one template while the others rest needs sums over its rows only (tracking.papers.blob_template_kernels).

    support  of a template = (sum over the pixels that it alone covers) / its area in the image, at most 1
    settle   each in turn to the place of largest evidence * support - d^2 / 2, d from where it was expected
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.papers import blob_template_kernels as kernels

EMPTY = 0.5  # what a background pixel inside a template costs, a foreground pixel being worth 1
ELLIPSE = np.pi / 4  # share of its box that an ellipse fills
LEAST_INSIDE = 0.3  # a template further out of the image than this counts as so large
BARE = 0.1  # share of a template that no other covers below which he is hidden, not seen
STEPS_PER_HEIGHT = 24  # the coarse grid of moves
MOST_STEPS = 8
SWEEPS = 3


class Mask:
    """One frame's foreground. State: gain (H, W), what a pixel is worth; cover (H, W), templates over it, by 1000 what
    is explained already."""

    def __init__(self, foreground: Bools) -> None:
        self.gain = np.where(foreground, 1.0, -EMPTY)
        self.cover = np.zeros(foreground.shape, np.int64)
        self.sums = np.zeros((foreground.shape[0], foreground.shape[1] + 1))

    def close(self, region: Bools) -> None:
        """These pixels are explained: nobody is measured by them."""
        self.cover[region] += 1000

    def paint(self, templates: Array, more: int = 1) -> None:
        """Add (or take away) templates (K, 4)."""
        for x, foot, h, w in templates.tolist():
            kernels.paint(self.cover, x, foot, h, w, more)

    def area(self, templates: Array) -> Array:
        """(K,) px of templates inside the image."""
        x, foot, h, w = templates.T
        high, wide = self.gain.shape[0], self.gain.shape[1]
        across = np.minimum(x + w / 2, wide) - np.maximum(x - w / 2, 0)
        down = np.minimum(foot, high) - np.maximum(foot - h, 0)
        inside = np.maximum(across / w, 0) * np.maximum(down / h, 0)
        return np.asarray(ELLIPSE * h * w * np.maximum(inside, LEAST_INSIDE))

    def support(self, templates: Array) -> Array:
        """(K,) support of templates that are not painted."""
        return np.asarray(kernels.placed(self.gain, self.cover, self.sums, templates) / self.area(templates))

    def settle(self, templates: Array, spread: Array, evidence: float) -> Array:
        """Places (K, 4) of all templates together, near people (low feet) first; painted when done.

        spread (K, 2): standard deviation px of each one's expected x and foot; evidence: nats for full support.
        """
        found, order = templates.copy(), np.argsort(-templates[:, 1], kind="stable")
        self.paint(found)
        for sweep in range(SWEEPS):
            moved = False
            for k in order.tolist():
                self.paint(found[k : k + 1], -1)
                there = self._better(found[k], templates[k], spread[k], evidence, fine=sweep > 0)
                moved |= bool((there != found[k]).any())
                found[k] = there
                self.paint(found[k : k + 1])
            if not moved:
                break
        return found

    def _better(self, at: Array, expected: Array, spread: Array, evidence: float, *, fine: bool) -> Array:
        """The best place round `at` of one template that is not painted."""
        step = max(at[2] / STEPS_PER_HEIGHT, 1.0) / (2 if fine else 1)
        steps = 2 if fine else int(np.clip(np.ceil(2.5 * spread.max() / step), 2, MOST_STEPS))
        sums = kernels.moved(self.gain, self.cover, self.sums, at, steps, step)
        offset = step * np.arange(-steps, steps + 1)
        away = ((at[:2] - expected[:2])[:, None] + offset) / spread[:, None]
        value = evidence * sums / self.area(at[None]) - (away[0] ** 2 + away[1][:, None] ** 2) / 2
        if value.max() <= value[steps, steps]:
            return at
        i, j = np.unravel_index(int(value.argmax()), value.shape)
        return np.asarray(at + np.array([offset[j], offset[i], 0.0, 0.0]))

    def prune(self, templates: Array, least: float, *, pieces: bool = False) -> Ints:
        """Rows of painted templates with support `least` when those with too little are taken away, the weakest first.

        pieces: how much of what could be seen of somebody is foreground, so that a piece of him is enough, wherever the
        rest has gone: foreground over the pixels that no other template covers, if these are BARE of his own or more.
        Of two on one person either has less, and so goes.
        """
        rows = np.arange(len(templates))
        while len(rows):
            worth = self.pieces(templates[rows]) if pieces else self.alone(templates[rows])
            k = int(worth.argmin())
            if worth[k] >= least:
                break
            self.paint(templates[rows[k]][None], -1)
            rows = np.delete(rows, k)
        return rows

    def alone(self, templates: Array) -> Array:
        """(K,) support of painted templates, each by the pixels that no other covers."""
        return self._by_own_pixels(self.gain, templates)

    def pieces(self, templates: Array) -> Array:
        """(K,) share of foreground in the pixels that no other painted template covers; 0 where these are few."""
        bare = self._by_own_pixels(np.ones_like(self.gain), templates)
        seen = self._by_own_pixels(np.maximum(self.gain, 0.0), templates)
        return np.where(bare >= BARE, seen / np.maximum(bare, BARE), 0.0)

    def _by_own_pixels(self, gain: Array, templates: Array) -> Array:
        worth = np.zeros(len(templates))
        for k in range(len(templates)):
            one = templates[k : k + 1]
            self.paint(one, -1)
            worth[k] = (kernels.placed(gain, self.cover, self.sums, one) / self.area(one))[0]
            self.paint(one)
        return worth

    def shown(self, templates: Array) -> Array:
        """(K,) share of each painted template that no template with a lower foot, and nothing explained, covers."""
        before = self.cover
        share = np.zeros(len(templates))
        self.cover = np.where(before >= 1000, 1, 0)
        ones = np.ones_like(self.gain)
        for k in np.argsort(-templates[:, 1], kind="stable").tolist():
            one = templates[k : k + 1]
            share[k] = (kernels.placed(ones, self.cover, self.sums, one) / self.area(one))[0]
            self.paint(one)
        self.cover = before
        return np.minimum(share, 1.0)
