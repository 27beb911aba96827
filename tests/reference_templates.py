"""Templates over a mask the slow way: every pixel of every ellipse asked one by one."""

from __future__ import annotations

import numpy as np


def pixels(shape, x, foot, h, w):
    """(H, W) pixels whose middle lies in the ellipse that fills the box of h x w px on (x, foot)."""
    v, u = np.mgrid[: shape[0], : shape[1]] + 0.5
    return (2 * (u - x) / w) ** 2 + (2 * (v - foot) / h + 1) ** 2 <= 1


def worth(gain, cover, template):
    """Sum of gain over the uncovered pixels of a template."""
    return float(gain[pixels(gain.shape, *template) & (cover == 0)].sum())


def moved(gain, cover, template, steps, step):
    """The same for the template moved by -steps..steps times step, rows down, columns right."""
    offset = step * np.arange(-steps, steps + 1)
    return np.array([[worth(gain, cover, np.add(template, (a, b, 0, 0))) for a in offset] for b in offset])
