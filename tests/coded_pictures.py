"""Pictures whose frame number stands in their pixels, and sequences of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sim.types import Frame, Sequence

SIZE = (83, 61)  # odd, as few videos are
BITS = 8


def coded(number: int, size: tuple[int, int] = SIZE) -> np.ndarray:
    """(H, W, 3) with a bright block of 8 px for each bit that is set."""
    picture = np.full((size[1], size[0], 3), 90, np.uint8)
    for bit in range(BITS):
        picture[8:24, 8 + 9 * bit : 16 + 9 * bit] = 235 if number >> bit & 1 else 16
    return picture


def number(picture: np.ndarray, top: int = 0, factor: int = 1) -> int:
    """The number in a picture that is shown `factor` times as large, `top` px further down."""
    y = top + 16 * factor
    return sum(int(picture[y, (12 + 9 * bit) * factor].mean() > 126) << bit for bit in range(BITS))


def sequence(length: int, fps: float = 10.0, lost: tuple[int, ...] = (), path: Path | None = None) -> Sequence:
    """A bare recording; no picture in the lost frames."""

    def frames() -> Iterator[Frame]:
        for k in range(1, length + 1):
            yield Frame(k, (k - 1) / fps, None if k in lost else coded(k))

    return Sequence(
        "coded", fps, length, frames, image_size=SIZE, has_images=True,
        source={} if path is None else {"path": str(path)},
    )  # fmt: skip
