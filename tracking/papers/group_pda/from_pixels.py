"""From a picture to the points of `group-pda`: foreground pixels on a grid, each a share of a person (ours).

The foreground comes from tracking.detect.foreground.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sim.scene.body import PERSON_HEIGHT, person_boxes
from sim.scene.camera import ground_jacobian, project, rays, to_ground
from sim.types import Array, Bools, Camera, Context, Image, Ints
from tracking.detect.foreground import Foreground, convex_areas
from tracking.detect.person_size import PersonSize
from tracking.detect.typical_person import DEPTH, SHOULDERS
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.running.image_scale import required

MOST_LEAN = 0.7  # Largest change of the spacing of upright lines from the image's middle to its edge, as a share.
ROWS = 9  # Rows of the image for which the size of people is computed; between them it is interpolated.
WIDTH_PER_HEIGHT = 0.3  # Width over height of a person in the image if there is no camera.
GRID = 0.1  # m: distance of the points of the grid.
LEAST_FALL = 0.1  # m per m of depth: a line of sight that falls less is taken to fall so much.
LEAST_SINE_TILT = 0.2  # Lower bound of `sine_tilt`: in a view along the ground depth cannot be measured.
LEAST_DEPTH = 1.0  # m: places nearer to the camera are shown as at this depth.


class GroundView(NamedTuple):
    """A map between image points, px, and the places on the ground, m, of the people whose middles are seen there.

    camera: one that shows all places (`radial` at least 0); without one, one that looks straight down. row: the image's
    middle row. foot: u, px, where upright lines meet. lean: share by which they come nearer to each other per px
    downwards.
    """

    camera: Camera
    row: float
    foot: float
    lean: float

    def spacing(self, row: Any) -> Array:
        """Returns the distance (M,) of upright lines in rows v (M,), px, over that in the middle row."""
        return np.asarray(1 - self.lean * (row - self.row))

    def along(self, u: Array, row: Any, other: Any) -> Array:
        """Returns u (M,), px, in `other` rows, of the upright lines through image points u, `row`, px."""
        return np.asarray(self.foot + (u - self.foot) * self.spacing(other) / self.spacing(row))

    def places(self, uv: Array) -> Array:
        """Returns the places (M, 2), m, of image points uv (M, 2), px; near the horizon at a finite distance."""
        eye, sight = rays(self.camera, uv)
        reach = (eye[:, 2:] - PERSON_HEIGHT / 2) / np.maximum(-sight[:, 2:], LEAST_FALL)
        return np.asarray(eye[:, :2] + reach * sight[:, :2])

    def image(self, places: Array) -> Array:
        """Returns the image points (M, 2), px, of places (M, 2), m."""
        ahead, middles = self.camera.rotation[2], np.insert(places, 2, PERSON_HEIGHT / 2, axis=1)
        short = np.maximum(LEAST_DEPTH - (middles - self.camera.position) @ ahead, 0.0)
        middles[:, :2] += short[:, None] * ahead[:2] / max(float(ahead[:2] @ ahead[:2]), 1e-9)
        return project(self.camera, middles)[0]

    def jacobian(self, places: Array) -> Array:
        """Returns the derivatives (M, 2, 2) of `image` at places (M, 2), px per m."""
        return np.asarray(
            np.linalg.inv(ground_jacobian(self.camera, self.image(places), PERSON_HEIGHT / 2)), np.float64
        )


class ForegroundPoints:
    """Foreground pixels on a grid as points, each a share of a person, put where the middle of that person is.

    A run of foreground along the image of an upright line shows people one behind the other: it reaches from the head
    of the last to the feet of the first. Who is in front is seen whole. So a run is cut into people from its lower end
    upwards; the middle of the last lies half a person below its upper end. A run shorter than a person shows a piece of
    one, whose middle is found as if the next run hid, or were, the rest of that person.

    State: config; foreground, the pipeline with its background model. scale: px per metre, the context's, or, if that
    is nan, learned from lone people in its background sample. step: px between the grid's points. view: from the image
    to the ground. rows (K,), person (K, 2): width and height, px, of a person whose middle is in that row. lines (C,),
    columns (H, C): of `upright_lines`.

    The context must have a background sample (else AssertionError). Raises InputError if the scale is neither known nor
    learned, if it is zero or negative, or if the sample cannot be used.
    """

    def __init__(self, config: GroupPdaConfig, context: Context) -> None:
        assert context.background is not None
        self.config = config
        self.foreground = Foreground(context, config)
        if np.isnan(context.px_per_m):
            self.foreground.learn_person_size(PersonSize(context), context.background)
        self.scale = required(self.foreground.px_per_m)
        self.step = max(1, round(GRID * self.scale))
        self.view = ground_view(context.camera, self.foreground.shape, self.scale)
        self.rows, self.person = _people(context.camera, self.view, self.scale)
        self.lines, self.columns = upright_lines(self.view, self.foreground.shape, self.step)

    def follow(self, config: GroupPdaConfig) -> None:
        """Replaces the config: settings of the background model change; what the model learned and the scale stay."""
        self.config = config
        self.foreground.follow(config)

    def points(self, image: Image, outlines: list[Array]) -> tuple[Array, Array, Array] | None:
        """Returns pixels (M, 2) u, v in px, where on the ground (M, 2) their people are, m, and the people (M,) that
        each stands for: the area about it over that of a person's ellipse. None if too much is foreground."""
        seen = self.foreground.segment(image)
        self.foreground.adapt(seen, convex_areas(self.foreground.shape, outlines))
        if not seen.plausible:
            return None
        line, top, bottom = upright_runs(seen.mask, self.columns)
        middle, length = (top + bottom) / 2, bottom - top
        wide, high = self._person_at(middle).T
        count = np.maximum(np.rint(length / self.step).astype(np.int64), 1)
        run = np.repeat(np.arange(len(line)), count)
        share = (np.arange(len(run)) - (np.cumsum(count) - count)[run] + 0.5) / count[run]
        row = np.floor(top[run] + share * length[run]) + 0.5
        head, feet = with_other_pieces(line, top, bottom, high)
        tall = np.minimum(high, feet - head)
        in_front = (feet[run] - row) // tall[run]
        whose = np.maximum(feet[run] - (in_front + 0.5) * tall[run], (head + tall / 2)[run])
        upright = self.lines[line[run]]
        pixels, middles = (np.column_stack([self.view.along(upright, self.view.row, v), v]) for v in (row, whose))
        weights = (length * self.step * self.view.spacing(middle) / (np.pi / 4 * wide * high) / count)[run]
        return pixels, self.view.places(middles), weights

    def outline(self, places: Array) -> Array:
        """Returns the corners (4 M, 2), px, of what the points of people at places (M, 2), m, cover of the image."""
        u, row = self.view.image(places).T
        half = self._person_at(row)[:, 1] / 2
        ends = [(self.view.along(u, row, end), end) for end in (row - half, row + half)]
        return np.concatenate([np.column_stack([x + k * self.step / 2, end]) for x, end in ends for k in (-1, 1)])

    def _person_at(self, row: Array) -> Array:
        return np.column_stack([np.interp(row, self.rows, size) for size in self.person.T])


