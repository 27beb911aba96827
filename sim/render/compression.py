"""JPEG compression of a rendered image, which adds artefacts as a camera's own does."""

from __future__ import annotations

import numpy as np

from sim.types import Image


def compressed(image: Image, quality: int) -> Image:
    """Returns the image (H, W, 3) uint8, BGR, after JPEG compression with this quality, 1 (worst) to 100."""
    import cv2

    code = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR), np.uint8)
