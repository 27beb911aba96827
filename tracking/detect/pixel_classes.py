"""The five classes of a pixel (González et al. 2006, section 3.2), and which of them are foreground."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.types import Bools, Image

Floats = NDArray[np.float32]
# DARK: dark foreground. background_kernels writes these numbers out.
BACKGROUND, FOREGROUND, DARK, SHADOW, HIGHLIGHT = range(5)


def foreground(classes: Image) -> Bools:
    """(H, W): foreground and dark foreground, fused (section 3.3)."""
    return np.asarray((classes == FOREGROUND) | (classes == DARK))