def upright_lines(view: GroundView, shape: tuple[int, ...], step: int) -> tuple[Array, Ints]:
    """Returns u (C,), px, of upright lines in the middle row of an image of H x W px, `step` px apart there, and the
    column (H, C) of each line's pixel in each row, -1 outside the image."""
    ends = [view.along(np.array([0.0, shape[1]]), row, view.row) for row in (0.0, float(shape[0]))]
    lines, row = np.arange(np.min(ends), np.max(ends), step) + step / 2, np.arange(shape[0])[:, None] + 0.5
    column = np.floor(view.along(lines, view.row, row)).astype(np.int64)
    return lines, np.where((column >= 0) & (column < shape[1]), column, -1)


def upright_runs(mask: Bools, column: Ints) -> tuple[Ints, Array, Array]:
    """Returns the lines (R,) on which the R runs of foreground lie, and their upper and lower ends v (R,), px.

    mask (H, W); column (H, C): of each line's pixel in each row, -1 outside the image."""
    seen = np.pad(mask, ((0, 0), (0, 1)))[np.arange(len(mask))[:, None], column]
    edges = np.diff(np.pad(seen.T.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    (line, top), (_, bottom) = np.nonzero(edges > 0), np.nonzero(edges < 0)
    return line, top.astype(float), bottom.astype(float)


def with_other_pieces(line: Ints, top: Array, bottom: Array, high: Array) -> Array:
    """Returns upper and lower ends (2, R) of the R runs of `upright_runs`, px. A run that is shorter than a person,
    high (R,), and would reach the next on its line if it were as long, is a piece: it is continued into that run."""
    same, feet, head = line[1:] == line[:-1], (top + high)[:-1], (bottom - high)[1:]
    lower = np.where(same & (feet >= top[1:]), np.minimum(feet, bottom[1:]), -np.inf)
    upper = np.where(same & (head <= bottom[:-1]), np.maximum(head, top[:-1]), np.inf)
    ends = np.stack([top, bottom])
    ends[0, 1:], ends[1, :-1] = np.minimum(top[1:], upper), np.maximum(bottom[:-1], lower)
    return ends


def sine_tilt(camera: Camera | None) -> float:
    """Returns the sine of the camera's downward tilt, the factor by which depth on the ground is shortened in the
    image."""
    return 1.0 if camera is None else float(max(-camera.rotation[2, 2], LEAST_SINE_TILT))


def ground_view(camera: Camera | None, shape: tuple[int, ...], scale: float) -> GroundView:
    """Returns the view for an image of H x W px. Its scale, px per m, is the same everywhere without a pinhole camera,
    and if the image's middle is near the horizon or the camera below people's middles."""
    high, wide = shape[:2]
    fall = 0.0 if camera is None else -float(rays(camera, np.array([[wide, high]]) / 2)[1][0, 2])
    if camera is None or camera.kind == "top" or fall < LEAST_SINE_TILT or camera.position[2] <= PERSON_HEIGHT / 2:
        above, down = np.array([0.0, 0.0, PERSON_HEIGHT + LEAST_DEPTH]), np.diag([1.0, -1.0, -1.0])
        flat = Camera("top", (wide, high), (1.0, 1.0), (wide / 2, high / 2), above, down, px_per_m=scale)
        return GroundView(flat, high / 2, wide / 2, 0.0)
    (u, v), (fx, fy), (side, down, steep) = camera.centre_px, camera.focal_px, -camera.rotation[:, 2]
    steep = max(steep, 1e-3)
    lean = np.clip(steep / (fy * down + (v - high / 2) * steep), 0, 2 * MOST_LEAN / high)
    lens = camera.replace(radial=max(camera.radial, 0.0))
    return GroundView(lens, high / 2, float(u + fx * side / steep), float(lean))


def _people(camera: Camera | None, view: GroundView, scale: float) -> tuple[Array, Array]:
    rows = np.linspace(0, 2 * view.row, ROWS)
    usual = np.tile(scale * PERSON_HEIGHT * np.array([WIDTH_PER_HEIGHT, 1.0]), (ROWS, 1))
    if camera is None:
        return rows, usual
    ground = to_ground(camera, np.column_stack([np.full(ROWS, camera.centre_px[0]), rows]), PERSON_HEIGHT / 2)
    turns = np.tile(np.radians([0.0, 45.0, 90.0, 135.0]), ROWS)
    place = np.insert(np.repeat(ground, 4, 0), 2, 0.0, axis=1)
    tall, wide, deep = (np.full(len(turns), size) for size in (PERSON_HEIGHT, SHOULDERS, DEPTH))
    size = person_boxes(camera, place, turns, tall, wide, deep)[:, 2:].reshape(ROWS, 4, 2).mean(1)
    whole = np.isfinite(size).all(1)  # on the ground, in front of the camera
    return (rows[whole], size[whole]) if whole.any() else (rows, usual)
