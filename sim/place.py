"""Where a recording was made: the static world, and the camera that sees it. `sim.types` exports these types."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from sim.arrays import Array, Bools, Frozen, Ints


@dataclass(frozen=True, slots=True, eq=False)
class Stairs(Frozen):
    """Stairs, all lengths in m: z rises in `steps` steps from 0 at the edge with midpoint foot (2,) to `rise` at the
    edge with midpoint head (2,), `width` wide; behind the head a plateau of length `landing` has z = rise (0: no
    plateau)."""

    foot: Array
    head: Array
    width: float
    rise: float
    steps: int
    landing: float = 0.0

    @classmethod
    def of(cls, s: Any) -> Stairs:
        """Returns Stairs with the values of an object `s` that has attributes of the same names."""
        return cls(np.array(s.foot, float), np.array(s.head, float), s.width, s.rise, int(s.steps), s.landing)


@dataclass(frozen=True, slots=True, eq=False)
class Box(Frozen):
    """A box: middle at (3,) m, size (3,) m along its own axes. It is turned by turn_deg about the vertical, then leans
    by tilt_deg over its own x axis, its top towards its own +y. colour (3,): red, green, blue, 0 to 255. pattern:
    "grain", "plain", "stripes" or "checks", which repeat every `period` m. gloss: share of light mirrored, 0 to 1."""

    at: Array
    size: Array
    turn_deg: float
    tilt_deg: float
    colour: Array
    pattern: str
    period: float
    gloss: float

    @classmethod
    def of(cls, b: Any) -> Box:
        """Returns the Box with the values of an object `b` that has attributes of the same names; its colour may be in
        words."""
        from scenarios.schema.colours import rgb

        colour = np.array(rgb(b.colour) if isinstance(b.colour, str) else b.colour, float)
        at, size = np.array(b.at, float), np.array(b.size, float)
        return cls(at, size, b.turn_deg, b.tilt_deg, colour, b.pattern, b.period, b.gloss)


@dataclass(frozen=True, slots=True, eq=False)
class Scene(Frozen):
    """The static world, in m: size (2,) x, y, from the origin on; walls (W, 2, 2): segments [x1, y1], [x2, y2]; pillars
    (P, 3): x, y, radius; doors (D, 2, 2): segments, openings that `walls` leave free; service (S, 2): service points x,
    y; stairs; wall_height, pillar_height; boxes. By default there is nothing but the ground."""

    size: Array
    walls: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))
    pillars: Array = field(default_factory=lambda: np.zeros((0, 3)))
    doors: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))
    service: Array = field(default_factory=lambda: np.zeros((0, 2)))
    stairs: tuple[Stairs, ...] = ()
    wall_height: float = 2.5
    pillar_height: float = 2.5
    boxes: tuple[Box, ...] = ()

    @classmethod
    def of(cls, world: Any, walls: Any, doors: Any) -> Scene:
        """Returns the Scene of a scenario's world, with these walls and doors in place of the world's own.

        walls, doors: segments x1, y1, x2, y2 in m, one each.
        """
        return cls(
            np.array(world.size, float), np.array(walls, float).reshape(-1, 2, 2),
            np.array(world.pillars, float).reshape(-1, 3), np.array(doors, float).reshape(-1, 2, 2),
            np.array(world.service, float).reshape(-1, 2),
            tuple(map(Stairs.of, world.stairs)), world.wall_height, world.pillar_height,
            tuple(map(Box.of, world.boxes or ())),
        )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Looks(Frozen):
    """How P people look in T frames, and M things without ids: what people hold, and distractors (sim.scene.figure).

    limbs: people have limbs. phase (T, P): of the gait, rad. swing (T, P): of the legs, 0 for standing, 1 at 1.4 m/s.
    worn (P, 4): who wears what, in the order of WORN; (P, 0) if nobody wears anything. kind (M,): index in THINGS.
    number (M,): id of the person who holds it, or the distractor's among those of its kind, from 1. size (M,): scale.
    place (T, M, 2) m, turn (T, M) rad, step (T, M) rad: where things are, their heading, and the phase of their legs;
    nan while absent."""

    limbs: bool
    phase: Array
    swing: Array
    worn: Bools
    kind: Ints
    number: Ints
    size: Array
    place: Array
    turn: Array
    step: Array

    def every(self, n: int) -> Looks:
        """Returns the looks in the frames 1, 1 + n, 1 + 2 n, … only."""
        return self.replace(**{k: getattr(self, k)[::n] for k in ("phase", "swing", "place", "turn", "step")})


@dataclass(frozen=True, slots=True, eq=False)
class Camera(Frozen):
    """A camera that maps world points X (3,) in m to pixels u, v; sim.scene.camera projects with it.

    kind "pinhole": x_cam = rotation (X - position) = (x right, y down, z forward) in m; u = fx x/z + cx, v = fy y/z +
    cy with focal_px (fx, fy), centre_px (cx, cy). kind "top": orthographic, looking straight down on `position`, scale
    px_per_m (nan for "pinhole"). image: (width, height) px. position (3,) m. rotation (3, 3), world to camera. baseline
    in m: the right camera is at +baseline along camera x; 0 without one. radial: Tsai's lens distortion, 0 for none:
    ideal coordinates p (1 + radial p'p) for p = ((u - cx)/fx, (v - cy)/fy) of the picture."""

    kind: Literal["pinhole", "top"]
    image: tuple[int, int]
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    position: Array
    rotation: Array
    baseline: float = 0.0
    px_per_m: float = float("nan")
    radial: float = 0.0
