"""From a picture to the points of `group-pda`: foreground pixels on a grid, each a share of a person (ours).

The foreground comes from tracking.detect.foreground.

Also here: colours as a further mass of `group-pda`'s associations, from pixels only (future work of sec. 6; the form is
ours).

The mass of an association is the relative weight of a set of points as the measurement of a group.

Each group has a histogram of the colours of its unshared points. A shared point of colour c adds `appearance` times
log p(c | g) - log p(c | the other groups that may have the point) to the log mass of group g's associations, where
p(c | g), the probability of colour c in group g, comes from the smoothed histograms. It counts as the share of a person
that the point stands for, because neighbouring pixels have like colours.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.scene.body import PERSON_HEIGHT
from sim.types import Array, Bools, Camera, Context, Image, Ints
from tracking.detect.foreground import Foreground, convex_areas
from tracking.detect.person_size import DEPTH, SHOULDERS, PersonSize
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.group_bank import GroupBank
from tracking.papers.group_pda.scaled_parameters import COLOUR_BINS, ScaledParameters
from tracking.running.image_scale import required

MOST_GROWTH = 0.7  # Largest change of the scale from the middle of the image to its upper or lower edge, as a share.
LEAST_GROWTH = 1e-9  # per px: stands for none.
WIDTH_PER_HEIGHT = 0.3  # Width over height of a person in the image if there is no camera.
GRID = 0.1  # m: distance of the points of the grid.
LEAST_SINE_TILT = 0.2  # Lower bound of `sine_tilt`: in a view along the ground depth cannot be measured.


class FlatView(NamedTuple):
    """A map from the image to a plane in which people have one size, m: its local scale is that of people's middles.

    middle (2,): of the image, px, the plane's origin. scale: px per m there. growth: share of it by which the scale
    grows per px downwards.
    """

    middle: Array
    scale: float
    growth: float

    @property
    def rate(self) -> float:
        """Rate per m, towards the camera, at which the logarithm of the scale grows."""
        return self.scale * self.growth

    def growths(self, uv: Array) -> Array:
        """Returns the scale (M,) at image points uv (M, 2), px, over that in the middle."""
        return np.maximum(1 + self.growth * (uv[:, 1] - self.middle[1]), 1 - MOST_GROWTH)

    def flat(self, uv: Array) -> Array:
        """Returns the places (M, 2) in the plane, m, of image points uv (M, 2), px."""
        local = self.growths(uv)
        return np.column_stack([(uv[:, 0] - self.middle[0]) / (self.scale * local), np.log(local) / self.rate])

    def image(self, places: Array) -> Array:
        """Returns the image points (M, 2), px, of places (M, 2) in the plane, m."""
        local = np.exp(self.rate * places[:, 1])
        return self.middle + np.column_stack([self.scale * local * places[:, 0], (local - 1) / self.growth])

    def jacobian(self, places: Array) -> Array:
        """Returns the derivatives (M, 2, 2) of `image` at places (M, 2), px per m."""
        local = self.scale * np.exp(self.rate * places[:, 1])
        found = local[:, None, None] * np.eye(2)
        found[:, 0, 1] = local * self.rate * places[:, 0]
        return found


class ForegroundPoints:
    """Foreground pixels on a grid as points, each a share of a person.

    State: config; foreground, the pipeline with its background model. scale: px per metre, the context's, or, if that
    is nan, learned from lone people in its background sample. step: px between the grid's points. view: the plane of
    the points. person (2,): width and height of a person there, m.

    The context must have a background sample (else AssertionError). Raises InputError if the scale is neither known nor
    learned, if it is zero or negative, or if the sample cannot be used.
    """

    def __init__(self, config: GroupPdaConfig, context: Context) -> None:
        assert context.background is not None
        self.config = config
        self.foreground = Foreground(context, config)
        if np.isnan(context.px_per_m):
            self.foreground.learn_person_size(PersonSize(context), context.background)
        self.scale = required(self.foreground.px_per_m)
        self.step = max(1, round(GRID * self.scale))
        self.view = flat_view(context.camera, self.foreground.shape, self.scale)
        self.person = _person(context.camera, self.scale) / self.view.scale

    def follow(self, config: GroupPdaConfig) -> None:
        """Replaces the config: settings of the background model change; what the model learned and the scale stay."""
        self.config = config
        self.foreground.follow(config)

    def people(self, uv: Array) -> Array:
        """Returns the people (M,), shares below 1 as a rule, that grid points uv (M, 2), px, stand for: area of a grid
        cell over that of a person's ellipse."""
        side = self.step / (self.view.scale * self.view.growths(uv))
        return np.asarray(np.square(side) / (np.pi / 4 * self.person.prod()))

    @property
    def body_cov(self) -> Array:
        """Covariance (2, 2), m^2, of one person's pixels: those of a filled ellipse, its semi-axes squared over 4."""
        return np.asarray(np.diag(np.square(self.person / 4)), np.float64)

    def points(self, image: Image, outlines: list[Array]) -> Array | None:
        """Returns the grid points (M, 2) u, v in px that are foreground; None if too much is foreground."""
        seen = self.foreground.segment(image)
        self.foreground.adapt(seen, convex_areas(self.foreground.shape, outlines))
        return grid_points(seen.mask, self.step) if seen.plausible else None


