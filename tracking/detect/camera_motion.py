"""Finds out whether the camera moves, and keeps the background model in place while it does (ours).

A picture is laid on the background model by the homography that carries its corners to where the model has them:
corners of the model are followed into the picture (sparse flow of Lucas and Kanade), and the homography is fitted by
RANSAC, so that corners on people do not count. Corners are taken from each cell of a grid, or people, who have the
strongest ones, would give them all. A camera moves if such a homography moves the picture by MOVED px or more, is
agreed on by corners in enough cells, and makes the picture clearly more like the model: people who all walk one way in
front of a wall without corners do not.

OpenCV's flow and RANSAC may differ in the last bits between processors, as decoded pictures do; equal runs on one
machine are equal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Bools, GroupEvent, Image, Tracks

GRID = (8, 6)  # cells across and down, of which each gives corners
PER_CELL, QUALITY, APART = 5, 0.05, 5  # corners of a cell, least quality beside its best one, px between them
LEAST_CONTRAST = 4.0  # standard deviation of the grey levels of a cell below which it has no corners
WINDOW, LEVELS = (21, 21), 4  # of the flow: px, and levels of the pyramid
RANSAC_PX = 2.0
LEAST_INLIERS, LEAST_SHARE = 12, 0.4  # corners that agree, in number and as a share of those followed
LEAST_CELLS = 0.3  # share of the cells with corners in which some agree
MOVED = 1.5  # px: mean movement of the picture from which on the camera moves
BETTER = 0.8  # the difference from the model must fall to this share
LEAST_BETTER = 0.5  # in at least this share of the cells, as people who all walk one way cover fewer
LARGEST_DIFFERENCE = 40.0  # grey levels: more counts as that much, as where people are
STRETCH = 0.5, 2.0  # of the picture by a homography: others are mistakes
KEY = 40.0  # px from one picture of a sample, on which others are laid, to the next
LEAST_MOVED = 2  # fewest pictures of a sample that moved, beside a tenth of them
SMOOTH_TIME = 1.0  # s over which movements are averaged, so that the reference follows a turn but no tremble
FOLLOW = 8.0  # px of that average from which on the reference follows
DISTORTED = 16.0  # px: mean movement, beside a shift, from which on the reference is laid anew
BLUR = 1.5  # px: of both pictures before they are compared


def grey(image: Image) -> Image:
    """Returns a BGR picture (H, W, 3) in grey, (H, W) uint8."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)


def mapped(transform: Array, points: Array) -> Array:
    """Returns points (..., 2) after a homography (3, 3)."""
    moved = points @ transform[:, :2].T + transform[:, 2]
    return np.asarray(moved[..., :2] / moved[..., 2:])


def inverse(transform: Array) -> Array:
    """Returns the homography (3, 3) back."""
    return np.asarray(np.linalg.inv(transform), np.float64)


def shifted(right: float, down: float) -> Array:
    """Returns the homography (3, 3) that moves points to the right and down, px."""
    return np.array([[1.0, 0.0, right], [0.0, 1.0, down], [0.0, 0.0, 1.0]])


def movement(transform: Array, size: tuple[int, int]) -> float:
    """Returns how far a homography moves nine points of a picture of (width, height) in the mean, px."""
    x, y = np.meshgrid(*(np.linspace(0, side, 3) for side in size))
    points = np.column_stack([x.ravel(), y.ravel()])
    return float(np.linalg.norm(mapped(transform, points) - points, axis=1).mean())


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners of a picture: the picture in grey (H, W); at (N, 2) px; cell (N,) of the grid in which each lies."""

    grey: Image
    at: NDArray[np.float32]
    cell: NDArray[np.int64]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, px."""
        return self.grey.shape[1], self.grey.shape[0]


def corners_of(picture: Image, known: Bools | None = None) -> Corners:
    """Returns the corners of a grey picture (H, W); known (H, W): where it shows something, None: everywhere."""
    height, width = picture.shape
    across, down = (
        np.linspace(0, side, count + 1).astype(int) for side, count in zip((width, height), GRID, strict=True)
    )
    found, cells = [np.zeros((0, 2), np.float32)], [np.zeros(0, np.int64)]
    mask = None if known is None else cv2.erode(known.astype(np.uint8), np.ones((9, 9), np.uint8))
    for row in range(GRID[1]):
        for column in range(GRID[0]):
            part = slice(down[row], down[row + 1]), slice(across[column], across[column + 1])
            if picture[part].std() < LEAST_CONTRAST:
                continue
            inside = None if mask is None else mask[part]
            one = cv2.goodFeaturesToTrack(np.ascontiguousarray(picture[part]), PER_CELL, QUALITY, APART, mask=inside)
            if one is not None:
                found.append(np.asarray(one[:, 0] + (across[column], down[row]), np.float32))
                cells.append(np.full(len(one), row * GRID[0] + column))
    return Corners(picture, np.concatenate(found), np.concatenate(cells))


