"""One camera's constants: the empty scene's colours ready to be painted on, its depth, its ids."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.render.background import Geometry, Plate, paint_plate, survey
from sim.render.illumination import Illumination
from sim.render.random_fields import Swell
from sim.render.silhouettes import Crowd
from sim.scene.raycast import GROUND, NOTHING, PILLAR, WALL, PixelRays, Solids, pixel_rays, signed_scale, solids_of
from sim.types import Array, Camera, Ints, Motion

if TYPE_CHECKING:
    from scenarios.schema.picture import Picture
    from sim.render.foliage import Foliage

NODES = 16  # px between the places at which clouds and wind are asked for; linear between them
OCCLUDER = -2  # id of walls and pillars


@dataclass(frozen=True, eq=False)
class Easel:
    """What a frame is painted on: canvas (H, W, 3) and depth (H, W), at first the empty scene's, taken (H, W), the sun
    that people take, 0 … 255, and dirty (rows, columns), the tiles in which any of it has changed."""

    canvas: NDArray[np.int16]
    depth: NDArray[np.float32]
    taken: NDArray[np.uint8]
    dirty: NDArray[np.uint8]


class View:
    """The empty scene as one camera sees it, each part made when first needed."""

    def __init__(
        self, camera: Camera, motion: Motion, light: Illumination, picture: Picture, plants: Foliage | None
    ) -> None:
        self.camera, self.motion, self.light, self.picture, self.plants = camera, motion, light, picture, plants
        self.width, self.height = camera.image
        self.rays: PixelRays = pixel_rays(camera)
        self.solids: Solids = solids_of(motion.scene)
        self._spare: list[Easel] = []

    def easel(self) -> Easel:
        """The empty scene to paint on: one that was given back, or a new one."""
        from sim.render.people_shadow_kernels import TILE_H, TILE_W

        if self._spare:
            return self._spare.pop()
        size = self.height, self.width
        dirty = np.zeros((-(-self.height // TILE_H), -(-self.width // TILE_W)), np.uint8)
        return Easel(self.canvas.copy(), self.geometry.depth.copy(), np.zeros(size, np.uint8), dirty)

    def give_back(self, easel: Easel) -> None:
        """Wipe it for the next frame."""
        from sim.render.blur_noise_kernels import wipe

        flat = self.height, 3 * self.width
        plate, canvas = self.canvas.reshape(flat), easel.canvas.reshape(flat)
        wipe(easel.dirty, plate, self.geometry.depth, canvas, easel.depth, easel.taken)
        self._spare.append(easel)

    @cached_property
    def geometry(self) -> Geometry:
        """What the middle of each pixel shows."""
        return survey(self.camera, self.motion.scene)

    @cached_property
    def plate(self) -> Plate:
        """Its colours."""
        m = self.motion
        return paint_plate(self.camera, m.scene, self.light, self.picture.texture, self.plants, m.seed, m.repeat)

    @cached_property
    def canvas(self) -> NDArray[np.int16]:
        """(H, W, 3): the plate's colours times UNIT, sharp."""
        from sim.render.people_shadow_kernels import MOST, UNIT

        return np.asarray(np.clip(np.rint(self.plate.colour * np.float32(UNIT)), 0, MOST), np.int16)

    @cached_property
    def blurred(self) -> NDArray[np.int16]:
        """(H, W, 3): the canvas as the lens shows it."""
        from sim.render.blur_noise_kernels import blurred

        out, flat = np.empty_like(self.canvas), (self.height, 3 * self.width)
        blurred(self.canvas.reshape(flat), blur_weights(self.picture.blur_px), out.reshape(flat))
        return out

    @cached_property
    def _occluders(self) -> NDArray[np.int64] | None:
        solid = (self.geometry.kind == WALL) | (self.geometry.kind == PILLAR)
        return np.where(solid, OCCLUDER, 0).astype(np.int64) if solid.any() else None

    def empty_ids(self) -> NDArray[np.int64]:
        """(H, W), new: OCCLUDER where a wall or pillar shows, else 0."""
        return np.zeros((self.height, self.width), np.int64) if self._occluders is None else self._occluders.copy()

    @cached_property
    def level(self) -> bool:
        """Whether all that shadows can fall on is the ground at z = 0."""
        return bool(((self.geometry.kind == GROUND) | (self.geometry.kind == NOTHING)).all())

    @cached_property
    def _nodes(self) -> tuple[Array, Array]:
        """Level ground under every NODES-th pixel (J * I, 2) m, and the sd (J * I,) m of what each stands for."""
        u, v = np.meshgrid(*(np.arange(-(-n // NODES) + 1) * float(NODES) for n in (self.width, self.height)))
        uv1 = np.stack([u.ravel(), v.ravel(), np.ones(u.size)])
        o, d = self.rays.origin @ uv1, self.rays.direction @ uv1
        down = d[2] < 0
        t = np.where(down, -o[2] / np.where(down, d[2], -1.0), 0.0)
        per_px = (t if self.camera.kind == "pinhole" else 1.0) / abs(signed_scale(self.camera))
        slope = np.abs(d[2]) / np.linalg.norm(d, axis=0)
        spread = np.where(down, 0.5 * NODES * per_px / np.maximum(slope, 1e-9), np.inf)
        return (o + t * d)[:2].T, spread

    def _grid(self, field: Array) -> NDArray[np.float32]:
        return field.reshape(-(-self.height // NODES) + 1, -1).astype(np.float32)

    @cached_property
    def _clouds(self) -> Swell:
        return self.light.clouds.over(*self._nodes)

    def brightness(self, t: float, key: int) -> NDArray[np.float32]:
        """Brightness at time t (s) at every NODES-th pixel, (1, 1) if it is the same everywhere; key: the frame's."""
        gain = self.light.gain(t, key)
        if self.light.clouds.amplitude == 0:
            return np.full((1, 1), gain, np.float32)
        return self._grid(gain * np.exp(self._clouds.at(t)))

    @cached_property
    def _swells(self) -> tuple[Swell, Swell]:
        assert self.plants is not None
        places, _ = self._nodes
        across, down = (waves.over(places, np.zeros(len(places))) for waves in self.plants.sway)
        return across, down

    def wind(self, t: float) -> NDArray[np.float32]:
        """(2, J, I): sway of plants at time t (s) at every NODES-th pixel, px across and down."""
        assert self.plants is not None
        strength = self.plants.strength(t)
        return np.stack([self._grid(strength * swell.at(t)) for swell in self._swells])

    @cached_property
    def moving(self) -> Ints:
        """(S, 3): row, first column, last + 1 of the runs of pixels that show plants."""
        shown = np.pad(self.plate.plants > 0, ((0, 0), (1, 1))).astype(np.int8)
        row, edge = np.nonzero(np.diff(shown, axis=1))
        return np.column_stack([row[::2], edge[::2], edge[1::2]])

    def disparities(self, other: View) -> Array:
        """(H, W) px between this view of the empty scene and the other, to its right; nan where only this one sees."""
        from sim.render.pixel_truth_kernels import known

        out = np.empty((self.height, self.width))
        baseline = float(np.linalg.norm(other.camera.position - self.camera.position))
        known(
            self.geometry.depth, self.camera.focal_px[0] * baseline, other.rays.origin, other.rays.direction,
            self.solids, out,
        )  # fmt: skip
        return out


def blur_weights(sd: float) -> NDArray[np.float32]:
    """(2 r + 1,) weights of a Gaussian blur of `sd` px; (1,) for none."""
    radius = int(np.ceil(3 * sd))
    x = np.arange(-radius, radius + 1)
    weights = np.exp(-0.5 * (x / sd) ** 2) if radius else np.ones(1)
    return np.asarray(weights / weights.sum(), np.float32)


def sunlit(fixed: Solids, people: Crowd, sun: Array) -> Array:
    """(N, 3) share of the sun that walls, pillars and stairs leave to feet, waist and head: 0 or 1."""
    lit = np.ones((len(people.id), 3))
    if not any(len(part) for part in fixed if isinstance(part, np.ndarray)):
        return lit
    from sim.scene.raycast_kernels import first_hit

    hit = np.empty(6)
    for row, place, height in zip(lit, people.pos3, people.height, strict=True):
        for k, up in enumerate((0.12, 0.5, 0.95)):  # feet stand a step deep in drawn stairs
            row[k] = float(np.isinf(first_hit(place + np.array([0.0, 0.0, up * height]), sun, fixed, hit)))
    return lit
