"""The working image that a frame is drawn on: its number format, its tiles, and the arrays that go with it.

A canvas holds grey levels times UNIT = 64 as int16, in BGR. Drawing marks the tiles (8 rows x 16 columns of px) it
changes as dirty. Only dirty tiles are blurred anew when the frame is finished, and only they are restored to the empty
scene afterwards.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

UNIT = 64.0  # canvas value of one grey level
MOST = 32767.0  # highest canvas value
MID_GREY = 128.0  # grey level at which the noise has the standard deviation of the scenario
TILE_H, TILE_W = 8, 16  # px
FIRST_ROW, END_ROW, FIRST_COLUMN, END_COLUMN = range(4)  # columns of pixel bounds; the ends are exclusive
RUN_ROW, RUN_FIRST, RUN_END = range(3)  # columns of runs of pixels: row, first column, last column + 1


class FrameCanvas(NamedTuple):
    """What one frame of one view is drawn on; at first the empty scene. The arrays are changed by drawing."""

    colour: NDArray[np.int16]  # (H, W, 3) int16, BGR: grey levels times UNIT (64)
    depth: NDArray[np.float32]  # (H, W) float32: m along the optical axis, inf for sky
    shaded: NDArray[np.uint8]  # (H, W) uint8: 255 times the share of the direct sun that people's shadows take
    # (rows, columns) uint8: 1 for tiles (8 rows x 16 columns of px) in which any of these changed, or that have a
    # change of colour within the radius of the blur
    dirty: NDArray[np.uint8]
