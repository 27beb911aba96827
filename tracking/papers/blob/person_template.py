"""TrackedEllipses as templates over a foreground mask: which places of how many people explain it best (ours).

A template is an upright ellipse in a box: x (its middle), foot (lower edge), h, w in px. Every foreground pixel that
some template covers counts 1, every background pixel against 1/2, once however many templates cover it: so who is
partly hidden is measured by what shows of him, and a gap in the mask (a lamp post, camouflage) costs less than a second
person. Moving one template while the others rest needs sums over its rows only
(tracking.papers.blob.person_template_search_kernels).

    support  of a template = (sum over the pixels that it alone covers) / its area in the image, at most 1
    settle   each in turn to the place of largest evidence * support - d^2 / 2, d from where it was expected
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.detect.blobs import Labels
from tracking.papers.blob import person_template_kernels as kernels
from tracking.papers.blob import person_template_search_kernels as moves
from tracking.papers.blob.person_template_kernels import ELLIPSE as ELLIPSE


class ExplainedForeground:
    """One frame's foreground (H, W). State: cover (H, W), templates painted over each pixel, EXPLAINED more where it is
    explained already."""

    def __init__(self, foreground: Bools) -> None:
        self.foreground = foreground
        self.cover: kernels.Cover = np.zeros(foreground.shape, np.int16)

    def mark_explained(self, label: Labels, rows: Ints) -> None:
        """The regions row + 1 of labels (H, W) are explained: nobody is measured by them."""
        which = np.zeros(int(rows.max(initial=-1)) + 2, bool)
        which[rows + 1] = True
        kernels.mark_explained(self.cover, label, which)

    def unexplained(self) -> Bools:
        """(H, W) the foreground that nothing explains."""
        return np.asarray(self.foreground & (self.cover == 0))

    def fit_places(self, templates: Array, spread: Array, evidence: float) -> Array:
        """Places (K, 4) of all templates together, near people (low feet) first; painted when done.

        spread (K, 2): standard deviation px of each one's expected x and foot; evidence: nats for full support.
        """
        return moves.fit_places(self.foreground, self.cover, templates, spread, evidence)

    def prune(self, templates: Array, least: float, *, pieces: bool = False) -> Ints:
        """Rows of painted templates with support `least` when those with too little are taken away, the weakest first.

        pieces: how much of what could be seen of somebody is foreground, so that a piece of him is enough, wherever the
        rest has gone: foreground over the pixels that no other template covers, if these are BARE of his own or more.
        Of two on one person either has less, and so goes.
        """
        return np.flatnonzero(kernels.prune(self.foreground, self.cover, templates, least, pieces))

    def support(self, templates: Array) -> Array:
        """(K,) support of painted templates, each by the pixels that no other covers."""
        return kernels.supports(self.foreground, self.cover, templates, 1)

    def visible_share(self, templates: Array) -> Array:
        """(K,) share of each template that none of these with a lower foot, and nothing explained, covers."""
        return kernels.visible_share(self.cover, templates)


def template_mask(shape: tuple[int, ...], templates: Array) -> Bools:
    """(H, W) the pixels that templates (K, 4) cover."""
    cover = np.zeros(shape, np.int16)
    kernels.paint_all(cover, templates, 1)
    return cover > 0
