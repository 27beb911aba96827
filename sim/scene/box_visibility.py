"""How much of each labelled person is seen, where a recording has boxes and nothing else: by their silhouettes.

Each box is taken for the upright person of sim.scene.body, body and head filling it, and the one whose box ends lower
in
the image for the nearer (flat ground, a level camera). Things that hide people and are not labelled hide nobody here.
"""

from __future__ import annotations

import numpy as np

from sim.scene.body import BODY, HEAD, SHOULDERS, Outlines
from sim.types import Array, Truth


def with_visibility(truth: Truth, image_size: tuple[int, int] | None) -> Truth:
    """The truth with visibility, truncation and visible boxes from its boxes; as it is where these are labelled.

    A visibility that the labels give is kept.
    """
    if truth.box is None or truth.visible_box is not None or not len(truth.box):
        return truth
    from sim.scene.visibility import packed_inverse
    from sim.scene.visibility_kernels import look

    size = np.array(image_size if image_size is not None else extent(truth.box), dtype=float)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(truth.frame)) + 1, [len(truth.frame)]]).astype(np.int64)
    ellipses = inscribed(truth.box)
    nowhere, flat = np.zeros((0, 2, 2)), (np.zeros((0, 4)), 0.0, np.zeros((0, 3)), 0.0, np.zeros((0, 9)))
    seen, cut, part = look(
        starts, np.array(truth.box), np.ascontiguousarray(ellipses.centre), packed_inverse(ellipses.shape),
        -(truth.box[:, 1] + truth.box[:, 3]), np.zeros((len(truth.box), 2)), size, False, np.zeros(3), np.eye(3),
        nowhere, 0.0, np.zeros((0, 3)), 0.0, flat,
    )  # fmt: skip
    labelled = bool((truth.visibility < 1).any())
    return truth.replace(visibility=truth.visibility if labelled else seen, truncation=cut, visible_box=part)


def inscribed(box: Array) -> Outlines:
    """Body and head as ellipses that fill boxes (N, 4) ltwh, as a person's fill theirs."""
    left, top, width, height = box.T
    middle = left + width / 2
    centre, shape = np.empty((len(box), 2, 2)), np.zeros((len(box), 2, 2, 2))
    for k, (part, wide) in enumerate(((BODY, 0.5), (HEAD, HEAD.across / SHOULDERS))):
        centre[:, k] = np.stack([middle, top + (1.0 - part.centre) * height], axis=1)
        shape[:, k, 0, 0], shape[:, k, 1, 1] = (wide * width) ** 2, (part.up * height) ** 2
    return Outlines(centre, shape)


def extent(*boxes: Array) -> tuple[int, int]:
    """An image that holds all these boxes: its width and height, px."""
    far = np.concatenate([box[:, :2] + box[:, 2:] for box in boxes]) if boxes else np.zeros((0, 2))
    width, height = np.ceil(far.max(axis=0, initial=1.0)) if len(far) else (1.0, 1.0)
    return int(width), int(height)
