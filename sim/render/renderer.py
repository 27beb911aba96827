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

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from sim.render.camera_view import NODE_STEP, CameraView, blur_weights, noise_offsets, noise_pool
from sim.render.canvas import UNIT, FrameCanvas

# isort: off
# fmt: off
from sim.render.people import (
    DrawnPeople, PeopleShadows, ProjectedPeople, clothing_atlas, people_of_frames, people_shadows, project_people,
    sunlit_shares, take_rows,
)
# fmt: on
# isort: on
from sim.render.weather import Foliage, Illumination, draw_illumination, grow_plants
from sim.scene import camera as cameras
from sim.types import BACKGROUNDS, Array, Camera, Image, Ints, Motion, PixelTruth

if TYPE_CHECKING:
    from scenarios.schema.scenario import Light, Picture


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


def pixel_truth(ids: Ints, bounds: Ints, id: Ints, amodal: Ints, disparity: Array | None) -> PixelTruth:
    """Returns the PixelTruth of an id map (H, W): visible pixels, box and connected region of N people.

    bounds (N, 4): outside which nobody is visible. id (N,). amodal (N,): pixels of the whole silhouettes.
    """
    from sim.render.pixel_truth_kernels import count_pixels

    count, blob, edges = np.zeros(len(id), np.int64), np.empty(len(id), np.int64), np.empty((len(id), 4), np.int64)
    row_of = np.zeros(int(id.max(initial=0)) + 1, np.int64)
    row_of[id] = np.arange(len(id))
    count_pixels(ids, bounds, id, row_of, count, edges, blob)
    low, high = edges[:, 0::2].astype(float), edges[:, 1::2].astype(float)
    box = np.where(count[:, None] > 0, np.concatenate([low, high - low], axis=1), np.nan)
    return PixelTruth(ids, disparity, count.astype(float), amodal.astype(float), box, blob)


LEFT, RIGHT, MISALIGNED = 0, 1, 2  # views; the last: the right camera as it is, if it is not as calibrated


@dataclass(frozen=True, eq=False)
class RenderedFrame:
    """The parts of one frame that were asked for; the others are None."""

    image: Image | None = None
    right: Image | None = None
    pixels: PixelTruth | None = None


