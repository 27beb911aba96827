"""What is the same in all frames that one camera sees, computed when first needed.

It holds the geometry (depth, kind of surface, place) and the colours of the empty scene, canvases to draw on, and the
random fields from which brightness and wind in the image follow at any time; also the weights of the lens blur, and
where each frame's noise comes from.

Noise is normal and independent in each pixel and colour; part of its variance grows with brightness. At grey level x
its variance is sd² (1 - shot + shot x / MID_GREY). sd is the scenario's standard deviation in grey levels, at MID_GREY
= 128. shot is the share (0 to 1) of shot noise, that of the light; the rest is the read noise of the circuits. Fresh
normal numbers for each frame would cost more than all the rest. A long pool is therefore drawn once, and each row of
each image reads a stretch of it that begins at a random offset. Any two pixels, rows or frames are independent unless
they begin at the same offset, which has a chance of one in POOL = 2^20.

The empty scene as one camera sees it, traced and painted once for all frames of a sequence.

`PixelGeometry` is exact, for the ray through each pixel's centre. Colours are means over each pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenarios.limits import PICTURE_SIDE
from sim.render.canvas import MOST, TILE_H, TILE_W, UNIT, FrameCanvas
from sim.render.materials import Style
from sim.render.weather import Foliage, Illumination
from sim.rng import rng
from sim.scene.raycast import BOX, GROUND, NOTHING, PILLAR, WALL, PixelRays, Solids, pixel_rays, signed_scale, solids_of
from sim.types import Array, Camera, Ints, Motion

if TYPE_CHECKING:
    from scenarios.schema.pictures import Picture


Floats = NDArray[np.float32]


@dataclass(frozen=True)
class PixelGeometry:
    """What each pixel's centre shows of the empty scene."""

    depth: Floats  # (H, W) float32: m along the optical axis; inf for sky
    # (H, W) uint8: NOTHING (sky), GROUND, WALL, PILLAR, TREAD, RISER or BOX of `sim.scene.raycast`
    kind: NDArray[np.uint8]
    place: Floats  # (3, H, W) float32: x, y, z in m in the world; 1e9 for sky


@dataclass(frozen=True)
class EmptyScene:
    """The painted empty scene, float32; each pixel is a mean of samples x samples rays, at least 2 x 2 at edges."""

    colour: Floats  # (H, W, 3) BGR in grey levels, 0 or more, not clipped at 255; lit, without plants' sway and noise
    # (H, W) share of direct sun in the pixel's light, 0 to 1; 0 for sky and where a solid thing hides the sun
    direct: Floats
    plants: Floats  # (H, W) share of the pixel that shows plants, 0 to 1


POOL = 1 << 20
FRAMES_PER_DRAW = 16  # frames whose offsets are drawn in one call
LONGEST = 3 * PICTURE_SIDE  # numbers that a row may need: 3 colours, the widest image


def blur_weights(sd: float, sharpen: float = 0.0) -> NDArray[np.float32]:
    """Returns the weights (2 r + 1,), sum 1, of a Gaussian blur of standard deviation `sd` px; r = 3 sd, rounded up.

    sharpen: by how much the difference from a blur of 2 sd + 0.5 px is enhanced; r is that blur's.
    """
    wide = 2 * sd + 0.5
    radius = int(np.ceil(3 * (wide if sharpen > 0 else sd)))
    x = np.arange(-radius, radius + 1)

    def gauss(sd: float) -> Array:
        weights = np.exp(-0.5 * (x / sd) ** 2) if sd else (x == 0) * 1.0
        return np.asarray(weights / weights.sum())

    return np.asarray(gauss(sd) if sharpen == 0 else (1 + sharpen) * gauss(sd) - sharpen * gauss(wide), np.float32)


@cache
def _normals() -> NDArray[np.float32]:
    # The same for all seeds; the first numbers are repeated, so that no row ends beyond the pool.
    normals = rng(0, "noise").standard_normal(POOL, dtype=np.float32)
    return np.concatenate([normals, normals[:LONGEST]])


def noise_pool(sd: float, unit: float) -> NDArray[np.int16]:
    """Returns (POOL + LONGEST,) int16: normal numbers of standard deviation `sd` grey levels, times `unit`, rounded."""
    return np.asarray(np.clip(np.rint(_normals() * np.float32(sd * unit)), -32768, 32767), np.int16)


