"""Constants of one camera: geometry and colours of the empty scene, canvases to draw on, light and wind by pixel."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.render.background import EmptyScene, PixelGeometry, paint_empty_scene, trace_geometry
from sim.render.blur_noise import blur_weights
from sim.render.canvas import MOST, TILE_H, TILE_W, UNIT, FrameCanvas
from sim.render.foliage import Foliage
from sim.render.illumination import Illumination
from sim.render.random_fields import SampledField
from sim.scene.raycast import GROUND, NOTHING, PILLAR, WALL, PixelRays, Solids, pixel_rays, signed_scale, solids_of
from sim.types import Array, Camera, Ints, Motion

if TYPE_CHECKING:
    from scenarios.schema.picture import Picture

NODE_STEP = 16  # px between the nodes at which clouds and wind are computed; they are linear between
OCCLUDER = -2  # id of walls and pillars in id maps


class CameraView:
    """The empty scene as one camera sees it. Each part is computed when first needed, and kept.

    State: besides these constants, the canvases that were returned and are ready for the next frame.
    """

    def __init__(
        self, camera: Camera, motion: Motion, light: Illumination, picture: Picture, plants: Foliage | None
    ) -> None:
        self.camera, self.motion, self.light, self.picture, self.plants = camera, motion, light, picture, plants
        self.width, self.height = camera.image
        self.rays: PixelRays = pixel_rays(camera)
        self.solids: Solids = solids_of(motion.scene)
        self._spare: list[FrameCanvas] = []

    def take_canvas(self) -> FrameCanvas:
        """Return a canvas that shows the empty scene: one that was returned, or a new one."""
        if self._spare:
            return self._spare.pop()
        size = self.height, self.width
        dirty = np.zeros((-(-self.height // TILE_H), -(-self.width // TILE_W)), np.uint8)
        return FrameCanvas(self.empty_canvas.copy(), self.geometry.depth.copy(), np.zeros(size, np.uint8), dirty)

    def return_canvas(self, canvas: FrameCanvas) -> None:
        """Restore a canvas to the empty scene, and keep it for the next frame."""
        from sim.render.canvas_kernels import restore

        flat = self.height, 3 * self.width
        empty, colour = self.empty_canvas.reshape(flat), canvas.colour.reshape(flat)
        restore(canvas.dirty, empty, self.geometry.depth, colour, canvas.depth, canvas.shaded)
        self._spare.append(canvas)

    @cached_property
    def geometry(self) -> PixelGeometry:
        """What the centre of each pixel shows."""
        return trace_geometry(self.camera, self.motion.scene)

    @cached_property
    def empty_scene(self) -> EmptyScene:
        """The painted empty scene."""
        m = self.motion
        return paint_empty_scene(self.camera, m.scene, self.light, self.picture.texture, self.plants, m.seed, m.repeat)

    @cached_property
    def empty_canvas(self) -> NDArray[np.int16]:
        """(H, W, 3): grey levels of the empty scene times UNIT, not blurred."""
        return np.asarray(np.clip(np.rint(self.empty_scene.colour * np.float32(UNIT)), 0, MOST), np.int16)

    @cached_property
    def blurred_canvas(self) -> NDArray[np.int16]:
        """(H, W, 3): `empty_canvas` blurred by the lens."""
        from sim.render.blur_noise_kernels import blur_all

        out, flat = np.empty_like(self.empty_canvas), (self.height, 3 * self.width)
        blur_all(self.empty_canvas.reshape(flat), blur_weights(self.picture.blur_px), out.reshape(flat))
        return out

    @cached_property
    def _occluders(self) -> NDArray[np.int64] | None:
        solid = (self.geometry.kind == WALL) | (self.geometry.kind == PILLAR)
        return np.where(solid, OCCLUDER, 0).astype(np.int64) if solid.any() else None

    def empty_ids(self) -> NDArray[np.int64]:
        """Return a new id map (H, W) of the empty scene: OCCLUDER where a wall or pillar shows, else 0."""
        return np.zeros((self.height, self.width), np.int64) if self._occluders is None else self._occluders.copy()

    @cached_property
    def level(self) -> bool:
        """True if shadows can fall on nothing but the ground at z = 0."""
        return bool(((self.geometry.kind == GROUND) | (self.geometry.kind == NOTHING)).all())

    @cached_property
    def _nodes(self) -> tuple[Array, Array]:
        """Ground points (J * I, 2) m at every NODE_STEP-th pixel, and the half size (J * I,) m of the ground around.

        The size is inf where a node sees no ground; fields smoothed by it vanish there.
        """
        u, v = np.meshgrid(*(np.arange(-(-n // NODE_STEP) + 1) * float(NODE_STEP) for n in (self.width, self.height)))
        uv1 = np.stack([u.ravel(), v.ravel(), np.ones(u.size)])
        o, d = self.rays.origin @ uv1, self.rays.direction @ uv1
        down = d[2] < 0
        t = np.where(down, -o[2] / np.where(down, d[2], -1.0), 0.0)
        per_px = (t if self.camera.kind == "pinhole" else 1.0) / abs(signed_scale(self.camera))
        slope = np.abs(d[2]) / np.linalg.norm(d, axis=0)
        spread = np.where(down, 0.5 * NODE_STEP * per_px / np.maximum(slope, 1e-9), np.inf)
        return (o + t * d)[:2].T, spread

    def _grid(self, field: Array) -> NDArray[np.float32]:
        """Values at the nodes (J * I,) as a grid (J, I)."""
        return field.reshape(-(-self.height // NODE_STEP) + 1, -1).astype(np.float32)

    @cached_property
    def _clouds(self) -> SampledField:
        return self.light.clouds.sampled(*self._nodes)

    def brightness(self, t: float, key: int) -> NDArray[np.float32]:
        """Return the brightness at time t (s) at the nodes (J, I); (1, 1) if it is the same everywhere.

        key: number of the frame, see `Illumination.gain`.
        """
        gain = self.light.gain(t, key)
        if self.light.clouds.amplitude == 0:
            return np.full((1, 1), gain, np.float32)
        return self._grid(gain * np.exp(self._clouds.at(t)))

    @cached_property
    def _sway(self) -> tuple[SampledField, SampledField]:
        assert self.plants is not None
        places, _ = self._nodes
        across, down = (waves.sampled(places, np.zeros(len(places))) for waves in self.plants.sway)
        return across, down

    def wind(self, t: float) -> NDArray[np.float32]:
        """Return the sway of plants at time t (s) at the nodes, (2, J, I): px across, px down."""
        assert self.plants is not None
        strength = self.plants.strength(t)
        return np.stack([self._grid(strength * field.at(t)) for field in self._sway])

    @cached_property
    def plant_runs(self) -> Ints:
        """(S, 3): row, first column, last column + 1 of each run of pixels that show plants."""
        shown = np.pad(self.empty_scene.plants > 0, ((0, 0), (1, 1))).astype(np.int8)
        row, edge = np.nonzero(np.diff(shown, axis=1))
        return np.column_stack([row[::2], edge[::2], edge[1::2]])
