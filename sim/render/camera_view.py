"""What is the same in all frames that one camera sees, computed when first needed.

It holds the geometry (depth, kind of surface, place) and the colours of the empty scene, canvases to draw on, and the
random fields from which brightness and wind in the image follow at any time.
"""

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
    """The empty scene as one camera sees it; each part is computed when first needed, and kept.

    Parts: depth, kind and place of each pixel, colours, ids, and canvases (working images) to draw on; also brightness
    and wind in the image at any time. width, height: of the image, px. rays: the camera's lines of sight. solids:
    walls, pillars and stairs. motion gives scene and seed, picture blur and patterns. plants is None without plants.
    Canvases that were given back are kept for the next frame.
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
        """Return a FrameCanvas that shows the empty scene, not shaded, all tiles clean: one given back before, or a new
        one.

        The caller may draw on it, and gives it back with `return_canvas`.
        """
        if self._spare:
            return self._spare.pop()
        size = self.height, self.width
        dirty = np.zeros((-(-self.height // TILE_H), -(-self.width // TILE_W)), np.uint8)
        return FrameCanvas(self.empty_canvas.copy(), self.geometry.depth.copy(), np.zeros(size, np.uint8), dirty)

    def return_canvas(self, canvas: FrameCanvas) -> None:
        """Restore the dirty tiles of a canvas to the empty scene, and keep it for a later `take_canvas`.

        The canvas must come from this view, and the caller must not use it any more. Returns nothing.
        """
        from sim.render.canvas_kernels import restore

        flat = self.height, 3 * self.width
        empty, colour = self.empty_canvas.reshape(flat), canvas.colour.reshape(flat)
        restore(canvas.dirty, empty, self.geometry.depth, colour, canvas.depth, canvas.shaded)
        self._spare.append(canvas)

    @cached_property
    def geometry(self) -> PixelGeometry:
        """The PixelGeometry of the empty scene: depth, kind of surface and place seen at the centre of each pixel."""
        return trace_geometry(self.camera, self.motion.scene)

    @cached_property
    def empty_scene(self) -> EmptyScene:
        """The painted EmptyScene under steady light, with unmoved plants: colour, shares of sun and of plants.

        The first access raises ValueError if the Motion's seed is negative.
        """
        m, p = self.motion, self.picture
        return paint_empty_scene(self.camera, m.scene, self.light, p.texture, self.plants, m.seed, m.repeat, p.samples)

    @cached_property
    def empty_canvas(self) -> NDArray[np.int16]:
        """Colours (H, W, 3) BGR of the empty scene as int16: grey levels times UNIT (64), not blurred, rounded, clipped
        at 32767."""
        return np.asarray(np.clip(np.rint(self.empty_scene.colour * np.float32(UNIT)), 0, MOST), np.int16)

    @cached_property
    def blurred_canvas(self) -> NDArray[np.int16]:
        """Colours (H, W, 3) BGR of the empty scene as int16: grey levels times UNIT (64), blurred by `picture.blur_px`,
        rounded."""
        from sim.render.blur_noise_kernels import blur_all

        out, flat = np.empty_like(self.empty_canvas), (self.height, 3 * self.width)
        blur_all(self.empty_canvas.reshape(flat), blur_weights(self.picture.blur_px), out.reshape(flat))
        return out

    @cached_property
    def _occluders(self) -> NDArray[np.int64] | None:
        solid = (self.geometry.kind == WALL) | (self.geometry.kind == PILLAR)
        return np.where(solid, OCCLUDER, 0).astype(np.int64) if solid.any() else None

    def empty_ids(self) -> NDArray[np.int64]:
        """Return a new id map (H, W) int64 of the empty scene: OCCLUDER (-2) where a wall or pillar shows, else 0."""
        return np.zeros((self.height, self.width), np.int64) if self._occluders is None else self._occluders.copy()

    @cached_property
    def level(self) -> bool:
        """True if the image shows nothing but level ground and sky, so that shadows fall only on z = 0."""
        return bool(((self.geometry.kind == GROUND) | (self.geometry.kind == NOTHING)).all())

    @cached_property
    def _nodes(self) -> tuple[Array, Array]:
        """Ground points (J * I, 2), x and y in m, at every 16th pixel, and the half size (J * I,) in m of the ground
        that the 16 px around each cover.

        The J rows of I nodes run from (0, 0) px to the image's edges or beyond. The half size is measured along the
        view, where the ground is seen at a slant. A node that sees no ground has the place of the camera and the half
        size inf; fields smoothed by it vanish there.
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
        """Return the values `field` (J * I,) at the nodes, every 16th pixel, as a float32 grid (J, I), row by row."""
        return field.reshape(-(-self.height // NODE_STEP) + 1, -1).astype(np.float32)

    @cached_property
    def _clouds(self) -> SampledField:
        return self.light.clouds.sampled(*self._nodes)

    def brightness(self, t: float, key: int) -> NDArray[np.float32]:
        """Return the brightness at time t (s) at the nodes (J, I), which are 16 px apart: factors above 0, about 1.

        It is (1, 1) if the brightness is the same everywhere, without clouds. Nodes that see no ground have no clouds.
        t is 0 at frame 1. key: frame number from 1 plus BACKGROUNDS (50); it names the random stream of the flicker.
        Raises ValueError for a negative key if there is flicker.
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
        """Return the sway of plants at time t (s) at the nodes, (2, J, I): px across, px down. Nodes are 16 px apart.

        t is 0 at frame 1. A node that sees no ground has the wind of the ground under the camera. Raises AssertionError
        if the view has no plants.
        """
        assert self.plants is not None
        strength = self.plants.strength(t)
        return np.stack([self._grid(strength * field.at(t)) for field in self._sway])

    @cached_property
    def plant_runs(self) -> Ints:
        """Runs of pixels that show plants, (S, 3) int64: row, first column, last column + 1.

        Sorted by row, then column; (0, 3) without plants."""
        shown = np.pad(self.empty_scene.plants > 0, ((0, 0), (1, 1))).astype(np.int8)
        row, edge = np.nonzero(np.diff(shown, axis=1))
        return np.column_stack([row[::2], edge[::2], edge[1::2]])