@lru_cache(maxsize=4)
def _offsets_of_frames(rows: int, seed: int, side: int, draw: int, repeat: int) -> Ints:
    return rng(seed, "noise", side, draw, repeat=repeat).integers(POOL, size=(FRAMES_PER_DRAW, rows))


def noise_offsets(rows: int, seed: int, repeat: int, side: int, frame: int) -> Ints:
    """Returns the index in the noise pool at which the noise of each image row begins, (rows,).

    side: 0 the left camera, 1 the right one. frame: number from 1 plus BACKGROUNDS; background images have 1 to 50.
    """
    return np.asarray(_offsets_of_frames(rows, seed, side, frame // FRAMES_PER_DRAW, repeat)[frame % FRAMES_PER_DRAW])


NODE_STEP = 16  # px between the nodes at which clouds and wind are computed; they are linear between
OCCLUDER = -2  # id of walls, pillars, boxes and things in id maps


class CameraView:
    """The empty scene as one camera sees it; each part is computed when first needed, and kept.

    State: canvases that were given back, for the next frame. side: 0 the left camera, 1 the right one. plants is None
    without plants. materials: of `draw_materials`.
    """

    def __init__(
        self, camera: Camera, side: int, motion: Motion, light: Illumination, picture: Picture, plants: Foliage | None,
        materials: tuple[Array, Style],
    ) -> None:  # fmt: skip
        self.camera, self.side, self.motion = camera, side, motion
        self.light, self.picture, self.plants, self.materials = light, picture, plants, materials
        self.width, self.height = camera.image
        self.rays: PixelRays = pixel_rays(camera)
        self.solids: Solids = solids_of(motion.scene)
        self._spare: list[FrameCanvas] = []

    def take_canvas(self) -> FrameCanvas:
        """Returns a canvas that shows the empty scene, to draw on; give it back with `return_canvas`."""
        if self._spare:
            return self._spare.pop()
        size = self.height, self.width
        dirty = np.zeros((-(-self.height // TILE_H), -(-self.width // TILE_W)), np.uint8)
        return FrameCanvas(self.empty_canvas.copy(), self.geometry.depth.copy(), np.zeros(size, np.uint8), dirty)

    def return_canvas(self, canvas: FrameCanvas) -> None:
        """Takes back a canvas of `take_canvas`: restores it to the empty scene and keeps it for the next call."""
        from sim.render.canvas_kernels import restore

        flat = self.height, 3 * self.width
        empty, colour = self.empty_canvas.reshape(flat), canvas.colour.reshape(flat)
        restore(canvas.dirty, empty, self.geometry.depth, colour, canvas.depth, canvas.shaded)
        self._spare.append(canvas)

    @cached_property
    def geometry(self) -> PixelGeometry:
        """What the centre of each pixel shows of the empty scene."""
        from sim.render.empty_scene_kernels import trace_pixels

        size = self.height, self.width
        depth, kind, place = np.empty(size, np.float32), np.empty(size, np.uint8), np.empty((3, *size), np.float32)
        trace_pixels(self.rays, self.solids, self.materials[1], depth, kind, place)
        return PixelGeometry(depth, kind, place)

    @cached_property
    def empty_scene(self) -> EmptyScene:
        """The painted empty scene under steady light, with unmoved plants."""
        from sim.render.empty_scene_kernels import paint_pixels

        size, light = (self.height, self.width), self.light
        colour, direct, green = np.empty((*size, 3), np.float32), *np.empty((2, *size), np.float32)
        palette, style = self.materials
        paint_pixels(
            self.rays, self.picture.samples, signed_scale(self.camera), light.sun, light.shadow, light.penumbra,
            self.solids, np.array(self.motion.scene.size, dtype=float), style, palette, colour, direct, green,
        )  # fmt: skip
        return EmptyScene(colour, direct, green)

    @cached_property
    def empty_canvas(self) -> NDArray[np.int16]:
        """Colours (H, W, 3) of the empty scene as canvas values, not blurred."""
        return np.asarray(np.clip(np.rint(self.empty_scene.colour * np.float32(UNIT)), 0, MOST), np.int16)

    @cached_property
    def blurred_canvas(self) -> NDArray[np.int16]:
        """Colours (H, W, 3) of the empty scene as canvas values, blurred."""
        from sim.render.blur_noise_kernels import blur_all

        out, flat = np.empty_like(self.empty_canvas), (self.height, 3 * self.width)
        weights = blur_weights(self.picture.blur_px, self.picture.sharpen)
        blur_all(self.empty_canvas.reshape(flat), weights, out.reshape(flat))
        return out

    @cached_property
    def _occluders(self) -> NDArray[np.int64] | None:
        solid = np.isin(self.geometry.kind, (WALL, PILLAR, BOX))
        return np.where(solid, OCCLUDER, 0).astype(np.int64) if solid.any() else None

    def empty_ids(self) -> NDArray[np.int64]:
        """Returns a new id map (H, W) of the empty scene: OCCLUDER where a wall, pillar or box shows, else 0."""
        # Zeros are quicker than a copy of zeros.
        return np.zeros((self.height, self.width), np.int64) if self._occluders is None else self._occluders.copy()

    @cached_property
    def level(self) -> bool:
        """True if the image shows only level ground and sky, so that shadows fall only on z = 0."""
        return bool(((self.geometry.kind == GROUND) | (self.geometry.kind == NOTHING)).all())

    @cached_property
    def _nodes(self) -> tuple[Array, Array]:
        """Ground points (J * I, 2) m at every 16th pixel, and the half size (J * I,) m of what 16 px cover there."""
        u, v = np.meshgrid(*(np.arange(-(-n // NODE_STEP) + 1) * float(NODE_STEP) for n in (self.width, self.height)))
        uv1 = np.stack([u.ravel(), v.ravel(), np.ones(u.size)])
        o, d = self.rays.origin @ uv1, self.rays.direction @ uv1
        down = d[2] < 0
        t = np.where(down, -o[2] / np.where(down, d[2], -1.0), 0.0)
        per_px = (t if self.camera.kind == "pinhole" else 1.0) / abs(signed_scale(self.camera))
        # Along the view, where the ground is seen at a slant. Fields vanish where no ground is seen (inf).
        slope = np.abs(d[2]) / np.linalg.norm(d, axis=0)
        spread = np.where(down, 0.5 * NODE_STEP * per_px / np.maximum(slope, 1e-9), np.inf)
        return (o + t * d)[:2].T, spread

    def _grid(self, field: Array) -> NDArray[np.float32]:
        return field.reshape(-(-self.height // NODE_STEP) + 1, -1).astype(np.float32)

    @cached_property
    def _clouds(self) -> Callable[[float], Array]:
        return self.light.clouds.sampled(*self._nodes)

    def brightness(self, t: float, key: int) -> NDArray[np.float32]:
        """Returns the factor of brightness at time t (s) at every 16th pixel, (J, I); (1, 1) if equal everywhere.

        key: frame number from 1 plus BACKGROUNDS; it names the random stream of the flicker.
        """
        gain = self.light.gain(t, key)
        if self.light.clouds.amplitude == 0:
            return np.full((1, 1), gain, np.float32)
        return self._grid(gain * np.exp(self._clouds(t)))

    @cached_property
    def _sway(self) -> list[Callable[[float], Array]]:
        assert self.plants is not None
        places, _ = self._nodes
        return [waves.sampled(places, np.zeros(len(places))) for waves in self.plants.sway]

    def wind(self, t: float) -> NDArray[np.float32]:
        """Returns how far plants are displaced at time t (s) at the nodes, (2, J, I): px to the right, px down."""
        assert self.plants is not None
        strength = self.plants.strength(t)
        return np.stack([self._grid(strength * field(t)) for field in self._sway])

    @cached_property
    def plant_runs(self) -> Ints:
        """Runs of pixels that show plants, (S, 3): row, first column, last column + 1, sorted."""
        shown = np.pad(self.empty_scene.plants > 0, ((0, 0), (1, 1))).astype(np.int8)
        row, edge = np.nonzero(np.diff(shown, axis=1))
        return np.column_stack([row[::2], edge[::2], edge[1::2]])
