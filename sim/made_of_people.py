"""How `Tracks` are made of the people that a tracker found, by their boxes or points, without stating all fields."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from sim.arrays import Array, no_ids


class MadeOfPeople:
    """Class methods of `sim.types.Tracks`."""

    __slots__ = ()

    @classmethod
    def of_boxes(cls, frame: Any, id: Any, box: Any, score: Any = (), **more: Any) -> Self:
        """Returns the tracks of people with boxes in the image, in the frame.

        Velocities are unknown, covariances are the identity, and nobody has a group, unless `more` says otherwise.

        Args:
            frame: The frame that `step` was given.
            id: Ids (N,) of the people, not below 0 and never used for another person.
            box: Boxes (N, 4): left, top, width, height in px.
            score: Scores (N,) in [0, 1], or empty.
            **more: Further fields of `Tracks`, such as `group` or `seen`.

        Example:
            return Tracks.of_boxes(frame, [t.id for t in found], [t.ltwh for t in found])
        """
        box = np.asarray(box, float).reshape(-1, 4)
        return cls._of_people(frame, "image", id, box[:, :2] + box[:, 2:] / 2, box=box, score=score, **more)

    @classmethod
    def of_points(cls, frame: Any, id: Any, pos: Any, score: Any = (), *, plane: str = "ground", **more: Any) -> Self:
        """Returns the tracks of people at points, in the frame. The other fields are as of `of_boxes`.

        Args:
            frame: The frame that `step` was given.
            id: As for `of_boxes`.
            pos: Positions (N, 2): x, y in m on the ground, or in px in the image; (N, 3) in space, m.
            score: As for `of_boxes`.
            plane: In which `pos` lies: "ground", "image" or "space".
            **more: Further fields of `Tracks`, such as `vel` or `box`.
        """
        pos = np.asarray(pos, float).reshape(-1, 3 if plane == "space" else 2)
        return cls._of_people(frame, plane, id, pos, score=score, **more)

    @classmethod
    def _of_people(cls, frame: Any, plane: str, id: Any, pos: Array, score: Any, **more: Any) -> Self:
        n, dims = pos.shape
        moving = {"vel": np.full((n, dims), np.nan), "cov": np.tile(np.eye(2 * dims), (n, 1, 1))}
        fields = {"group": np.full(n, -1), **moving, "score": np.asarray(score, float), **more}
        make: Any = cls
        return make(frame.index, frame.t, plane, "person", np.asarray(id) if n else no_ids(), pos=pos, **fields)  # type: ignore[no-any-return]
