"""Images and pixel truth of a Motion; each a pure function of the frame's index, drawn when asked for.

A frame starts from the empty scene (`sim.render.background`). Wind moves its plants, shadows darken it, and people are
drawn over it by depth. The result is blurred, multiplied by the brightness of the moment, given noise and, if the
scenario wants it, compressed as JPEG."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from sim.render.blur_noise import blur_weights, noise_offsets, noise_pool
from sim.render.camera_view import NODE_STEP, CameraView
from sim.render.canvas import UNIT, FrameCanvas
from sim.render.clothing import clothing_atlas
from sim.render.compression import compressed
from sim.render.disparity import empty_scene_disparities, frame_disparities
from sim.render.foliage import Foliage, grow_plants
from sim.render.frame_batch import FrameBatch, PeopleInView
from sim.render.illumination import Illumination, draw_illumination
from sim.render.people import DrawnPeople
from sim.render.pixel_truth import pixel_truth
from sim.scene import camera as cameras
from sim.types import BACKGROUNDS, Camera, Frame, Image, Motion, PixelTruth

if TYPE_CHECKING:
    from scenarios.schema.picture import Light, Picture

LEFT, RIGHT, MISALIGNED = 0, 1, 2  # views; the last: the right camera as it is, if it is not as calibrated


@dataclass(frozen=True, eq=False)
class RenderedFrame:
    """The requested parts of one frame, None if not requested: image (the camera's own) and right (the right camera's),
    both (H, W, 3) uint8 BGR; pixels, which person each pixel of `image` shows."""

    image: Image | None = None
    right: Image | None = None
    pixels: PixelTruth | None = None


class Renderer:
    """Draws the frames of one Motion as one camera, or a stereo pair, sees them. Frames count from 1.

    The constructor raises InputError if the camera's lens distorts (radial not 0). light, picture: settings as in a
    scenario; their random values are drawn with the Motion's seed; a negative seed raises ValueError when the first
    frame is drawn. State: everything that is the same in all frames, computed when first needed; and the people of the
    batch of up to 16 frames drawn last."""

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
        """The Illumination of this seed; InputError if a draw is impossible."""
        return draw_illumination(self.light, self.motion.seed, self.motion.repeat)

    @cached_property
    def left_view(self) -> CameraView:
        """The CameraView of the empty scene as the camera itself sees it; computed once.

        Raises InputError if the drawn light or share of plants is impossible."""
        return CameraView(self.camera, self.motion, self.illumination, self.picture, self._plants)

    @cached_property
    def right_view(self) -> CameraView:
        """The CameraView of the empty scene from the right camera as calibrated, `baseline` m to the right.

        Raises InputError if there is no right camera (kind "top", or a baseline of 0) or the drawn light or share of
        plants is impossible."""
        self.check_pair()
        right = cameras.right_camera(self.camera)
        return CameraView(right, self.motion, self.illumination, self.picture, self._plants)

    @cached_property
    def _shown_right_view(self) -> CameraView:
        """The CameraView from the right camera as it is, turned and moved; raises InputError as `right_view`."""
        roll, down = np.radians(self.picture.right_roll_deg), self.picture.right_down_px
        if roll == 0 and down == 0:
            return self.right_view
        right = cameras.misaligned(self.right_view.camera, roll, down)
        return CameraView(right, self.motion, self.illumination, self.picture, self._plants)

    def check_pair(self) -> None:
        """Raise InputError if there is no right camera: kind "top", or a baseline of 0. Returns nothing."""
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
        """The distance in px over which the blur spreads a pixel; 0 without blur."""
        return len(self._weights) // 2

    @cached_property
    def _empty_disparities(self) -> NDArray[np.float64]:
        return empty_scene_disparities(self.left_view, self.right_view)

    def frame(self, index: int) -> Image:
        """Return the image (H, W, 3) uint8 BGR of frame `index`, from 1 on; the same index gives the same image.

        Raises IndexError for frame 0 or one behind the last, InputError if the drawn light or share of plants is
        impossible."""
        return self._draw(index, LEFT, shade=True, label=False)[0]

    def right(self, index: int) -> Image:
        """Return the right camera's image (H, W, 3) uint8, BGR, of frame `index`, from 1 on.

        Raises InputError if there is no right camera (kind "top", or baseline 0) or drawn light or plants are
        impossible, IndexError for frame 0 or one behind the last."""
        return self._draw(index, RIGHT, shade=True, label=False)[0]

    def pixels(self, index: int, *, disparity: bool = False) -> PixelTruth:
        """Return the PixelTruth of frame `index`, from 1 on; its disparities are None unless `disparity` is True.

        Raises InputError if disparities are asked for without a right camera, or the drawn light or plants are
        impossible; IndexError for frame 0 or one behind the last."""
        truth = self._draw(index, LEFT, shade=False, label=True, disparity=disparity)[1]
        assert truth is not None
        return truth

    def draw(self, index: int, *, right: bool = False, pixels: bool = False, disparity: bool = False) -> RenderedFrame:
        """Return the left image of frame `index` (from 1 on) and the parts asked for; parts not asked for are None.

        right: the right camera's image. pixels: the pixel truth. disparity: disparities in the pixel truth; no effect
        without `pixels`. Raises InputError if `right` or disparities are asked for and there is no right camera (kind
        "top", or a baseline of 0), or the drawn light or plants are impossible; IndexError for frame 0 or one behind
        the last."""
        image, truth = self._draw(index, LEFT, shade=True, label=pixels, disparity=disparity and pixels)
        return RenderedFrame(image, self.right(index) if right else None, truth)

    def background(self, k: int) -> Image:
        """Return image k = 0 … 49 (BACKGROUNDS is 50), (H, W, 3) uint8, BGR, of the scene without people.

        Its time is (k - BACKGROUNDS) / fps s, before frame 1. Other k are not refused, except that k < -1 raises
        ValueError. Raises InputError if the drawn light or plants are impossible."""
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
        """Return a canvas of the empty scene in `view` with its plants, if any, where the wind of frame `index` (from
        1) moves them."""
        canvas = view.take_canvas()
        if view.plants is not None:
            from sim.render.foliage_kernels import sway

            sway(
                view.empty_canvas, view.empty_scene.plants, view.plant_runs, view.wind(self._time(index)), NODE_STEP,
                canvas.colour, canvas.dirty, self._margin,
            )  # fmt: skip
        return canvas

    def _draw(
        self, index: int, side: int, *, shade: bool, label: bool, disparity: bool = False
    ) -> tuple[Image, PixelTruth | None]:
        """Return the image (H, W, 3) uint8 of one view of frame `index` (from 1) and its pixel truth; side: LEFT or
        RIGHT.

        shade: draw the image; else it has shape (0, 0, 3). label: make the pixel truth; else it is None. disparity:
        with disparities; no effect without `label`. Raises InputError if the right view is needed and there is none, or
        drawn light or plants are impossible; IndexError if there is no such frame."""
        view, batch = self._shown_right_view if side else self.left_view, self._batch(index)
        number = MISALIGNED if side and view is not self.right_view else side
        people, seen = batch.people(index), batch.in_view(view, number, index)
        canvas = self._moved_canvas(view, index) if shade else view.take_canvas()
        if shade:
            self._draw_shadows(view, canvas, people, seen)
        ids = view.empty_ids() if label else np.zeros((0, 0), np.int64)
        amodal = np.zeros(len(people.id), np.int64)
        self._draw_people(canvas, people, seen, ids, amodal, shade=shade, label=label)
        image = self._finish(view, canvas, index, side) if shade else np.zeros((0, 0, 3), np.uint8)
        truth = None
        if label:
            found = None
            if disparity:
                other = batch.in_view(self.right_view, RIGHT, index).projected
                found = frame_disparities(
                    self._empty_disparities, self.right_view, canvas, ids, people, seen.projected, other
                )
            truth = pixel_truth(ids, seen.projected.outlines.bounds, people.id, amodal, found)
        view.return_canvas(canvas)
        return image, truth

    def _draw_shadows(self, view: CameraView, canvas: FrameCanvas, people: DrawnPeople, seen: PeopleInView) -> None:
        from sim.render.shadows_kernels import draw_shadows

        fall = seen.shadows
        if fall is None:
            return
        draw_shadows(
            view.geometry.place, view.empty_scene.direct, fall.outlines.bounds, view.level, fall.outlines.middle,
            fall.outlines.inverse, people.shapes.centre, fall.shape, self.illumination.sun, fall.softness,
            canvas.shaded, canvas.colour, canvas.dirty, self._margin,
        )  # fmt: skip

    def _draw_people(
        self,
        canvas: FrameCanvas,
        people: DrawnPeople,
        seen: PeopleInView,
        ids: NDArray[np.int64],
        amodal: NDArray[np.int64],
        *,
        shade: bool,
        label: bool,
    ) -> None:
        """Draw N people, `seen` by this view, on a canvas by depth; the canvas is changed.

        With `shade`, colours are drawn. With `label`, ids (H, W) gets the person's id where one is visible, and amodal
        (N,) is raised by the pixels of each whole silhouette in the image. Else the two are left as they are.
        """
        from sim.render.people_kernels import draw_people

        here, light = seen.projected, self.illumination
        draw_people(
            np.argsort(here.nearest_depth[:, 0], kind="stable"), here.start, here.step, people.half,
            here.outlines.middle, here.outlines.inverse, here.outlines.bounds, people.id, people.turn @ light.sun,
            light.shadow, seen.sunlit, people.id - 1, self._atlas, shade, label, canvas.depth, ids, canvas.colour,
            canvas.dirty, self._margin, amodal,
        )  # fmt: skip

    def _finish(self, view: CameraView, canvas: FrameCanvas, index: int, side: int) -> Image:
        """Return the image (H, W, 3) uint8 of a view's canvas: blurred, times brightness, with noise, as JPEG if
        wanted."""
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
        return compressed(image, self.picture.jpeg) if self.picture.jpeg else image


def make_renderer(
    motion: Motion, camera: Camera, light: Light | None = None, picture: Picture | None = None
) -> Renderer:
    """Return a Renderer of a Motion as this camera sees it; light and picture as in a scenario, defaults if None.

    Raises InputError if the camera's lens distorts (radial not 0). Impossible drawn values of light and plants raise
    InputError or ValueError only when the first frame is drawn."""
    from scenarios.schema.picture import Light, Picture

    return Renderer(motion, camera, light or Light(), picture or Picture())


def render(
    motion: Motion, camera: Camera, index: int, light: Light | None = None, picture: Picture | None = None
) -> Frame:
    """Return frame `index` (from 1 on) as a Frame with the left image, without right image and detections.

    light, picture: as in a scenario, defaults if None. For many frames, keep one `make_renderer`. Raises InputError if
    the lens distorts (radial not 0) or drawn light or plants are impossible, IndexError for frame 0 or one behind the
    last, ValueError for a negative seed."""
    image = make_renderer(motion, camera, light, picture).frame(index)
    return Frame(index, (index - 1) / motion.fps, image)