class Renderer:
    """Draws the frames of one Motion, from 1, as one camera, or a stereo pair, sees them.

    State: everything that is the same in all frames, computed when first needed, and the people of the batch of frames
    drawn last. Random values of light and picture are drawn with the Motion's seed.
    """

    def __init__(self, motion: Motion, camera: Camera, light: Light, picture: Picture) -> None:
        if camera.radial != 0:
            raise InputError(
                place="camera.radial", got=f"{camera.radial:g}", expected="0: a lens that does not distort",
                remedy="render with the same camera and radial 0",
            )  # fmt: skip
        self.motion, self.camera, self.light, self.picture = motion, camera, light, picture
        self._last_batch: FrameBatch | None = None

    @cached_property
    def illumination(self) -> Illumination:
        """The light of this seed."""
        return draw_illumination(self.light, self.motion.seed, self.motion.repeat)

    @cached_property
    def left_view(self) -> CameraView:
        """The empty scene as the camera sees it."""
        return CameraView(self.camera, self.motion, self.illumination, self.picture, self._plants)

    @cached_property
    def right_view(self) -> CameraView:
        """The empty scene as the right camera sees it, as calibrated."""
        self.check_pair()
        right = cameras.right_camera(self.camera)
        return CameraView(right, self.motion, self.illumination, self.picture, self._plants)

    @cached_property
    def _shown_right_view(self) -> CameraView:
        roll, down = np.radians(self.picture.right_roll_deg), self.picture.right_down_px
        if roll == 0 and down == 0:
            return self.right_view
        right = cameras.misaligned(self.right_view.camera, roll, down)
        return CameraView(right, self.motion, self.illumination, self.picture, self._plants)

    def check_pair(self) -> None:
        """Raises InputError if there is no right camera: kind "top", or a baseline of 0."""
        if not self.camera.baseline > 0 or self.camera.kind != "pinhole":
            raise InputError(
                place="camera.baseline", got=f"{self.camera.kind}, baseline {self.camera.baseline:g}",
                expected="a pinhole pair with a baseline above 0", remedy="set camera.baseline, or leave it out",
            )  # fmt: skip

    @cached_property
    def _plants(self) -> Foliage | None:
        return grow_plants(self.picture, self.camera, self.motion.scene, self.motion.seed, self.motion.repeat)

    @cached_property
    def _atlas(self) -> NDArray[np.uint8]:
        return clothing_atlas(self.motion.present.shape[1], self.motion.seed, self.motion.repeat)

    @cached_property
    def _noise(self) -> NDArray[np.int16]:
        return noise_pool(self.picture.noise, UNIT)

    @cached_property
    def _weights(self) -> NDArray[np.float32]:
        return blur_weights(self.picture.blur_px)

    @property
    def _margin(self) -> int:
        return len(self._weights) // 2

    @cached_property
    def _empty_disparities(self) -> Array:
        from sim.render.pixel_truth_kernels import empty_scene_disparities

        left, right = self.left_view, self.right_view
        scale = left.camera.focal_px[0] * float(np.linalg.norm(right.camera.position - left.camera.position))
        out = np.empty((left.height, left.width))
        empty_scene_disparities(left.geometry.depth, scale, right.rays.origin, right.rays.direction, left.solids, out)
        return out

    def _disparities(
        self, canvas: FrameCanvas, ids: Ints, people: DrawnPeople, seen: ProjectedPeople, index: int
    ) -> Array:
        from sim.render.pixel_truth_kernels import add_people

        right, out = self.right_view, self._empty_disparities.copy()
        other = self._batch(index).in_view(right, RIGHT, index).projected
        add_people(
            canvas.depth, ids, seen.outlines.bounds, people.id, right.camera.focal_px[0] * right.camera.baseline,
            other.start, other.step, other.outlines.middle, other.outlines.inverse, other.nearest_depth,
            right.geometry.depth, right.rays.origin, right.rays.direction, right.solids, out,
        )  # fmt: skip
        return out

    def frame(self, index: int) -> Image:
        """Returns the image (H, W, 3) of frame `index`, from 1."""
        return self._draw(index, LEFT, shade=True, label=False)[0]

    def right(self, index: int) -> Image:
        """Returns the right camera's image (H, W, 3) of frame `index`, from 1."""
        return self._draw(index, RIGHT, shade=True, label=False)[0]

    def pixels(self, index: int, *, disparity: bool = False) -> PixelTruth:
        """Returns the PixelTruth of frame `index`, from 1, with disparities if asked for."""
        truth = self._draw(index, LEFT, shade=False, label=True, disparity=disparity)[1]
        assert truth is not None
        return truth

    def draw(self, index: int, *, right: bool = False, pixels: bool = False, disparity: bool = False) -> RenderedFrame:
        """Returns the left image of frame `index` (from 1) and the parts asked for."""
        image, truth = self._draw(index, LEFT, shade=True, label=pixels, disparity=disparity and pixels)
        return RenderedFrame(image, self.right(index) if right else None, truth)

    def background(self, k: int) -> Image:
        """Returns image k = 0 … 49 (H, W, 3) of the scene without people, before frame 1."""
        view, index = self.left_view, k - BACKGROUNDS + 1
        canvas = self._moved_canvas(view, index)
        image = self._finish(view, canvas, index, LEFT)
        view.return_canvas(canvas)
        return image

    def _time(self, index: int) -> float:
        return (index - 1) / self.motion.fps

    def _batch(self, index: int) -> FrameBatch:
        if self._last_batch is None or index not in self._last_batch:
            self._last_batch = FrameBatch(self.motion, self.illumination, index)
        return self._last_batch

    def _moved_canvas(self, view: CameraView, index: int) -> FrameCanvas:
        canvas = view.take_canvas()
        if view.plants is not None:
            from sim.render.weather_kernels import sway

            sway(
                view.empty_canvas, view.empty_scene.plants, view.plant_runs, view.wind(self._time(index)), NODE_STEP,
                canvas.colour, canvas.dirty, self._margin,
            )  # fmt: skip
        return canvas

    def _draw(
        self, index: int, side: int, *, shade: bool, label: bool, disparity: bool = False
    ) -> tuple[Image, PixelTruth | None]:
        from sim.render.people_kernels import draw_people
        from sim.render.weather_kernels import draw_shadows

        view, batch = self._shown_right_view if side else self.left_view, self._batch(index)
        number = MISALIGNED if side and view is not self.right_view else side
        people, seen = batch.people(index), batch.in_view(view, number, index)
        canvas = self._moved_canvas(view, index) if shade else view.take_canvas()
        light, here, fall = self.illumination, seen.projected, seen.shadows
        if shade and fall is not None:
            draw_shadows(
                view.geometry.place, view.empty_scene.direct, fall.outlines.bounds, view.level, fall.outlines.middle,
                fall.outlines.inverse, people.shapes.centre, fall.shape, light.sun, fall.softness,
                canvas.shaded, canvas.colour, canvas.dirty, self._margin,
            )  # fmt: skip
        ids = view.empty_ids() if label else np.zeros((0, 0), np.int64)
        amodal = np.zeros(len(people.id), np.int64)
        draw_people(
            np.argsort(here.nearest_depth[:, 0], kind="stable"), here.start, here.step, people.half,
            here.outlines.middle, here.outlines.inverse, here.outlines.bounds, people.id, people.turn @ light.sun,
            light.shadow, seen.sunlit, people.id - 1, self._atlas, shade, label, canvas.depth, ids, canvas.colour,
            canvas.dirty, self._margin, amodal,
        )  # fmt: skip
        image = self._finish(view, canvas, index, side) if shade else np.zeros((0, 0, 3), np.uint8)
        truth = None
        if label:
            found = self._disparities(canvas, ids, people, here, index) if disparity else None
            truth = pixel_truth(ids, here.outlines.bounds, people.id, amodal, found)
        view.return_canvas(canvas)
        return image, truth

    def _finish(self, view: CameraView, canvas: FrameCanvas, index: int, side: int) -> Image:
        from sim.render.blur_noise_kernels import finish_image

        image = np.empty((view.height, view.width, 3), np.uint8)
        number = index + BACKGROUNDS
        bright = view.brightness(self._time(index), number) * np.float32(self.picture.right_gain if side else 1.0)
        offsets = noise_offsets(view.height, self.motion.seed, side, number, self.motion.repeat)
        flat = view.height, 3 * view.width
        finish_image(
            canvas.colour.reshape(flat), view.blurred_canvas.reshape(flat), canvas.dirty, self._weights, bright,
            NODE_STEP, self._noise, np.float32(self.picture.shot), offsets, image.reshape(flat),
        )  # fmt: skip
        if self.picture.jpeg:
            import cv2

            code = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, self.picture.jpeg])[1]
            image = np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR), np.uint8)
        return image


def make_renderer(
    motion: Motion, camera: Camera, light: Light | None = None, picture: Picture | None = None
) -> Renderer:
    """Returns a Renderer of a Motion as this camera sees it.

    Args:
        motion: Positions of people over time, and the scene.
        camera: A camera without lens distortion.
        light: As in a scenario; None: the default.
        picture: As in a scenario; None: the default.

    Returns:
        The renderer; it draws a frame when asked for.

    Raises:
        InputError: The lens distorts.
    """
    from scenarios.schema.scenario import Light, Picture

    return Renderer(motion, camera, light or Light(), picture or Picture())
