"""Pictures of a Motion: each a pure function of the frame's index, drawn when asked for.

A Stage holds what is the same in all frames: the plate (sim.plate) of each view, clothes, light, noise. A frame is
people over the plate by depth (sim.paint_kernels), the light of its moment, blur, noise, and lossy artefacts, in this
order. Cameras with a lens that distorts are refused: outlines of bodies would not be the truth's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from sim.light import Illumination, illuminate
from sim.people import Ellipsoids, ellipsoids
from sim.plate import Geometry, Plate, Rays, paint_plate, sight, survey
from sim.sensor_noise import Grain, grain
from sim.silhouettes import pixel_boxes, pixel_truth, shadow_boxes, shadow_shapes
from sim.static_kernels import PILLAR, WALL
from sim.terrain import height_at
from sim.types import Array, Camera, Frame, Image, Ints, Motion, PixelTruth
from sim.wear import Wear, wear

if TYPE_CHECKING:
    from scenarios.schema import Light, Picture

BACKGROUNDS = 50  # empty frames before the first
LEFT, RIGHT = 0, 1
OCCLUDER = -2


@dataclass(frozen=True)
class View:
    """One camera's constants."""

    camera: Camera
    rays: Rays
    geometry: Geometry
    plate: Plate
    ids: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Drawn:
    """One view of one frame before light and noise: colour of people, depth, ids (H, W), amodal (N,) px."""

    colour: NDArray[np.float32]
    depth: NDArray[np.float32]
    ids: NDArray[np.int32]
    amodal: Ints


@dataclass(frozen=True, eq=False)
class Crowd:
    """The people of a frame: id (N,), pos3 (N, 3), their shapes, and rows of what they wear."""

    id: Ints
    pos3: Array
    heading: Array
    height: Array
    shapes: Ellipsoids


@dataclass(frozen=True, eq=False)
class Rendered:
    """What was asked of one frame."""

    image: Image
    right: Image | None = None
    pixels: PixelTruth | None = None