def laid_on(corners: Corners, picture: Image, guess: Array) -> Array | None:
    """Returns the homography (3, 3) from a grey picture (H, W) to that of the corners; None if none is sure.

    guess (3, 3): one that is near.
    """
    # Laid by the guess first: windows of the flow only shift, and a turned picture is stretched.
    near = cv2.warpPerspective(picture, guess, corners.size, flags=cv2.INTER_LINEAR)
    origin = mapped(inverse(guess), corners.at.astype(np.float64))
    begun = ((origin >= 0) & (origin < picture.shape[::-1])).all(axis=1)
    if np.count_nonzero(begun) < LEAST_INLIERS:
        return None
    at, cell = corners.at[begun], corners.cell[begun]
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        corners.grey, near, at[:, None], at[:, None].copy(), winSize=WINDOW, maxLevel=LEVELS
    )
    seen_at = mapped(inverse(guess), found[:, 0].astype(np.float64))
    inside = ((seen_at >= 0) & (seen_at < picture.shape[::-1])).all(axis=1)
    kept = (status[:, 0] == 1) & inside & np.isfinite(found[:, 0]).all(axis=1)
    if np.count_nonzero(kept) < LEAST_INLIERS:
        return None
    cv2.setRNGSeed(0)
    step, agree = cv2.findHomography(found[kept, 0], at[kept], cv2.RANSAC, RANSAC_PX)
    if step is None:
        return None
    found = step @ guess
    found /= found[2, 2]
    agree = agree[:, 0].astype(bool)
    cells = len(np.unique(cell[kept][agree])) >= LEAST_CELLS * len(np.unique(cell))
    enough = agree.sum() >= max(LEAST_INLIERS, LEAST_SHARE * np.count_nonzero(kept))
    stretch = np.sqrt(abs(np.linalg.det(found[:2, :2])))
    whole = STRETCH[0] < stretch < STRETCH[1] and np.abs(found[2, :2]).max() * max(corners.size) < 0.5
    return np.asarray(found, float) if cells and enough and whole else None


def explains(corners: Corners, picture: Image, transform: Array, before: Array) -> bool:
    """Returns True if a homography makes a grey picture (H, W) clearly more like that of the corners than the
    homography `before` does."""
    own = cv2.GaussianBlur(corners.grey, (0, 0), BLUR).astype(np.float32)
    other = cv2.GaussianBlur(picture, (0, 0), BLUR).astype(np.float32)
    off = []
    for one in (before, transform):
        there = cv2.warpPerspective(other, one, corners.size, flags=cv2.INTER_LINEAR, borderValue=-1e4)
        off.append(np.abs(there - own))
    both = (off[0] < 1e3) & (off[1] < 1e3)
    first, second = (cells_of(np.where(both, np.minimum(each, LARGEST_DIFFERENCE), 0.0)) for each in off)
    return bool(second.sum() < BETTER * first.sum() and (second < BETTER * first).mean() >= LEAST_BETTER)


def cells_of(values: NDArray[np.float32]) -> Array:
    """Returns the mean of values (H, W) in each cell of the grid, (GRID[1], GRID[0])."""
    return np.asarray(cv2.resize(values.astype(np.float32), GRID, interpolation=cv2.INTER_AREA), float)


