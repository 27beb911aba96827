"""Completes tracks with groups and events while they are made, as soon as the ground and the scale are known."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sim.scene.camera import BOXES as SCALE_BOXES
from sim.types import Array, Camera, Groups, Scene, Tracks
from tracking.grouping.foot_points import boxes_stand, ground_below, places_on
from tracking.grouping.ground_of_boxes import BOXES, LONGEST, Ground
from tracking.grouping.grouped_tracks import GroupsSoFar, Velocities, names_groups
from tracking.grouping.grouping_choice import Grouping, default_grouping
from tracking.running import image_scale
from tracking.running.image_scale import ImageScale


class Completion:
    """Fills in groups and events of the tracks of one tracker, frame by frame.

    If the ground under the boxes is known (`ground_below`), groups are derived from positions there. known: the scale
    of tracks in the image; nan: the tracker's own, which `learned` returns, or that of its first boxes. camera, scene,
    image_size, objective: as of `foot_points.completed`.

    State: waiting, the tracks of frames that are not completed yet; scale, ground, that were found; groups, which
    complete the tracks; velocities, which fill in no more than that; both None until ground and scale are known;
    moving, the frame from which on the camera moves and boxes show no ground, None while it stands still.
    """

    def __init__(
        self, fps: float, known: ImageScale, learned: Callable[[], float], rule: Grouping | None = None, *,
        camera: Camera | None, scene: Scene | None, image_size: tuple[int, int] | None = None, objective: bool = False,
    ) -> None:  # fmt: skip
        self.objective = objective
        self.fps, self.known, self.learned, self.rule = fps, known, learned, rule or default_grouping()
        self.camera, self.scene, self.image_size = camera, scene, image_size
        self.waiting, self.scale, self.ground = list[Tracks](), known, Ground()
        self.groups: GroupsSoFar | None = None
        self.velocities: Velocities | None = None
        self.boxes = 0
        self.moving: int | None = None

    @property
    def settled(self) -> bool:
        """Whether tracks are completed at once."""
        return self.groups is not None or self.velocities is not None

    def add(self, tracks: Sequence[Tracks]) -> list[Tracks]:
        """Returns the tracks of the frames that can be completed now, after the tracks of the next frames."""
        out, k = list[Tracks](), 0
        while k < len(tracks) and not self.settled:
            out += self._first(tracks[k])
            k += 1
        return out + (self._completed(tracks[k:]) if k < len(tracks) else [])

    def _first(self, tracks: Tracks) -> list[Tracks]:
        if not self.waiting and not len(tracks.id) and tracks.groups is None:
            return [tracks.replace(groups=Groups.none(), derived=True)]  # before anybody is there
        self.waiting.append(tracks)
        self.boxes += 0 if tracks.box is None else int(np.count_nonzero(tracks.measured))
        return self._begun() if self._enough() else []

    def rest(self) -> list[Tracks]:
        """Returns the tracks of the frames that are not completed when the recording ends."""
        return self._begun() if self.waiting else []

    def with_events_at_end(self, last: Tracks) -> Tracks:
        """Returns the tracks of the last frame, completed, with the events that are reported there because the
        recording ends."""
        return last if self.groups is None else self.groups.ended([last])[0]

    def _enough(self) -> bool:
        """Returns whether ground and scale would be the same with more tracks."""
        first, last = self.waiting[0], self.waiting[-1]
        if first.unit == "group" or first.plane != "image" or last.t > first.t + LONGEST:
            return True
        known = np.isfinite(self.known.px_per_m) or np.isfinite(self.learned())
        stands = boxes_stand(self.waiting) and not self._moves(last)
        if stands and self.camera is None and not names_groups(self.waiting):
            return self.boxes >= BOXES
        return known or (stands and self.camera is not None) or self.boxes > SCALE_BOXES

    def _begun(self) -> list[Tracks]:
        waiting, self.waiting = self.waiting, []
        self.scale = image_scale.from_tracks(self.known, self.learned(), waiting)
        px_per_m = self.scale.px_per_m
        if not any(t.unit == "group" for t in waiting) and not self._moves(waiting[-1]):
            self.ground = ground_below(waiting, self.camera, px_per_m, self.image_size)
        if self.ground.camera is not None:
            self.groups = GroupsSoFar(self.fps, 1.0, self.rule, objective=self.objective, places=self._places)
        elif waiting[0].unit == "person" and (waiting[0].plane != "image" or np.isfinite(px_per_m)):
            self.groups = GroupsSoFar(self.fps, px_per_m, self.rule, objective=self.objective)
        else:
            self.velocities = Velocities(self.fps)
        return self._completed(waiting)

    def _moves(self, tracks: Tracks) -> bool:
        return self.moving is not None and self.moving <= tracks.index

    def _places(self, tracks: Sequence[Tracks]) -> Array:
        """Returns where people are on the ground, (R, 2), m; in the image, by its scale, once the camera moves."""
        still = [t for t in tracks if not self._moves(t)]
        moved = [t.pos / self.scale.px_per_m for t in tracks[len(still) :]]
        return np.concatenate([places_on(self.ground, self.scene, still), *moved])

    def _completed(self, tracks: Sequence[Tracks]) -> list[Tracks]:
        if self.groups is not None:
            return self.groups.add(tracks)
        assert self.velocities is not None
        return list(tracks) if tracks[0].unit == "group" else self.velocities.add(tracks)
