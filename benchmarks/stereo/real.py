"""The tracker's block matcher on a real rectified pair (Middlebury's Aloe, half size), beside OpenCV's StereoSGBM.

Printed: share of pixels that are matched, right of the columns without a partner; share of matches within 1 px of
StereoSGBM's, where both have one; median difference, px. The pair has no true disparities here.
"""

from __future__ import annotations

import argparse

import cv2
import numpy as np

from tracking.detect.subtraction_stereo import SubtractionStereo

LARGEST, BLOCK = 143, 9


def real(args: argparse.Namespace) -> list[float]:
    """Prints and returns the three figures."""
    paths = [args.data / "stereo" / f"aloe{side}.jpg" for side in "LR"]
    whole = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in paths]
    left, right = (cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) for image in whole)
    own = SubtractionStereo(LARGEST, BLOCK).dense(left, right)
    other = cv2.StereoSGBM.create(0, LARGEST + 1, 5, 600, 2400, 1, 31, 5, 100, 2).compute(left, right) / 16.0
    matched = np.isfinite(own)
    apart = np.abs(own - other)[matched & (other > 0)]
    made = [float(v) for v in (matched[:, LARGEST + 1 :].mean(), (apart <= 1).mean(), np.median(apart))]
    print("matched {:.3f}, within 1 px of StereoSGBM {:.3f}, median difference {:.3f} px".format(*made))
    return made
