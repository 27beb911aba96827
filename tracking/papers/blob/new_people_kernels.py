"""Kernels of new people in person_template: the number of templates that explains most.

Templates (K, 4) are upright ellipses x (middle), foot (lower edge), h, w, px. foreground (H, W) bool; cover (H, W)
int16: the number of templates over each pixel, plus EXPLAINED = 1000 where a blob of one person explains it. A
template's support is the sum over the pixels that it alone covers (foreground 1, background -1/2) over its area. Slow
twins for tests: tests/reference_templates.py.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools
from tracking.papers.blob import person_template_kernels as kernels
from tracking.papers.blob import person_template_search_kernels as search
from tracking.papers.blob.person_look_kernels import POINTS
from tracking.papers.blob.person_template_kernels import Cover, kernel

NO_IMAGE = np.zeros((0, 0, 3), np.uint8)  # read-only in kernels, as pictures are: fit_places is compiled once
EVIDENCE = 1000.0  # log-likelihood of full support: so large that the first guess hardly restrains a template


@kernel
def fit_new_people(
    foreground: Bools, cover: Cover, guesses: Array, most: int, person: float, support: float, spread: Array
) -> Array:
    """Returns the templates (K, 4) x, foot, h, w, px, of the best number of people in a region, 0 to `most`; paints
    them.

    foreground (H, W) bool; cover (H, W): painted templates per pixel, changed in place. guesses (1 + 2 + … + most, 4):
    first places for 1, 2, … people, one number after the other; from there fit_places moves them, with `spread` (one
    row per guess: standard deviation of x and foot, px). person: area of a person, px^2. The best number has the
    largest joint support in units of `person`, less `support` for each person. Joint support: covered pixels, 1 for
    foreground, -1/2 for background. Each template must have the share `support` of its own.
    """
    best, worth = np.zeros((0, 4)), 0.0
    no_looks = np.zeros((0, POINTS, 5))
    first = 0
    for count in range(1, most + 1):
        one, far = guesses[first : first + count], spread[first : first + count]
        first += count
        at = search.fit_places(foreground, cover, one, far, EVIDENCE, NO_IMAGE, no_looks)
        alone = kernels.supports(foreground, cover, at, 1)
        kernels.paint_all(cover, at, -1)
        value = joint_support(foreground, cover, at) / person - count * support
        least = np.inf
        for k in range(count):
            least = min(least, alone[k])
        if value > worth and least >= support:
            best, worth = at, value
    kernels.paint_all(cover, best, 1)
    return best


@kernel
def joint_support(foreground: Bools, cover: Cover, templates: Array) -> float:
    """Returns the sum over the pixels that at least one of the templates (K, 4) x, foot, h, w covers, in foreground
    pixels.

    A pixel counts 1 if it is foreground, -1/2 if not, 0 if something else is painted there. A template of which less
    than 0.3 is inside the image counts less. The templates must not be painted; `cover` (H, W) is the same afterwards.
    """
    total = 0.0
    for k in range(len(templates)):
        part = kernels.support(foreground, cover, templates[k], 0)
        total += part * kernels.area(templates[k], cover.shape[0], cover.shape[1])
        kernels.paint(cover, templates[k], 1)
    kernels.paint_all(cover, templates, -1)
    return total
