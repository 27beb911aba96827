"""`stereo`: groups of people tracked in space by a stereo camera.

Y. Hoshikawa, Y. Hashimoto, A. Moro, K. Terabayashi, K. Umeda: "Tracking of Human Groups Using Subtraction Stereo", SICE
Journal of Control, Measurement, and System Integration 4 (3), 2011, sections 2 and 3. docs/trackers/stereo.md has the
state, the equations with their modules, and the departures.
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
