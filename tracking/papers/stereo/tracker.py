"""Groups of people tracked in space by a stereo camera: the tracker `stereo`.

Y. Hoshikawa, Y. Hashimoto, A. Moro, K. Terabayashi, K. Umeda: "Tracking of Human Groups Using Subtraction Stereo", SICE
Journal of Control, Measurement, and System Integration 4 (3), 2011, sections 2 and 3. Lengths are m, times s.

State of a group: an extended Kalman filter of position and velocity, X = (x, x', y, y', z, z') (eq. 1); Sigma, the
covariance of its points' positions and velocities; N, the number of its points.

    X_k+1 = Phi X_k + noise                                eqs 2, 3            space_group
    Z = (u, v, d) = f(X) + noise                           eqs 4 to 6          space_group, sim.scene.camera
    Sigma <- alpha Sigma + (1 - alpha) C_y                 eq. 7               space_group
    (y - xi)' S^-1 (y - xi) < gamma                        eq. 8               space_group
    m_total = p(y)^k_p p(lambda)^k_v, the largest wins     eqs 9 to 11         space_group
    new groups: points whose spheres overlap               eq. 12              group_life
    merging by the full state, weighted by N               eqs 13 to 15        group_life

C_y is the covariance of the points' positions y and velocities lambda. S is Sigma + P, of the members and of the
filter, with the point's covariance added (`point_covariance`). Spheres have the radius `radius`; groups merge whose
regions of X overlap (`merge_gate`). The foreground, subtraction stereo (sec. 2) and KLT (sec. 3.1) are in
tracking.detect, person or not (sec. 2) in points.

Readings: eq. 6 is printed with y for x, and takes world for camera coordinates; here f contains the camera's pose and
the image's centre. A feature has the covariance J^-1 R J^-T, with the Jacobian J of (u, v, d) and R from `pixel_noise`
and `disparity_noise`: its error grows with the squared depth. The mean position of sec. 3.3 is that of (x, y, z),
projected by f: the mean disparity would be biased in depth. The threshold of updates (sec. 3.3) is that of sec. 4: more
than two points. Sec. 3.3 names the size and velocity of groups as cues; eqs 9 to 11, as here, have position and
velocity. C_y of eq. 7 is that of the current frame; Sigma of a group that is not measured stays. The number of sec. 3.4
(`group_points`) is that of the points of a connected component. I_n of eq. 13 is transitive. The filter is an extended
one, as f is not linear. The text does not state the order of steps in a frame; here it is that of secs. 3.3 to 3.5:
association, update, new groups, merging. So a new group can merge in its first frame. Groups that overlap only after a
merger can merge in the next frame.

Departures. Without a parameter that switches it off, one holds in the preset `paper`, too; `density_width`,
`spread_weight`, `split_time` and `coast_time` only make theirs weak there:

- subtraction: in the left picture only. Paper: not stated. Why: one background model.
- foreground: that of `blob` (five classes, cleaning, least area). Paper: background subtraction. Why: shared.
- matching: OpenCV's block matching of grey values with its checks, blocks of 0.27 m, up to the disparity of `nearest`.
  Paper: not stated. Why: speed, wrong matches.
- scale: blocks, spacing of features and least areas are in px by one scale of the image. Paper: none. Why: any camera.
- person or not: fixed limits, by quantiles; the highest one without the errors of points; any width; regions cut by the
  edge are not too small; fewer than 5 disparities are nobody. Paper: by height and width. Why: no limits printed.
- features: in the left picture; checked backwards, a least distance apart, new ones 1 px inside; they end outside
  people, need a disparity (median of 3 x 3 px) now and in most of `window_time`; at most 400. Paper: KLT, the window.
  Why: wrong matches, speed.
- far features: no disparity below 4 `disparity_noise`. Paper: none. Why: the error of such a depth is not normal.
- velocity of a feature: slope over `window_time`. Paper: not stated. Why: one frame is too noisy.
- time: seconds; α_s = exp(−dt / `spread_time`). Paper: steps of a frame. Why: any frame rate.
- Q: white acceleration (`accel_noise`). Paper: not printed. Why: any frame rate.
- γ, MR, spheres: constants (`gate`, `merge_gate`, `radius`, `point_radius`). Paper: γ, spheres by scene; MR not
  printed. Why: no tuning.
- visible side: points moved away from the camera (`surface_offset`). Paper: none. Why: the camera sees surfaces.
- mean position: features count by their inverse density on the ground (`density_width`); in the first velocity, in C_y
  and in N all count alike. Paper: all count alike. Why: textured people have more features.
- height: reported from the top of the features (`top_offset`); the filter has their mean. Paper: the mean. Why: other
  people and the edge of the picture hide legs, so that the mean height changes; the result is the middle of bodies.
- errors of points: added in eqs 8 to 10, taken off C_y, whose eigenvalues then are at least 0 (`point_covariance`); R,
  first P and density have them always. Paper: none. Why: depth is uncertain.
- P and Σ: P of the filter, Σ of the members; search regions and eqs 9, 10 use their sum, merging Σ. Paper: Σ in eqs 7
  and 8, P in 9 and 10, both the tracker's covariance. Why: a member is no centroid; where a hidden group is, is unsure.
- merged P: that of the weighted mean, sum of n² P_i. Paper: one covariance, eq. 15. Why: P is of the centroid.
- Σ: shrunk to a prior (`spread_weight`) of `person_spread` and 0.25 m/s; C_y divides by n; 1e-6 is added to its
  diagonal. Paper: sample covariance. Why: few points in six dimensions.
- N: of the last frame in which the group was measured, also when a hidden group merges; of a merged group the sum.
  Paper: of every frame. Why: a hidden group would have no weight.
- R: of the mean of the points, and `centroid_noise`. Paper: one, not printed. Why: points come and go.
- first P: of the points' mean position and velocity, members' velocities varying by 0.25 m/s. Paper: covariance of the
  points. Why: a member is no centroid.
- k_p, k_v: exponents, 1 and `velocity_weight`. Paper: factors. Why: factors have no effect.
- merged id: of the largest confirmed group. Paper: a new number (Fig. 7). Why: a group keeps its identity, as in the
  scores.
- young groups: tentative ones merge without event, and a known group keeps its id; with `confirm_time` 0 those of this
  frame. Paper: a new group is a tracker at once (sec. 3.4), and merges as all do. Why: only confirmed groups are
  reported.
- events: enter, leave, merge, split. Paper: none. Why: they are scored.
- report: groups that are measured in the frame. Paper: ellipses round associated points; of others not stated. Why: a
  hidden group has no places of members.
- splits: linked parts for `split_time`, unless they would merge again. Paper: none. Why: groups part.
- parts: start anew from their points, with the group's velocity; the largest keeps the id. Paper: none. Why: tracks
  need ids.
- confirmation, deletion: `confirm_time`, `coast_time`. Paper: none. Why: wrong matches.
- too much foreground (`background`), no picture: features start anew, so nothing is measured for `window_time`; groups
  go on. Paper: none. Why: light changes, lost pictures.
- hulls: round places corrected for errors (`point_covariance`), half a footprint each, from points a whole one. Paper:
  ellipses. Why: features lie all over a body.
- background: adapts, but not where people are, except for ghosts and in frames with too much foreground
  (`background`). Paper: not stated. Why: light changes.
- points as input: linked between frames, at most 2 m/s and 3 `point_noise` off; no detections end all links; used at
  once, one is enough; Z is their place, and all count alike; velocity 0 when new; spheres of `point_radius`. Paper:
  none. Why: other detectors.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sim.arrays import no_ids
from sim.geometry.hull_kernels import convex_hulls
from sim.geometry.polygons import FOOTPRINT
from sim.types import Context, Detections, Frame, Groups, Plane, Tracks
from tracking.detect.features import SpacePoints
from tracking.grouping.whole_groups import GroupIds, WholeGroupEvent, whole_group_tracks
from tracking.papers.stereo import space_group
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.group_life import born, confirm, merge, remove_lost, sphere_groups, split
from tracking.papers.stereo.picture_points import PicturePoints
from tracking.papers.stereo.point_links import PointLinks
from tracking.papers.stereo.space_group import POS, VEL, Measurement, SpaceGroup
from tracking.running.image_scale import required

LEAST_FEATURES = 3  # From pixels: least number of features that update a group (sec. 3.3).
FEATURE_OUTLINE = 0.5  # Share of a person's footprint that a feature covers, as features lie all over the body.


class Stereo:
    """The tracker `stereo`: groups of people in space, from pairs of pictures or from points.

    State: config, which may be replaced between two frames; groups, a list; ids; pictures: from pictures to points,
    None from points; links: from detections to points; motion: the model of a step; measurement: of a position; plane;
    scale: units of the plane per m; context. All but config exist after `reset` only.
    """

    needs: ClassVar[tuple[str, ...]] = ("stereo", "points")
    config_class: ClassVar[type[StereoConfig]] = StereoConfig

    def __init__(self, config: StereoConfig | None = None) -> None:
        self.config = config or StereoConfig()

    def reset(self, context: Context, seed: int) -> None:
        """Forgets everything and starts a sequence. With a background sample in the context pairs of pictures are
        tracked, else points.

        `seed` has no effect: nothing is random. From pictures, raises InputError if the context has no pinhole camera
        with a baseline and without lens distortion, or if the sample cannot be used.
        """
        del seed
        self.context = context
        self.groups: list[SpaceGroup] = []
        self.ids = GroupIds()
        self.pictures = None if context.background is None else PicturePoints(self.config, context)
        self.links, self.motion = PointLinks(context.fps), space_group.motion_model(self.config, 1 / context.fps)
        self.measurement = Measurement(None if self.pictures is None else self.pictures.camera)
        flat = context.camera is None and context.px_per_m > 0
        self.plane: Plane = "space" if self.pictures is not None else "image" if flat else "ground"
        self.scale = 1.0

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Returns the groups and events of the frame, as Tracks with unit "group"; updates all groups.

        From pictures `frame.image` and `frame.right` are used and the plane is "space"; from points `detections.pos`,
        whose plane is kept. Without them, and from pictures with too much foreground, no group is measured; groups are
        predicted, merge and end all the same. A config that has replaced `config` since the last frame holds from this
        frame on; the groups stay.

        Raises InputError if points are in the image and the context has no scale above 0, or if a picture's size or
        dtype is wrong.
        """
        if self.pictures is not None and self.pictures.config is not self.config:
            self.pictures.follow(self.config)
        if self.motion.config is not self.config:
            self.motion = space_group.motion_model(self.config, 1 / self.context.fps)
        points, t = self._points(frame, detections), frame.t
        for group in self.groups:
            space_group.predict(group, self.motion)
        self._measure(points, t)
        events = merge(self.groups, self.config, t)
        events += confirm(self.groups, self.config, t, self.ids)
        events += remove_lost(self.groups, self.config, t)
        return self._report(frame, events)

    def _report(self, frame: Frame, events: list[WholeGroupEvent]) -> Tracks:
        """Returns the confirmed groups that are measured in this frame, by id."""
        shown = [g for g in self.groups if g.confirmed and g.last_seen == frame.t]
        shown.sort(key=lambda g: g.id)
        axes, s, from_points = 3 if self.plane == "space" else 2, self.scale, self.pictures is None
        order, flat = POS[:axes] + VEL[:axes], np.ix_(POS[:2], POS[:2])
        x = s * np.array([g.ekf.x[order, 0] for g in shown]).reshape(-1, 2 * axes)
        if axes == 3:
            x[:, 2] += [g.rise for g in shown]
        P = s**2 * np.array([g.ekf.P[np.ix_(order, order)] for g in shown]).reshape(-1, 2 * axes, 2 * axes)
        extent = s**2 * np.array([g.spread[flat] for g in shown]).reshape(-1, 2, 2)
        outline = FOOTPRINT * (1.0 if from_points else FEATURE_OUTLINE)  # what a point covers, seen from above, m
        hulls = convex_hulls([((g.members + g.pos)[:, None, :2] + outline).reshape(-1, 2) * s for g in shown])
        id, size = np.array([g.id for g in shown], np.int64), np.array([g.count for g in shown], float)
        size = size if from_points else size * np.nan
        groups = Groups(id, (no_ids(),) * len(id), x[:, :axes], x[:, axes:], extent, size, hulls)
        return whole_group_tracks(frame, self.plane, self.context.fps, groups, P, events, s)

    def _points(self, frame: Frame, detections: Detections | None) -> SpacePoints:
        if self.pictures is not None:
            if frame.image is None or frame.right is None:
                self.pictures.features.forget()
                return SpacePoints.none()
            return self.pictures.points(frame.image, frame.right)
        if detections is None:
            self.links.forget()
            return SpacePoints.none()
        self.plane = detections.plane
        self.scale = required(self.context.px_per_m) if self.plane == "image" else 1.0
        xyz = np.zeros((len(detections.pos), 3))
        xyz[:, : detections.pos.shape[1]] = detections.pos / self.scale
        return self.links.step(xyz, self.config)

    def _measure(self, points: SpacePoints, t: float) -> None:
        c, motion = self.config, self.motion
        radius, least, update = (
            (c.point_radius, 1, 1) if self.pictures is None else (c.radius, c.group_points, LEAST_FEATURES)
        )
        owner = space_group.associated(self.groups, points, c)
        children: list[SpaceGroup] = []
        for k, group in enumerate(self.groups):
            mine = points.at(owner == k)
            if len(mine) < update:
                group.apart_since = float("nan")
                continue
            space_group.measure(group, mine, self.measurement, motion, t)
            children += split(group, mine, sphere_groups(mine.pos, radius, least), self.measurement, motion, t)
        loose = points.at(owner < 0)
        alone = sphere_groups(loose.pos, radius, least)
        self.groups += children + born(loose, alone, self.measurement, motion, t)