class Stage:
    """All that is the same in every frame, made when first needed. Holds nothing of any frame."""

    def __init__(self, motion: Motion, camera: Camera, light: Light, picture: Picture) -> None:
        self.motion, self.camera, self.light, self.picture = motion, camera, light, picture

    @cached_property
    def illumination(self) -> Illumination:
        """The light of this seed."""
        return illuminate(self.light, self.motion.seed, self.motion.repeat)

    @cached_property
    def wear(self) -> Wear:
        """What everybody wears."""
        return wear(self.motion.present.shape[1], self.motion.seed, self.motion.repeat)

    @cached_property
    def grain(self) -> Grain:
        """The camera's noise."""
        return grain(self.picture.noise, self.camera.image, self.motion.seed, self.motion.repeat)

    @cached_property
    def left_view(self) -> View:
        """The camera itself."""
        return self._view(self.camera)

    @cached_property
    def right_view(self) -> View:
        """The right camera of the pair; InputError where there is none."""
        self.check_pair()
        position = self.camera.position + self.camera.baseline * self.camera.rotation[0]
        return self._view(self.camera.replace(position=position))

    def check_pair(self) -> None:
        """InputError where there is no right camera."""
        if not self.camera.baseline > 0 or self.camera.kind != "pinhole":
            raise InputError(
                place="camera.baseline", got=f"{self.camera.kind}, baseline {self.camera.baseline:g}",
                expected="a pinhole pair with a baseline above 0", remedy="set camera.baseline, or leave it out",
            )  # fmt: skip

    def _view(self, camera: Camera) -> View:
        geometry = survey(camera, self.motion.scene)
        plate = paint_plate(
            camera, self.motion.scene, self.illumination, self.picture, self.motion.seed, self.motion.repeat
        )
        solid = (geometry.kind == WALL) | (geometry.kind == PILLAR)
        return View(camera, sight(camera), geometry, plate, np.where(solid, OCCLUDER, 0).astype(np.int32))

    def frame(self, index: int) -> Image:
        """The picture of frame `index`."""
        return self.both(index).image

    def right(self, index: int) -> Image:
        """The right camera's."""
        crowd = self._crowd(index)
        return self._picture(self.right_view, crowd, self._draw(self.right_view, crowd), index, RIGHT)

    def pixels(self, index: int, *, right: bool = False) -> PixelTruth:
        """Who shows where in frame `index`; with disparities where `right`."""
        crowd = self._crowd(index)
        other = self._draw(self.right_view, crowd) if right else None
        return self._pixels(crowd, self._draw(self.left_view, crowd), other)

    def both(self, index: int, *, right: bool = False, pixels: bool = False) -> Rendered:
        """The picture with more of the same frame, nothing drawn twice; disparities where `right` is asked for too."""
        crowd = self._crowd(index)
        drawn = self._draw(self.left_view, crowd)
        image = self._picture(self.left_view, crowd, drawn, index, LEFT)
        other = self._draw(self.right_view, crowd) if right else None
        return Rendered(
            image,
            None if other is None else self._picture(self.right_view, crowd, other, index, RIGHT),
            self._pixels(crowd, drawn, other) if pixels else None,
        )

    def background(self, k: int) -> Image:
        """Empty frame k = 0 … BACKGROUNDS - 1, at t = (k - BACKGROUNDS) / fps."""
        index = k - BACKGROUNDS + 1
        view, nobody = self.left_view, _nobody()
        return self._picture(view, nobody, self._draw(view, nobody), index, LEFT)

    def _crowd(self, index: int) -> Crowd:
        m = self.motion
        who = np.flatnonzero(m.present[index - 1])
        xy, heading, height = m.pos[index - 1, who], m.heading[index - 1, who], m.height[who]
        pos3 = np.column_stack([xy, height_at(m.scene, xy)])
        return Crowd(who + 1, pos3, heading, height, ellipsoids(pos3, heading, height, m.width[who], m.depth[who]))

    def _draw(self, view: View, crowd: Crowd) -> Drawn:
        from sim.paint_kernels import people

        colour = np.empty((*view.ids.shape, 3), np.float32)
        depth, ids, amodal = view.geometry.depth.copy(), view.ids.copy(), np.zeros(len(crowd.id), np.int64)
        boxes, who, light = pixel_boxes(view.camera, crowd.shapes), crowd.id - 1, self.illumination
        people(
            view.rays.origin, view.rays.direction, boxes, crowd.shapes.centre, np.linalg.inv(crowd.shapes.shape),
            np.stack([np.cos(crowd.heading), np.sin(crowd.heading)], axis=1), crowd.pos3[:, 2], crowd.height,
            self.wear.keys[who], self.wear.styles[who], self.wear.colours[who], light.sun, light.shadow,
            depth, ids, crowd.id, colour, amodal,
        )  # fmt: skip
        return Drawn(colour, depth, ids, amodal)

    def _picture(self, view: View, crowd: Crowd, drawn: Drawn, index: int, side: int) -> Image:
        from sim.paint_kernels import compose, shadows

        light = self.illumination
        sunlit = np.ones(view.ids.shape, np.float32)
        if light.shadow > 0 and len(crowd.id):
            shape, radius = shadow_shapes(crowd.shapes, light.sun)
            boxes = shadow_boxes(view.camera, crowd.shapes, crowd.pos3[:, 2], crowd.height, light.sun)
            shadows(view.geometry.place, boxes, crowd.shapes.centre, shape, light.sun, light.penumbra / radius, sunlit)
        out = np.empty((*view.ids.shape, 3), np.uint8)
        gain = light.gain((index - 1) / self.motion.fps, index + BACKGROUNDS)
        compose(view.plate.colour, view.plate.direct, sunlit, drawn.ids, drawn.colour, gain, out)
        return self._sensed(out, index, side)

    def _sensed(self, image: Image, index: int, side: int) -> Image:
        import cv2

        if self.picture.blur_px > 0:
            image = np.asarray(cv2.GaussianBlur(image, (0, 0), self.picture.blur_px), np.uint8)
        image = self.grain.add(image, index + BACKGROUNDS, side)
        if self.picture.jpeg:
            _, code = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, self.picture.jpeg])
            image = np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR), np.uint8)
        return image

    def _pixels(self, crowd: Crowd, drawn: Drawn, other: Drawn | None) -> PixelTruth:
        from sim.paint_kernels import disparities

        disparity = None
        if other is not None:
            disparity = np.empty(drawn.depth.shape)
            disparities(drawn.depth, other.depth, self.camera.focal_px[0] * self.camera.baseline, 0.02, disparity)
        return pixel_truth(drawn.ids, crowd.id, drawn.amodal, disparity)


def _nobody() -> Crowd:
    none = np.zeros((0, 3))
    return Crowd(
        np.zeros(0, np.int64), none, np.zeros(0), np.zeros(0), Ellipsoids(np.zeros((0, 2, 3)), np.zeros((0, 2, 3, 3)))
    )


def stage(motion: Motion, camera: Camera, light: Light | None = None, picture: Picture | None = None) -> Stage:
    """What draws this motion as this camera sees it; light and picture are a scenario's, its defaults where absent."""
    from scenarios import schema

    return Stage(motion, camera, light or schema.Light(), picture or schema.Picture())


def render(
    motion: Motion, camera: Camera, index: int, light: Light | None = None, picture: Picture | None = None
) -> Frame:
    """One frame with its picture; for many, make a `stage` and keep it."""
    return Frame(index, (index - 1) / motion.fps, stage(motion, camera, light, picture).frame(index))
