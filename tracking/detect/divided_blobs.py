"""Blobs that hold several people, divided into pieces of a person's size (ours).

How many people a blob may hold follows from its area: with r times a person's area, from r + 1/4 to r + 3/4, rounded
down, and at least one. Within these limits it is the number of tracked people whose boxes are centred in the blob. A
blob of less than LEAST of a person's area is left out.

The pixels go to the nearest of as many centres, distances being in a person's width and height. The centres start at
the tracked people, and in places far from these, and become the means of their pixels (k-means).
"""

from __future__ import annotations

import math

import numpy as np

from sim.types import Array
from tracking.detect.blobs import Blobs
from tracking.detect.person_size import PersonSize

FILLED = math.pi / 4  # Share of a person's box that the person fills.
FEWEST, MOST = 0.25, 0.75  # A blob of r times a person's area holds from r + FEWEST to r + MOST people, rounded down.
LEAST = 0.3  # A blob with a smaller share of a person's area is left out: a part of a person, or noise.
ROUNDS = 5  # Rounds of k-means.


def divided(found: Blobs, people: Array, size: PersonSize) -> Array:
    """Returns the boxes (N, 4), left, top, width, height, px, of the people in the blobs of a frame."""
    boxes = [np.zeros((0, 4))]
    centre = people[:, :2] + people[:, 2:] / 2
    foot = found.box[:, :2] + found.box[:, 2:] * np.array([0.5, 1.0])
    tall, wide = size.at(foot).T if len(found) else np.zeros((2, 0))
    for m, (box, area) in enumerate(zip(found.box, found.area.tolist(), strict=True)):
        inside = centre[((centre >= box[:2]) & (centre <= box[:2] + box[2:])).all(axis=1)]
        count = 1
        if np.isfinite(tall[m]):
            held = area / (FILLED * tall[m] * wide[m])
            if held < LEAST:
                continue
            count = min(max(len(inside), int(held + FEWEST), 1), max(int(held + MOST), 1))
        boxes.append(box[None] if count == 1 else _pieces(found, m, inside, count, np.array([wide[m], tall[m]])))
    return np.concatenate(boxes)


def _pieces(found: Blobs, row: int, known: Array, count: int, person: Array) -> Array:
    left, top, width, height = found.box[row].astype(int).tolist()
    v, u = np.nonzero(found.label[top : top + height, left : left + width] == row + 1)
    pixels = (np.stack([u + left, v + top], axis=1) + 0.5) / person
    centres = np.zeros((0, 2))
    for _ in range(count):
        choice = known / person if len(centres) < len(known) else pixels
        from_here = pixels.mean(axis=0)[None] if not len(centres) else centres
        centres = np.concatenate([centres, choice[_nearest(choice, from_here)[1].argmax()][None]])
    for _ in range(ROUNDS):
        owner = _nearest(pixels, centres)[0]
        owned = np.bincount(owner, minlength=len(centres))
        centres = centres[owned > 0]
        owner = (np.cumsum(owned > 0) - 1)[owner]
        sums = [np.bincount(owner, pixels[:, d]) for d in (0, 1)]
        centres = np.stack(sums, axis=1) / owned[owned > 0][:, None]
    owner = _nearest(pixels, centres)[0]
    places = [pixels[owner == k] * person for k in range(len(centres))]
    corners = [(p.min(axis=0) - 0.5, p.max(axis=0) + 0.5) for p in places if len(p)]
    return np.array([np.concatenate([low, high - low]) for low, high in corners])


def _nearest(points: Array, centres: Array) -> tuple[Array, Array]:
    squared = np.square(points[:, None] - centres).sum(axis=2)
    return squared.argmin(axis=1), squared.min(axis=1)
