"""Connected regions and their moments the slow way: labels by scipy, then each region for itself."""

from __future__ import annotations

import numpy as np
from scipy import ndimage


def regions(mask, min_area):
    """(H, W) labels of the regions (8 neighbours) of at least min_area px, largest first, then in raster order."""
    label, count = ndimage.label(mask, np.ones((3, 3)))
    area = np.array([np.sum(label == k) for k in range(1, count + 1)])
    kept = [k for k in np.argsort(-area, kind="stable") if area[k] >= min_area]
    found = np.zeros(mask.shape, np.int32)
    for rank, k in enumerate(kept):
        found[label == k + 1] = rank + 1
    return found
