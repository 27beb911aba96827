"""The people of a batch of up to 16 consecutive frames, in the world and as each camera view sees them.

They are computed for all frames of the batch at once, which is faster, and returned frame by frame.
"""

from __future__ import annotations

from dataclasses import dataclass

from sim.render.camera_view import CameraView
from sim.render.illumination import Illumination
from sim.render.people import DrawnPeople, ProjectedPeople, people_of_frames, project_people, take_rows
from sim.render.shadows import PeopleShadows, people_shadows, sunlit_shares
from sim.types import Array, Motion

FRAMES = 16  # frames of a batch


@dataclass(frozen=True, eq=False)
class PeopleInView:
    """N people of one or more frames as one camera view sees them."""

    projected: ProjectedPeople  # ProjectedPeople: rays in the axes of body and head, outlines in px
    shadows: PeopleShadows | None  # PeopleShadows; None if the light casts none
    # (N, 3) 1 if the sun reaches a person's feet, waist and head (columns), 0 if a solid thing, as a wall, hides it
    sunlit: Array


class FrameBatch:
    """The people of up to 16 consecutive frames of a Motion, among them frame `index`; batches begin at 1, 17, 33, ….

    State: all people of the batch, and what each view sees of them, computed when first asked for.
    """

    def __init__(self, motion: Motion, light: Illumination, index: int) -> None:
        self.first = index - (index - 1) % FRAMES
        self.light = light
        last = min(self.first + FRAMES, len(motion.present) + 1)
        self._people, self._starts = people_of_frames(motion, self.first, last)
        self._views: dict[int, PeopleInView] = {}

    def __contains__(self, index: int) -> bool:
        return index in range(self.first, self.first + FRAMES)

    def _rows(self, index: int) -> slice:
        k = index - self.first
        return slice(int(self._starts[k]), int(self._starts[k + 1]))

    def people(self, index: int) -> DrawnPeople:
        """Returns the people of frame `index`, sorted by id."""
        return take_rows(self._people, self._rows(index))

    def in_view(self, view: CameraView, side: int, index: int) -> PeopleInView:
        """Returns the people of frame `index` as a view sees them; `side` always names the same view."""
        if side not in self._views:
            light, people = self.light, self._people
            shadows = None
            if light.shadow > 0:
                shadows = people_shadows(view.camera, people, light.sun, light.penumbra, view.level)
            lit = sunlit_shares(view.solids, people, light.sun)
            self._views[side] = PeopleInView(project_people(view.camera, view.rays, people), shadows, lit)
        whole, rows = self._views[side], self._rows(index)
        shadows = None if whole.shadows is None else take_rows(whole.shadows, rows)
        return PeopleInView(take_rows(whole.projected, rows), shadows, whole.sunlit[rows])
