"""Images and pixel truth of a Motion; each a pure function of the frame's index, drawn when asked for.

A frame starts from the empty scene (`sim.render.camera_view`). Wind moves its plants, shadows darken it, and people are
drawn over it by depth. The result is blurred, multiplied by the brightness of the moment, given noise and, if the
scenario wants it, compressed as JPEG. The people of up to 16 consecutive frames are computed at once, which is faster.

The disparity of a point is u_left - u_right = f B / depth: focal length f in px, baseline B and depth in m; nan where
the right camera does not see the point. An id map (H, W) holds the id of the person that each pixel shows. From it
follow each person's number of visible pixels, the box round them in px, and the number of the connected region of
people (`types.PixelTruth`).
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from sim.render.camera_view import NODE_STEP, CameraView, blur_weights, noise_offsets, noise_pool
from sim.render.canvas import MID_GREY, UNIT, FrameCanvas
from sim.render.materials import SKY, Style, draw_materials

# isort: off
# fmt: off
from sim.render.people import (
    PeopleInView, PeopleShadows, clothing_atlas, people_in_view, people_shadows, things_in_view,
)
# fmt: on
# isort: on
from sim.render.weather import Foliage, Illumination, draw_illumination, grow_plants, rain_drops
from sim.rng import look_seed
from sim.scene import camera as cameras
from sim.scene.body import RecordedBodies, recorded_bodies, recorded_things
from sim.scene.camera_motion import View
from sim.scene.figure import TOPS
from sim.types import BACKGROUNDS, Array, Camera, Image, Ints, Motion, PixelTruth

if TYPE_CHECKING:
    from scenarios.schema.pictures import Light, Picture


FRAMES = 16  # frames of a batch
# Parts of a Renderer that belong to one place of the camera, and those that do not, by name.
OF_ONE_CAMERA = ("left_view", "right_view", "_shown_right_view", "_empty_disparities")
OF_ALL_CAMERAS = ("illumination", "_plants", "_materials", "_atlas", "_noise", "_weights", "_cast", "_while_open")
SHOTS = 5  # moments of a frame whose mean is the picture, if the shutter stays open


def pixel_truth(ids: Ints, rows: Ints, seen: PeopleInView, amodal: Ints, disparity: Array | None) -> PixelTruth:
    """Returns the PixelTruth of one frame, measured in its id map `ids` (H, W).

    seen: the N people of the batch. rows: indices of the people of this frame in it. amodal (N,): for each person of
    the batch, the number of pixels in the image of the whole silhouette. disparity (H, W) px or None: taken as it is.
    """
    from sim.render.pixel_truth_kernels import count_pixels

    id = seen.id[rows]
    count, blob, edges = np.zeros(len(id), np.int64), np.empty(len(id), np.int64), np.empty((len(id), 4), np.int64)
    row_of = np.zeros(int(id.max(initial=0)) + 1, np.int64)
    row_of[id] = np.arange(len(id))
    count_pixels(ids, seen.outlines.bounds[rows], id, row_of, count, edges, blob)
    low, high = edges[:, 0::2].astype(float), edges[:, 1::2].astype(float)
    box = np.where(count[:, None] > 0, np.concatenate([low, high - low], axis=1), np.nan)
    return PixelTruth(ids, disparity, count.astype(float), amodal[rows].astype(float), box, blob)


Shown = tuple[PeopleInView, RecordedBodies]  # people, or things, as a view sees them, and in the world


def _rows(bodies: RecordedBodies, index: int) -> Ints:
    """Returns the rows of frame `index`."""
    return np.arange(*np.searchsorted(bodies.frame, (index, index + 1)))


@dataclass(frozen=True, eq=False)
class RenderedFrame:
    """The parts of one frame that were asked for: left image, right image, pixel truth; the other parts are None."""

    image: Image | None = None
    right: Image | None = None
    pixels: PixelTruth | None = None


class Renderer:
    """Draws the frames of one Motion, from 1, as one camera, or a stereo pair, sees them.

    State: everything that is the same in all frames, computed when first needed, and the people of the batch of frames
    drawn last (batches begin at frame 1, 17, 33, …), as each view sees them. Random values of light and picture are
    drawn with the Motion's seed and name (`sim.rng.look_seed`).
    """

    def __init__(self, motion: Motion, view: View, light: Light | None = None, picture: Picture | None = None) -> None:
        """Takes light and picture as in a scenario, None: the default; raises InputError if the lens distorts."""
        from scenarios.schema.pictures import Light, Picture

        self._view, self._frames, self._instant = view, FRAMES, dict[float, Renderer]()
        camera = view if isinstance(view, Camera) else view.rest
        if camera.radial != 0:
            raise InputError(
                place="camera.radial", got=f"{camera.radial:g}", expected="0: a lens that does not distort",
                remedy="render with the same camera and radial 0",
            )  # fmt: skip
        self.motion, self.camera = motion, camera
        self.light, self.picture = light or Light(), picture or Picture()
        self._look = look_seed(motion.seed, motion.name), motion.repeat
        self._first, self._bodies, self._things = 0, recorded_bodies(motion, 1, 1), recorded_things(motion, 1, 1)
        self._seen, self._shadows = dict[CameraView, list[Shown]](), dict[CameraView, list[PeopleShadows]]()

    @cached_property
    def illumination(self) -> Illumination:
        """The light that the seed of the motion gives."""
        return draw_illumination(self.light, *self._look)

    @cached_property
    def left_view(self) -> CameraView:
        """The empty scene as the left (or only) camera sees it."""
        return self._view_of(self.camera, 0)

    @cached_property
    def right_view(self) -> CameraView:
        """The empty scene as the right camera sees it, without the errors right_… of `Picture`."""
        self.check_pair()
        return self._view_of(cameras.right_camera(self.camera), 1)

    @cached_property
    def _shown_right_view(self) -> CameraView:
        roll, down = np.radians(self.picture.right_roll_deg), self.picture.right_down_px
        if roll == 0 and down == 0:
            return self.right_view
        return self._view_of(cameras.misaligned(self.right_view.camera, roll, down), 1)

    def _view_of(self, camera: Camera, side: int) -> CameraView:
        light, picture = self.illumination, self.picture
        return CameraView(camera, side, self.motion, light, picture, self._plants, self._materials)

    @cached_property
    def _materials(self) -> tuple[Array, Style]:
        return draw_materials(self.picture, self.light, self._plants, self.motion, self.camera, self._look)

    def check_pair(self) -> None:
        """Raises InputError if there is no right camera: kind "top", or a baseline of 0."""
        if not self.camera.baseline > 0 or self.camera.kind != "pinhole":
            raise InputError(
                place="camera.baseline", got=f"{self.camera.kind}, baseline {self.camera.baseline:g}",
                expected="a pinhole pair with a baseline above 0", remedy="set camera.baseline, or leave it out",
            )  # fmt: skip

    @cached_property
    def _plants(self) -> Foliage | None:
        return grow_plants(self.picture, self.camera, self.motion.scene, *self._look)

    @cached_property
    def _atlas(self) -> NDArray[np.uint8]:
        m = self.motion
        return clothing_atlas(m.present.shape[1], *self._look, m.clothes, m.looks)

    @cached_property
    def _noise(self) -> NDArray[np.int16]:
        return noise_pool(self.picture.noise, UNIT)

    @cached_property
    def _weights(self) -> NDArray[np.float32]:
        return blur_weights(self.picture.blur_px, self.picture.sharpen)

    @cached_property
    def _cast(self) -> NDArray[np.float32]:
        return np.array([1 - self.light.warmth, 1, 1 + self.light.warmth], np.float32)

    @cached_property
    def _while_open(self) -> list[tuple[Renderer, float]]:
        """Renderers of the same people a little earlier and later, while the shutter is open, and how much later, s."""
        step = self.picture.shutter / SHOTS
        others = [copy(self) for _ in range(SHOTS - 1 if step > 0 else 0)]
        for k, other in zip((-2, -1, 1, 2), others, strict=False):
            other.motion = self.motion.replace(pos=self.motion.pos + k * step * self.motion.vel)
            if (looks := self.motion.looks) is not None:
                moved = looks.place + k * step * self.motion.fps * np.gradient(looks.place, axis=0)
                other.motion = other.motion.replace(looks=replace(looks, place=moved))
            other._first, other._seen, other._shadows, other._instant = 0, {}, {}, {}
        return [(other, k * step) for k, other in zip((-2, -1, 1, 2), others, strict=False)]

    @property
    def _margin(self) -> int:
        return len(self._weights) // 2

    @cached_property
    def _empty_disparities(self) -> Array:
        from sim.render.pixel_truth_kernels import empty_scene_disparities

        left, right = self.left_view, self.right_view
        scale = left.camera.focal_px[0] * float(np.linalg.norm(right.camera.position - left.camera.position))
        out = np.empty((left.height, left.width))
        empty_scene_disparities(left.geometry.depth, scale, right.rays, left.solids, out)
        return out

    def _disparities(self, canvas: FrameCanvas, ids: Ints, shown: list[Shown], index: int) -> Array:
        from sim.render.pixel_truth_kernels import hide_behind_people, set_people

        right, out = self.right_view, self._empty_disparities.copy()
        scale = right.camera.focal_px[0] * right.camera.baseline
        for seen, bodies in shown:
            rows, depth = _rows(bodies, index), right.geometry.depth
            set_people(rows, canvas.depth, ids, seen, scale, depth, right.rays, right.solids, out)
        for other, bodies in self._shown(right, index):
            hide_behind_people(_rows(bodies, index), canvas.depth, scale, other, out)
        return out

    def at(self, t: float) -> Renderer:
        """Returns a renderer whose camera stands still where this one's is t s after frame 1; that of the last t is
        kept."""
        if isinstance(self._view, Camera):
            return self
        if t not in self._instant:
            for name in OF_ALL_CAMERAS:
                getattr(self, name)
            still = copy(self)
            for name in OF_ONE_CAMERA:
                still.__dict__.pop(name, None)
            still.camera = still._view = self._view.at(t)
            still._frames, still._first, still._seen, still._shadows = 1, 0, {}, {}
            self._instant.clear()
            self._instant[t] = still
        return self._instant[t]

    def _in_frame(self, index: int) -> Renderer:
        return self.at(self._time(index))

    def frame(self, index: int) -> Image:
        """Returns the left image (H, W, 3) of frame `index`, from 1."""
        one = self._in_frame(index)
        return one._draw(one.left_view, index, shade=True, label=False)[0]

    def right(self, index: int) -> Image:
        """Returns the right camera's image (H, W, 3) of frame `index`, from 1."""
        one = self._in_frame(index)
        return one._draw(one._shown_right_view, index, shade=True, label=False)[0]

    def pixels(self, index: int, *, disparity: bool = False) -> PixelTruth:
        """Returns the PixelTruth of frame `index`, from 1. disparity: True adds the disparities, else they are None."""
        one = self._in_frame(index)
        truth = one._draw(one.left_view, index, shade=False, label=True, disparity=disparity)[1]
        assert truth is not None
        return truth

    def draw(self, index: int, *, right: bool = False, pixels: bool = False, disparity: bool = False) -> RenderedFrame:
        """Returns the left image of frame `index` (from 1), and the parts asked for.

        right: also the right image. pixels: also the pixel truth. disparity: the pixel truth gets disparities.
        """
        one = self._in_frame(index)
        image, truth = one._draw(one.left_view, index, shade=True, label=pixels, disparity=disparity and pixels)
        return RenderedFrame(image, self.right(index) if right else None, truth)

    def background(self, k: int) -> Image:
        """Returns the image (H, W, 3) of the scene without people in frame k - 49; k from 0 to 49."""
        index = k - BACKGROUNDS + 1
        one = self._in_frame(index)
        view = one.left_view
        canvas = one._moved_canvas(view, index)
        image = one._finish(view, canvas, index)
        view.return_canvas(canvas)
        return image

    def _time(self, index: int) -> float:
        return (index - 1) / self.motion.fps

    def _shown(self, view: CameraView, index: int) -> list[Shown]:
        """Returns the people of the batch of frame `index` as a view sees them, then the things, if there are any."""
        first = index - (index - 1) % self._frames
        if first != self._first:
            self._first, self._bodies = first, recorded_bodies(self.motion, first, first + self._frames)
            self._things = recorded_things(self.motion, first, first + self._frames)
            self._seen, self._shadows = {}, {}
        if view not in self._seen:
            sight = view.camera, view.rays, view.solids, self.illumination.sun
            self._seen[view] = [(people_in_view(self.motion, self._bodies, *sight), self._bodies)]
            if self._things is not None:
                self._seen[view] += [(things_in_view(self.motion, self._things, *sight), self._things)]
        return self._seen[view]

    def _draw_shadows(self, view: CameraView, shown: list[Shown], index: int, canvas: FrameCanvas) -> None:
        from sim.render.people_kernels import draw_shadows

        light, motion = self.illumination, self.motion
        if view not in self._shadows:
            heights = [motion.height[self._bodies.id - 1]]
            if self._things is not None and motion.looks is not None:
                heights += [(motion.looks.size * TOPS[motion.looks.kind])[self._things.id - 1]]
            self._shadows[view] = [
                people_shadows(height, bodies, view.camera, light, view.level)
                for height, (_, bodies) in zip(heights, shown, strict=True)
            ]
        place, direct = view.geometry.place, view.empty_scene.direct
        for (seen, bodies), shadows in zip(shown, self._shadows[view], strict=True):
            rows = _rows(bodies, index)
            draw_shadows(rows, place, direct, view.level, seen.centre, shadows, light.sun, canvas, self._margin)

    def _moved_canvas(self, view: CameraView, index: int) -> FrameCanvas:
        canvas = view.take_canvas()
        if view.plants is not None:
            from sim.render.plants_kernels import sway

            wind = view.wind(self._time(index))
            sway(view.empty_canvas, view.empty_scene.plants, view.plant_runs, wind, NODE_STEP, canvas, self._margin)
        return canvas

    def _draw(
        self, view: CameraView, index: int, *, shade: bool, label: bool, disparity: bool = False
    ) -> tuple[Image, PixelTruth | None]:
        canvas, ids, shown = self._draw_crowd(view, index, shade=shade, label=label)
        image, truth = np.zeros((0, 0, 3), np.uint8), None
        if shade:
            self._add_other_moments(view, index, canvas)
            image = self._finish(view, canvas, index)
        if label:
            from sim.render.people_kernels import count_silhouettes

            found = self._disparities(canvas, ids, shown, index) if disparity else None
            (seen, bodies), *_ = shown
            rows, amodal = _rows(bodies, index), np.zeros(len(seen.id), np.int64)
            count_silhouettes(rows, seen.outlines, view.width, amodal)
            truth = pixel_truth(ids, rows, seen, amodal, found)
        view.return_canvas(canvas)
        return image, truth

    def _add_other_moments(self, view: CameraView, index: int, canvas: FrameCanvas) -> None:
        """Turns the colours of a canvas into the mean over the time for which the shutter is open."""
        if not self._while_open:
            return
        total = canvas.colour.astype(np.int32)
        for other, later in self._while_open:
            then = other.at(self._time(index) + later)
            own = view if then is other else then._shown_right_view if view.side else then.left_view
            moved = then._draw_crowd(own, index, shade=True, label=False)[0]
            total += moved.colour
            # The background is blurred, too, if the camera moves.
            canvas.dirty[:] |= moved.dirty if own is view else 1
            own.return_canvas(moved)
        canvas.colour[:] = total // SHOTS

    def _draw_crowd(
        self, view: CameraView, index: int, *, shade: bool, label: bool
    ) -> tuple[FrameCanvas, Ints, list[Shown]]:
        """Returns a canvas with the people and things of a frame, the id map, and both as the view sees them."""
        from sim.render.people_kernels import draw_people

        shown = self._shown(view, index)
        canvas = self._moved_canvas(view, index) if shade else view.take_canvas()
        shadow = self.illumination.shadow
        if shade and shadow > 0:
            self._draw_shadows(view, shown, index, canvas)
        ids = view.empty_ids() if label else np.zeros((0, 0), np.int64)
        for seen, bodies in shown:
            rows = _rows(bodies, index)
            near_first = rows[np.argsort(seen.nearest[rows, 0], kind="stable")]
            draw_people(near_first, seen, shadow, self._atlas, shade, label, canvas, ids, self._margin)
        palette, style = self._materials
        if shade and (style.fog > 0 or len(style.lamps)):
            from sim.render.air_kernels import add_air

            add_air(canvas, view.geometry.depth, view.rays, style, palette[SKY])
        return canvas, ids, shown

    def _finish(self, view: CameraView, canvas: FrameCanvas, index: int) -> Image:
        from sim.render.blur_noise_kernels import finish_image

        image = np.empty((view.height, view.width, 3), np.uint8)
        number, contrast = index + BACKGROUNDS, self.picture.contrast
        if self.light.rain > 0:
            from sim.render.air_kernels import draw_rain, night

            palette, style = self._materials
            level = abs(view.camera.rotation[1, 2])
            drops = rain_drops(self.light.rain, view.camera.image, level, self._look, view.side, number)
            draw_rain(drops, palette[SKY] * night(style), canvas, self._margin)
        gain = np.float32((self.picture.right_gain if view.side else 1.0) * self.light.level * contrast)
        lift = np.float32((1 - contrast) * MID_GREY * UNIT)
        bright = view.brightness(self._time(index), number) * gain
        offsets = noise_offsets(view.height, *self._look, view.side, number)
        flat = view.height, 3 * view.width
        finish_image(
            canvas.colour.reshape(flat), view.blurred_canvas.reshape(flat), canvas.dirty, self._weights, bright,
            NODE_STEP, self._cast, lift, self._noise, np.float32(self.picture.shot), offsets, image.reshape(flat),
        )  # fmt: skip
        if self.picture.grey:
            import cv2

            image = np.repeat(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)[..., None], 3, axis=2)
        if self.picture.jpeg:
            import cv2

            code = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, self.picture.jpeg])[1]
            image = np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR), np.uint8)
        return image
