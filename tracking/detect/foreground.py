"""The pipeline from a picture to foreground blobs that all trackers from pixels share.

For each picture, in this order:
    segment    average noisy pictures over small windows (smoothing, ours);
               classify each pixel (Gonzalez et al. 2006, sec. 3.2), fuse the foreground classes, clean them (sec. 3.3);
               where the background adapts, the result is implausible if more of the image is foreground than people
               can cover (ours)
    ...        the tracker measures its people and says which pixels they cover (protected)
    adapt      the background model learns from all other pixels (ours)
From the background sample the pipeline also learns the size of people, and the scale of the image if none is given
(ours).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import cv2
import numpy as np

from sim.arrays import read_only
from sim.types import Array, Bools, Context, Detections, Image, Tracks
from tracking.detect import blobs
from tracking.detect.background import Background, fused_foreground
from tracking.detect.background_kernels import Floats
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.background_training import check_frame
from tracking.detect.camera_motion import (
    Laid,
    Stabiliser,
    boxes_after,
    in_picture,
    inverse,
    poses_of_sample,
)
from tracking.detect.ghosts import Ghosts, uncovered_in_sample
from tracking.detect.mosaic import on_one_picture
from tracking.detect.person_size import PersonSize
from tracking.detect.picture_check import PictureCheck
from tracking.detect.smoothing import independent_noise, smoothed, window

# m^2 at the image's scale, and px: a blob that is smaller than either is noise.
LEAST_AREA, LEAST_PIXELS = 0.0125, 12.0
ASSUMED_HEIGHT = 18.0  # m that the image is assumed to be high while its scale is unknown.
MOST_FOREGROUND = 0.6  # Share of the image: a frame with more foreground is not measured (ours).
LOST_TIME = 0.5  # s for which pictures cannot be laid until the background is begun anew
CHECK_TIME = 2.0  # s from one look at whether the camera moves to the next
WATCH_TIME = 10.0  # s after which looks are at the model anew
SUSPECT = 0.25  # share of foreground at which it is looked at in each picture
LEAST_SIGNS = 2  # looks in a row that find a movement
MOVES = (
    "the camera moves: the background follows it, and a place in the picture is no place on the ground. People may be "
    "missed where new parts of the scene come into view"
)
SAMPLED = 25  # About so many frames of the background sample are searched for people who stand alone.


@dataclass(frozen=True, eq=False)
class Segmented:
    """One picture of H x W px after `Foreground.segment`.

    image (H, W, 3): the picture, BGR uint8, smoothed if the background sample is noisy. classes (H, W) uint8: class of
    each pixel: 0 BACKGROUND, 1 FOREGROUND, 2 DARK (dark foreground), 3 SHADOW, 4 HIGHLIGHT. mask (H, W) bool: the
    foreground (1 and 2) after cleaning. plausible: False if the background adapts and a share of the mask above
    MOST_FOREGROUND = 0.6 is foreground: then a light was switched or the camera moved.
    """

    image: Image
    classes: Image
    mask: Bools
    plausible: bool
    shown: Bools | None = None  # (H, W): what the picture shows of the model; None: all, as the camera stands still


class Foreground:
    """The pipeline from a picture to foreground blobs: classify the pixels, clean the mask, find blobs, adapt.

    State: model, the background model; window, side of the window (px) over which pictures are averaged, 1: none;
    check, which warns of pictures that cannot be measured; px_per_m, the scale of the image: the context's, or, if that
    is nan, learned from lone people, nan until then; stabiliser, which lays pictures on the model since the camera was
    found to move; None while it stands still. Masks and blobs are those on the model; `in_picture` moves tracks to the
    picture. Raises InputError for an unusable background sample, AssertionError for none.
    """

    def __init__(self, context: Context, settings: BackgroundSettings) -> None:
        """Trains the background model on the context's background sample, which must not be None (AssertionError).

        Raises InputError if the sample has a wrong shape or dtype, fewer than 10 frames or shows too little background.
        """
        assert context.background is not None
        self.px_per_m, self._learns = context.px_per_m, bool(np.isnan(context.px_per_m))
        self.window = window(independent_noise(context.background)) if settings.adaptive else 1
        self.check, self._complete = PictureCheck(), True
        self._fps, sample = context.fps, context.background
        if self.window > 1:
            sample = np.stack([smoothed(image, self.window) for image in sample])
        self.stabiliser: Stabiliser | None = None
        self._watch: Stabiliser | None = None
        self._unchecked = self._signs = self._watched = 0
        self._step = np.eye(3)
        poses = poses_of_sample(sample) if np.ndim(sample) == 4 and len(sample) > 2 else None
        size, at = (sample.shape[2], sample.shape[1]), (0, 0)
        if poses is not None:
            sample, known, at = on_one_picture(sample, poses)
            warnings.warn(MOVES, stacklevel=2)
        self.model = Background(sample, context.fps, settings)
        if settings.adaptive:
            self.model.mend(uncovered_in_sample(self.model.mean, self.model.second, self.scale), self.model.second)
        if poses is not None:
            self.model.valid &= known
            self.model.look_at(at, size)
            self.stabiliser = Stabiliser(self.model.picture(), self.model.valid, self._fps, poses)
        self.ghosts = Ghosts(self.shape, self.model.noise(), context.fps) if settings.adaptive else None

    def follow(self, settings: BackgroundSettings) -> None:
        """Replaces the settings of the background model; what the model learned stays."""
        self.model.follow(settings)

    @property
    def shape(self) -> tuple[int, ...]:
        """(H, W): height and width of the pictures, px."""
        return self.model.valid.shape

    @property
    def scale(self) -> float:
        """Scale of the image, px per m. While it is unknown: that of an image that is ASSUMED_HEIGHT = 18 m high."""
        return self.px_per_m if self.px_per_m > 0 else self.shape[0] / ASSUMED_HEIGHT

    @property
    def least_area(self) -> float:
        """Least area, in pixels, of a blob that may be a person or a part of one."""
        return max(LEAST_AREA * self.scale**2, LEAST_PIXELS)

    def segment(self, image: Image) -> Segmented:
        """Returns the pixel classes and the cleaned foreground mask of a picture (H, W, 3) BGR uint8 (secs. 3.2, 3.3).

        The background model does not learn from the picture; only its estimate of the picture's brightness changes.
        Raises InputError if the picture's size or dtype is not that of the background sample.
        """
        given, image, shown = image, smoothed(image, self.window), None
        if self.stabiliser is not None:
            check_frame(image, self.shape)
            laid = self._laid(image, self.stabiliser)
            if laid is None:
                nothing = np.zeros(self.shape, np.uint8)
                return Segmented(image, nothing, nothing.astype(bool), False, nothing.astype(bool))
            image, shown = laid.image, laid.shown
        classes = self.model.classify(image, shown)
        mask = blobs.clean(fused_foreground(classes), self.scale)
        share = np.count_nonzero(mask) / mask.size
        if self.stabiliser is None and self._moves(image, share):
            warnings.warn(MOVES, stacklevel=2)
            self.stabiliser = self._watch
            return self.segment(given)
        flooded = self.model.settings.adaptive and share > MOST_FOREGROUND
        # of one type, smoothed or not, so that numba compiles once
        return Segmented(read_only(image.view()), classes, mask, not flooded, shown)

    def _moves(self, image: Image, foreground: float) -> bool:
        """Returns whether the camera was found to move in this picture. foreground: share of the picture."""
        self._unchecked += 1
        self._watched += 1
        if self._unchecked < self._fps * CHECK_TIME and not self._signs and foreground < SUSPECT:
            return False
        if self._watch is None or (self._watched >= self._fps * WATCH_TIME and not self._signs):
            self._watch, self._watched = Stabiliser(self.model.picture(), self.model.valid, self._fps), 0
        self._unchecked = 0
        self._signs = self._signs + 1 if self._watch.has_moved(image) else 0
        return self._signs >= LEAST_SIGNS

    def _laid(self, image: Image, stabiliser: Stabiliser) -> Laid | None:
        """Returns a picture laid on the model, which follows the camera; None if it cannot be laid."""
        laid = stabiliser.lay(image)
        if laid is None:
            return self._begun_anew(image, stabiliser) if stabiliser.lost >= self._fps * LOST_TIME else None
        step = stabiliser.step()
        if step is not None:
            whole = bool((step[:2, :2] == np.eye(2)).all() and (step[2] == (0, 0, 1)).all())
            self.model.carry(step, whole)
            if self.ghosts is not None:
                self.ghosts.carry(step)
            self._step = step @ self._step
            stabiliser.moved_by(step)
            stabiliser.look_at(self.model.picture(), self.model.valid)
            laid = stabiliser.laid_again(image)
        fresh = laid.shown & ~self.model.valid
        if fresh.any():
            self.model.mend(fresh, self._at_gain_1(laid.image))
        return laid

    def _begun_anew(self, image: Image, lost: Stabiliser) -> Laid:
        """Makes a picture that could not be laid for some time the background: who is in it comes out by moving."""
        self._step = inverse(lost.pose) @ self._step
        self.model.begin_anew(self._at_gain_1(image))
        if self.ghosts is not None:
            self.ghosts = Ghosts(self.shape, self.model.noise(), self._fps)
        self.stabiliser = Stabiliser(self.model.picture(), self.model.valid, self._fps)
        return Laid(image, np.ones(self.shape, bool))

    def _at_gain_1(self, image: Image) -> Floats:
        return np.asarray(np.moveaxis(image, -1, 0).astype(np.float32) / self.model.gain[:, None, None])

    def take_step(self) -> Array | None:
        """Returns the homography (3, 3) by which the image of the model has moved since the last call; None if it has
        not."""
        step, self._step = self._step, np.eye(3)
        return None if (step == np.eye(3)).all() else step

    def on_model(self, found: Detections) -> Detections:
        """Returns detections in the last picture as detections in the image of the model."""
        if self.stabiliser is None or found.box is None:
            return found
        box = boxes_after(self.stabiliser.pose, found.box)
        return found.replace(box=box, **({"pos": box[:, :2] + box[:, 2:] / 2} if found.plane == "image" else {}))

    def in_picture(self, tracks: Tracks) -> Tracks:
        """Returns tracks in the image of the model as tracks in the last picture."""
        return tracks if self.stabiliser is None else in_picture(tracks, self.stabiliser.pose)

    def adapt(self, seen: Segmented, protected: Bools) -> None:
        """Lets the background model learn from a segmented picture, except at pixels where `protected` (H, W) is True.

        seen: the result of the last `segment`, as that call also set the brightness of the model. Each call changes
        every fourth row. Ghosts are replaced also where `protected` is True, but not in an implausible picture.
        """
        if seen.shown is not None:
            if not seen.shown.any():
                return
            protected = protected | ~seen.shown
        self.model.adapt(seen.image, seen.classes, protected)
        self.check.add(seen.plausible, self._complete, self.model.noise)
        if seen.plausible and self.ghosts is not None:
            model = self.model
            found = self.ghosts.find(seen.image, model.gain, seen.mask, model.mean, self.scale, self.least_area)
            if found is not None:
                model.mend(found, self.ghosts.colour)

    def person_blobs(self, mask: Bools) -> blobs.Blobs:
        """Returns the blobs of a cleaned mask (H, W) bool that are large enough to be people or parts of them, the
        largest first.

        They have at least 0.0125 m^2 at the image's scale, and at least 12 pixels (sec. 3.3). No such blob gives 0
        rows; of more than 500 the largest are returned.
        """
        found = blobs.find(mask, self.least_area)
        self._complete = len(found) < blobs.MOST
        return found

    def learn_person_size(self, size: PersonSize, sample: Image) -> None:
        """Lets `size` learn, in place, from the blobs of a background sample (K, H, W, 3) BGR uint8.

        All frames of fewer than 50 are used, else 25 to 37 evenly spaced ones. Blobs that the image's edge cuts are
        left out; `size` itself chooses those that may be one person. The model's estimate of brightness changes. Raises
        InputError if the size or dtype of the frames is not that of the model's own sample.
        """
        for image in sample[:: max(len(sample) // SAMPLED, 1)]:
            found = self.person_blobs(self.segment(image).mask)
            size.learn(found.box, found.ellipse, ~found.cut())
        self.take_scale(size)

    def take_scale(self, size: PersonSize) -> None:
        """Takes the scale that `size` has learned, if the context has none."""
        if self._learns:
            self.px_per_m = size.px_per_m


def convex_areas(shape: tuple[int, ...], outlines: list[Array]) -> Bools:
    """Returns an (H, W) bool mask, True inside and on the convex hull of each outline."""
    inside = np.zeros(shape, np.uint8)
    for outline in outlines:
        cv2.fillConvexPoly(inside, cv2.convexHull(np.rint(outline).astype(np.int32)), 1)
    return inside.astype(bool)