def poses_of_sample(sample: Image) -> list[Array | None] | None:
    """Returns the homography of each picture of a background sample (K, H, W, 3) to the middle one; None if the camera
    stands still. A picture that cannot be laid on the others has None.

    Pictures are laid on the middle one, and from KEY px away on the last one that was laid so far away.
    """
    middle, size, moved = len(sample) // 2, (sample.shape[2], sample.shape[1]), 0
    poses: list[Array | None] = [None] * len(sample)
    poses[middle] = np.eye(3)
    first = corners_of(grey(sample[middle]))
    for order in (range(middle + 1, len(sample)), range(middle - 1, -1, -1)):
        key, base, last = first, np.eye(3), np.eye(3)
        for k in order:
            picture = grey(sample[k])
            step = laid_on(key, picture, last)
            if step is None:
                continue
            away, last = movement(step, size), step
            if away >= MOVED:
                if not explains(key, picture, step, np.eye(3)):
                    continue
                moved += 1
            poses[k] = base @ step
            if away >= KEY:
                key, base, last = corners_of(picture), base @ step, np.eye(3)
    return poses if moved >= max(LEAST_MOVED, len(sample) // 10) else None


def seen(transform: Array, size: tuple[int, int], within: tuple[int, int] | None = None) -> Bools:
    """Returns the pixels (H, W) of the reference that a picture of (width, height), laid on it, shows. within: width
    and height of the reference; None: those of the picture."""
    whole = np.full(size[::-1], 255, np.uint8)
    return np.asarray(cv2.warpPerspective(whole, transform, within or size, flags=cv2.INTER_LINEAR) == 255)


@dataclass(frozen=True, eq=False)
class Laid:
    """A picture that lies on the background model: image (H, W, 3), and the pixels (H, W) that it shows."""

    image: Image
    shown: Bools


class Stabiliser:
    """Lays each picture on a reference picture, which follows the camera in whole steps.

    State: size, width and height, px; pose (3, 3), the homography of the last picture to the reference; corners of the
    reference; poses of the background sample, at which a lost picture is looked for; means (2, 2), px, the mean of the
    last movements of the middle, and the mean of that mean; lost, the pictures in a row that could not be
    laid.
    """

    def __init__(
        self, reference: Image, known: Bools | None, fps: float, poses: list[Array | None] | None = None
    ) -> None:
        self.size = reference.shape[1], reference.shape[0]
        self.pose, self.lost, self.means = np.eye(3), 0, np.zeros((2, 2))
        self._keep = float(np.exp(-1.0 / (SMOOTH_TIME * fps)))
        self.poses = [] if poses is None else [one for one in poses if one is not None][:: max(len(poses) // 6, 1)]
        self.look_at(reference, known)

    def look_at(self, reference: Image, known: Bools | None) -> None:
        """Takes a new picture (H, W, 3) of the reference; known (H, W): where it shows something, None: everywhere."""
        self.corners = corners_of(grey(reference), known)

    def has_moved(self, image: Image) -> bool:
        """Returns True if the camera has moved from the reference, by one picture (H, W, 3)."""
        picture = grey(image)
        found = laid_on(self.corners, picture, np.eye(3))
        if found is None or movement(found, self.size) < MOVED:
            return False
        return explains(self.corners, picture, found, np.eye(3))

    def lay(self, image: Image) -> Laid | None:
        """Returns a picture (H, W, 3) laid on the reference; None if it cannot be."""
        picture, found = grey(image), None
        for guess in (self.pose, *(self.poses if self.lost or not self.means.any() else ())):
            found = laid_on(self.corners, picture, guess)
            if found is not None:
                break
        if found is None:
            self.lost += 1
            return None
        self.pose, self.lost = found, 0
        middle = np.array(self.size) / 2
        for mean, value in ((0, mapped(found, middle) - middle), (1, self.means[0])):
            self.means[mean] = self._keep * self.means[mean] + (1 - self._keep) * value
        return self.laid_again(image)

    def step(self) -> Array | None:
        """Returns the homography (3, 3) by which the reference should move now, so that it follows the camera; None if
        it stays. Whole px where the picture is hardly distorted; `moved_by` tells that it was done."""
        # Without the lag of a mean, if the movement is steady.
        way = 2 * self.means[0] - self.means[1]
        if np.abs(way).max() <= FOLLOW:
            return None
        whole, middle = shifted(*(-np.rint(way))), np.array(self.size) / 2
        away = mapped(self.pose, middle) - middle
        distorted = movement(shifted(*(-away)) @ self.pose, self.size) >= DISTORTED
        return shifted(*(away - way)) @ inverse(self.pose) if distorted else whole

    def laid_again(self, image: Image) -> Laid:
        """Returns the picture of the last `lay` as it lies on the reference now."""
        there = cv2.warpPerspective(image, self.pose, self.size, flags=cv2.INTER_LINEAR)
        return Laid(np.asarray(there, np.uint8), seen(self.pose, self.size))

    def moved_by(self, step: Array) -> None:
        """Takes the reference's movement: poses are those of the new one."""
        middle = np.array(self.size) / 2
        self.means = mapped(step, middle + self.means) - middle
        self.pose = step @ self.pose
        self.poses = [step @ one for one in self.poses]


def in_picture(tracks: Tracks, pose: Array) -> Tracks:
    """Returns tracks in the plane of the reference as tracks in the picture that `pose` lays on it.

    Positions, boxes and hulls are those in the picture. Velocities and covariances stay those beside the reference, so
    that they are of the people and not of the camera. On the ground only boxes are in the picture.
    """
    back = inverse(pose)
    box = None if tracks.box is None else boxes_after(back, tracks.box)
    if tracks.plane != "image":
        return tracks.replace(box=box)
    groups = tracks.groups
    if groups is not None and len(groups.id):
        hulls = tuple(mapped(back, hull) if len(hull) else hull for hull in groups.hull)
        groups = groups.replace(pos=mapped(back, groups.pos), hull=hulls)
    events = tuple(_event_after(back, event) for event in tracks.events)
    return tracks.replace(pos=mapped(back, tracks.pos), box=box, groups=groups, events=events)


def boxes_after(transform: Array, box: Array) -> Array:
    """Returns boxes (N, 4), left, top, width, height, px, after a homography.

    They stay upright: the middles of the upper and the lower edge are mapped, the ratio of width and height stays.
    """
    middle = box[:, 0] + box[:, 2] / 2
    head, foot = (mapped(transform, np.column_stack([middle, v])) for v in (box[:, 1], box[:, 1] + box[:, 3]))
    tall = foot[:, 1] - head[:, 1]
    wide = box[:, 2] * tall / np.where(box[:, 3] > 0, box[:, 3], 1.0)
    return np.column_stack([(head[:, 0] + foot[:, 0]) / 2 - wide / 2, head[:, 1], wide, tall])


def _event_after(transform: Array, event: GroupEvent) -> GroupEvent:
    x, y = mapped(transform, np.array(event.pos)).tolist()
    return replace(event, pos=(x, y))
