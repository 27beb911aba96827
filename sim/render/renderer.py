"""Pictures of a Motion: each a pure function of the frame's index, drawn when asked for.

A Stage holds what is the same in all frames: the plate of each view (sim.render.background), clothes, light, noise. A
frame is the
plate, its plants moved by wind, darkened by shadows, people over it by depth (sim.render.people_shadow_kernels),
blurred, times the
brightness of its moment, with noise, and at last lossy artefacts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from sim.render.camera_view import NODES, Easel, View, blur_weights
from sim.render.clothing import wear
from sim.render.foliage import Foliage, grow
from sim.render.frame_batch import FRAMES, Stretch
from sim.render.illumination import Illumination, illuminate
from sim.render.image_noise import offsets, pool
from sim.render.pixel_truth import pixel_truth
from sim.render.silhouettes import Cast, Crowd
from sim.scene import camera as cameras
from sim.types import BACKGROUNDS, Camera, Frame, Image, Motion, PixelTruth

if TYPE_CHECKING:
    from scenarios.schema.picture import Light, Picture

LEFT, RIGHT = 0, 1


@dataclass(frozen=True, eq=False)
class Rendered:
    """What was asked of one frame."""

    image: Image | None = None
    right: Image | None = None
    pixels: PixelTruth | None = None


class Stage:
    """All that is the same in every frame, made when first needed; and where people are in the stretch drawn last."""

    def __init__(self, motion: Motion, camera: Camera, light: Light, picture: Picture) -> None:
        if camera.radial != 0:
            raise InputError(
                place="camera.radial", got=f"{camera.radial:g}", expected="0: a lens that does not distort",
                remedy="render with the camera's ideal twin (radial 0)",
            )  # fmt: skip
        self.motion, self.camera, self.light, self.picture = motion, camera, light, picture
        self._last: Stretch | None = None

    @cached_property
    def illumination(self) -> Illumination:
        """The light of this seed."""
        return illuminate(self.light, self.motion.seed, self.motion.repeat)

    @cached_property
    def left_view(self) -> View:
        """What the camera itself sees of the empty scene."""
        return View(self.camera, self.motion, self.illumination, self.picture, self._plants)

    @cached_property
    def right_view(self) -> View:
        """What the right camera of the pair sees; InputError where there is none."""
        self.check_pair()
        return View(cameras.right_camera(self.camera), self.motion, self.illumination, self.picture, self._plants)

    def check_pair(self) -> None:
        """InputError where there is no right camera."""
        if not self.camera.baseline > 0 or self.camera.kind != "pinhole":
            raise InputError(
                place="camera.baseline", got=f"{self.camera.kind}, baseline {self.camera.baseline:g}",
                expected="a pinhole pair with a baseline above 0", remedy="set camera.baseline, or leave it out",
            )  # fmt: skip

    @cached_property
    def _plants(self) -> Foliage | None:
        return grow(self.picture, self.camera, self.motion.scene, self.motion.seed, self.motion.repeat)

    @cached_property
    def _atlas(self) -> NDArray[np.uint8]:
        return wear(self.motion.present.shape[1], self.motion.seed, self.motion.repeat)

    @cached_property
    def _noise(self) -> NDArray[np.int16]:
        from sim.render.people_shadow_kernels import UNIT

        return pool(self.picture.noise, UNIT)

    @cached_property
    def _weights(self) -> NDArray[np.float32]:
        return blur_weights(self.picture.blur_px)

    @cached_property
    def _known(self) -> NDArray[np.float64]:
        return self.left_view.disparities(self.right_view)

    def frame(self, index: int) -> Image:
        """The picture of frame `index`."""
        return self._draw(index, LEFT, shade=True, label=False)[0]

    def right(self, index: int) -> Image:
        """The right camera's."""
        return self._draw(index, RIGHT, shade=True, label=False)[0]

    def pixels(self, index: int, *, disparity: bool = False) -> PixelTruth:
        """Who shows where in frame `index`, and how far away."""
        truth = self._draw(index, LEFT, shade=False, label=True, disparity=disparity)[1]
        assert truth is not None
        return truth

    def both(self, index: int, *, right: bool = False, pixels: bool = False, disparity: bool = False) -> Rendered:
        """The picture with more of the same frame, nothing drawn twice; disparity: in `pixels`."""
        image, truth = self._draw(index, LEFT, shade=True, label=pixels, disparity=disparity and pixels)
        return Rendered(image, self.right(index) if right else None, truth)

    def background(self, k: int) -> Image:
        """Empty frame k = 0 … BACKGROUNDS - 1, at t = (k - BACKGROUNDS) / fps."""
        view, index = self.left_view, k - BACKGROUNDS + 1
        easel = self._easel(view, index)
        image = self._finish(view, easel, index, LEFT)
        view.give_back(easel)
        return image

    def _time(self, index: int) -> float:
        return (index - 1) / self.motion.fps

    def _stretch(self, index: int) -> Stretch:
        if self._last is None or index not in range(self._last.first, self._last.first + FRAMES):
            self._last = Stretch(self.motion, self.illumination, index)
        return self._last

    def _easel(self, view: View, index: int) -> Easel:
        """The scene without people to paint on, its plants moved."""
        easel = view.easel()
        if view.plants is not None:
            from sim.render.foliage_kernels import sway

            wind, margin = view.wind(self._time(index)), len(self._weights) // 2
            sway(view.canvas, view.plate.plants, view.moving, wind, NODES, easel.canvas, easel.dirty, margin)
        return easel

    def _draw(
        self, index: int, side: int, *, shade: bool, label: bool, disparity: bool = False
    ) -> tuple[Image, PixelTruth | None]:
        """Picture (nothing in it unless `shade`) and, with `label`, truth of one view of one frame."""
        from sim.render import people_shadow_kernels as kernels

        view, stretch, light = self.right_view if side else self.left_view, self._stretch(index), self.illumination
        people, sight = stretch.crowd(index), stretch.sight(view, side, index)
        here, margin, fall = sight.cast, len(self._weights) // 2, sight.shadows
        easel = self._easel(view, index) if shade else view.easel()
        if shade and fall is not None:
            kernels.shadows(
                view.geometry.place, view.plate.direct, fall.outlined.boxes, view.level, fall.outlined.middle,
                fall.outlined.inverse, people.shapes.centre, fall.shape, light.sun, fall.softness, easel.taken,
                easel.canvas, easel.dirty, margin,
            )  # fmt: skip
        ids = view.empty_ids() if label else np.zeros((0, 0), np.int64)
        amodal = np.zeros(len(people.id), np.int64)
        kernels.people(
            np.argsort(here.near[:, 0], kind="stable"), here.start, here.step, people.half, here.outlined.middle,
            here.outlined.inverse, here.outlined.boxes, people.id, people.turn @ light.sun, light.shadow,
            sight.sunlit, people.id - 1, self._atlas, shade, label, easel.depth, ids, easel.canvas, easel.dirty,
            margin, amodal,
        )  # fmt: skip
        image = self._finish(view, easel, index, side) if shade else np.zeros((0, 0, 3), np.uint8)
        truth = None
        if label:
            apart = self._disparities(easel.depth, ids, here, people, index) if disparity else None
            truth = pixel_truth(ids, here.outlined.boxes, people.id, amodal, apart)
        view.give_back(easel)
        return image, truth

    def _finish(self, view: View, easel: Easel, index: int, side: int) -> Image:
        from sim.render.blur_noise_kernels import finish

        image = np.empty((view.height, view.width, 3), np.uint8)
        number = index + BACKGROUNDS
        bright = view.brightness(self._time(index), number)
        rows = offsets(view.height, self.motion.seed, side, number, self.motion.repeat)
        flat = view.height, 3 * view.width
        finish(
            easel.canvas.reshape(flat), view.blurred.reshape(flat), easel.dirty, self._weights, bright, NODES,
            self._noise, np.float32(self.picture.shot), rows, image.reshape(flat),
        )  # fmt: skip
        return _lossy(image, self.picture.jpeg) if self.picture.jpeg else image

    def _disparities(
        self, depth: NDArray[np.float32], ids: NDArray[np.int64], here: Cast, people: Crowd, index: int
    ) -> NDArray[np.float64]:
        from sim.render.pixel_truth_kernels import disparities

        other, apart = self.right_view, self._known.copy()
        there = self._stretch(index).sight(other, RIGHT, index).cast
        disparities(
            depth, ids, here.outlined.boxes, people.id, self.camera.focal_px[0] * self.camera.baseline, there.start,
            there.step, there.outlined.middle, there.outlined.inverse, there.near, other.geometry.depth,
            other.rays.origin, other.rays.direction, other.solids, apart,
        )  # fmt: skip
        return apart


def _lossy(image: Image, quality: int) -> Image:
    import cv2

    code = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR), np.uint8)


def stage(motion: Motion, camera: Camera, light: Light | None = None, picture: Picture | None = None) -> Stage:
    """What draws this motion as this camera sees it; light and picture are a scenario's, its defaults where absent.

    InputError where the camera's lens distorts.
    """
    from scenarios.schema.picture import Light, Picture

    return Stage(motion, camera, light or Light(), picture or Picture())


def render(
    motion: Motion, camera: Camera, index: int, light: Light | None = None, picture: Picture | None = None
) -> Frame:
    """One frame with its picture; for many, make a `stage` and keep it."""
    return Frame(index, (index - 1) / motion.fps, stage(motion, camera, light, picture).frame(index))
