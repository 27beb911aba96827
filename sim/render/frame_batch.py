"""People of a stretch of frames and how a view sees them: arrays made for all at once, cut frame by frame."""

from __future__ import annotations

from dataclasses import dataclass

from sim.render.camera_view import View, sunlit
from sim.render.illumination import Illumination
from sim.render.silhouettes import Cast, Crowd, Shadows, cast, crowd, cut, shadows
from sim.types import Array, Motion

FRAMES = 16


@dataclass(frozen=True, eq=False)
class Sight:
    """One view of the people of a frame: outlines, shadows (None without), share of the sun (N, 3) on each."""

    cast: Cast
    shadows: Shadows | None
    sunlit: Array


class Stretch:
    """Frames first … first + FRAMES - 1 of a motion; views are added when they are first asked for."""

    def __init__(self, motion: Motion, light: Illumination, index: int) -> None:
        self.first = index - (index - 1) % FRAMES
        self.light = light
        last = min(self.first + FRAMES, len(motion.present) + 1)
        self.people, self.starts = crowd(motion, self.first, last)
        self._sights: dict[int, Sight] = {}

    def rows(self, index: int) -> slice:
        """Rows of a frame."""
        k = index - self.first
        return slice(int(self.starts[k]), int(self.starts[k + 1]))

    def crowd(self, index: int) -> Crowd:
        """The people of a frame."""
        return cut(self.people, self.rows(index))

    def sight(self, view: View, side: int, index: int) -> Sight:
        """They as one view (of this side, always the same) sees them."""
        if side not in self._sights:
            light, people = self.light, self.people
            fall = shadows(view.camera, people, light.sun, light.penumbra, view.level) if light.shadow > 0 else None
            lit = sunlit(view.solids, people, light.sun)
            self._sights[side] = Sight(cast(view.camera, view.rays, people), fall, lit)
        whole, rows = self._sights[side], self.rows(index)
        fall = None if whole.shadows is None else cut(whole.shadows, rows)
        return Sight(cut(whole.cast, rows), fall, whole.sunlit[rows])