def grid_points(mask: Bools, step: int) -> Array:
    """Returns u, v (M, 2) in px of the centres of the foreground pixels on a grid of every `step`-th pixel, by rows."""
    first = step // 2
    v, u = np.nonzero(mask[first::step, first::step])
    return np.asarray(np.stack([u, v], 1) * float(step) + (first + 0.5), np.float64)


def sine_tilt(camera: Camera | None) -> float:
    """Returns the sine of the camera's downward tilt, the factor by which depth on the ground is shortened in the
    image."""
    return 1.0 if camera is None else float(max(-camera.rotation[2, 2], LEAST_SINE_TILT))


def flat_view(camera: Camera | None, shape: tuple[int, ...], scale: float) -> FlatView:
    """Returns the map for an image of H x W px; the scale, px per m, is the same everywhere without a pinhole camera,
    and if the image's middle is near the horizon."""
    middle = np.array(shape[1::-1]) / 2
    if camera is None or camera.kind == "top":
        return FlatView(middle, scale, LEAST_GROWTH)
    high, (down, steep) = camera.position[2] - PERSON_HEIGHT / 2, -camera.rotation[1:, 2]
    sine = steep + down * (middle[1] - camera.centre_px[1]) / camera.focal_px[1]  # of the line of sight's tilt
    if sine < LEAST_SINE_TILT or high <= 0:
        return FlatView(middle, scale, LEAST_GROWTH)
    growth = np.clip(down / camera.focal_px[1] / sine, LEAST_GROWTH, MOST_GROWTH / middle[1])
    return FlatView(middle, float(camera.focal_px[0] * sine / high), float(growth))


def _person(camera: Camera | None, scale: float) -> Array:
    if camera is None:
        return scale * PERSON_HEIGHT * np.array([WIDTH_PER_HEIGHT, 1.0])
    from sim.scene.body import person_boxes
    from sim.scene.camera import to_ground

    middle = to_ground(camera, np.array([camera.image], float) / 2)
    turns = np.radians([0.0, 45.0, 90.0, 135.0])
    if not np.isfinite(middle).all():
        return _person(None, scale)
    place = np.column_stack([np.repeat(middle, len(turns), 0), np.zeros(len(turns))])
    tall, wide, deep = (np.full(len(turns), size) for size in (PERSON_HEIGHT, SHOULDERS, DEPTH))
    return np.asarray(person_boxes(camera, place, turns, tall, wide, deep)[:, 2:].mean(0))


LEVELS = 4  # Levels of each of the three channels: LEVELS cubed is COLOUR_BINS.
SMOOTHING = 0.05  # People, spread evenly over all bins, that are added to a histogram.


def colour_bins(image: Image, points: Array) -> Ints:
    """Returns the colour histogram bin (M,), 0 to 63, of the pixel at each point (M, 2) u, v in px: blue + 4 green + 16
    red, 4 levels each."""
    u, v = points.astype(np.int64).T
    level = image[v, u].astype(np.int64) * LEVELS // 256
    return np.asarray(level @ np.array([1, LEVELS, LEVELS**2]))


def colour_density(bank: GroupBank, bins: Ints) -> Array:
    """Returns the probability (G, M) of each point's colour among the people of each group."""
    smooth = (bank.colour_hist + SMOOTHING / COLOUR_BINS) / (bank.colour_hist.sum(1, keepdims=True) + SMOOTHING)
    return np.asarray(smooth[:, bins])


def update_histograms(
    bank: GroupBank, chosen: Bools, claimants: Ints, bins: Ints, weights: Array, scaled: ScaledParameters
) -> None:
    """Updates the groups' colour histograms (in the bank) in place by their points that no other group may have."""
    keep = np.exp(-scaled.dt / scaled.config.extent_time)
    for row in np.flatnonzero(chosen.any(1)).tolist():
        mine = chosen[row] & (claimants < 2)
        if mine.any():
            new = np.bincount(bins[mine], weights[mine], COLOUR_BINS)
            old = bank.colour_hist[row]
            bank.colour_hist[row] = keep * old + (1 - keep) * new if old.any() else new
