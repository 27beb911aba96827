"""`blob` from pixels: the cascade of Gonzalez et al. (2006) on blobs, and beyond it people who share a blob (ours).

classify, clean, find                                                       3   (tracking.detect)
a blob of one person's size: its ellipse z = (x, y, h, w, theta), gates, association, update      3.3, 4.2 to 4.4
the other foreground: split among the tracks expected there, by templates   ours (tracking.papers.blob.person_template)
what is left and as large as a person: new tracks                           ours (tracking.papers.blob.new_people)
axes return to those of a person at his place, where it is known            ours (tracking.papers.blob.ellipse_tracks)
rho, births, deaths                                                         4.5, 5
pixels of confirmed tracks are kept out of the background's adaptation      ours

A blob that is given to no track starts one. Where blobs are split that is so even in the gate of a track that a nearer
blob was given to, since its pieces have been measured together before; where they are not, none starts within a gate
(the paper's frame 367). Blobs have no `orphan_gate`.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Context, Detections, Frame, Image, Ints
from tracking import image_scale
from tracking.detect import blobs as detect
from tracking.detect import lone_blobs as lone
from tracking.detect.background import Background
from tracking.detect.mog2 import Mog2, Mog2Settings
from tracking.detect.person_size import PersonSize
from tracking.detect.pixel_classes import foreground
from tracking.filters import kalman
from tracking.papers.blob import box_geometry, new_people
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.ellipse_tracks import People
from tracking.papers.blob.person_template import Mask, painted

SHARED = 0.35  # share of a predicted box in a blob's from which on the blob may be this track's
UPRIGHT = 25.0  # deg, standard deviation of the direction of somebody measured by a template, which stands upright
EXTENT = 0.75, 1.3  # of the expected size, what a template may have
BLIND = 25.0  # variance of a template's height and width relative to a lone blob's: they are predicted, not seen
LEAST_SHOWN = 0.2  # a person of whom less shows is measured as if so much did


class Pixels:
    """From the picture of each frame to the population's next state. State: background and person size."""

    def __init__(self, config: BlobConfig, people: People, context: Context) -> None:
        assert context.background is not None
        if not np.isnan(context.px_per_m):
            image_scale.required(context.px_per_m)
        self.people, self.context = people, context
        self.size = PersonSize(context)
        self.background: Background | Mog2
        if config.segmentation == "mog2":
            self.background = Mog2(context.background, context.fps, _mog2(config))
        else:
            self.background = Background(context.background, context.fps, config)
        self.scale = context.px_per_m
        lone.learn(self.size, self.background, context.background, self.scale)
        self._take_scale()
        self.upright = np.inf if self.size.above else np.radians(UPRIGHT) ** 2
        self._set(config)

    def follow(self, config: BlobConfig) -> None:
        """Take on a config, which the population has taken on before; background and person size stay as learned."""
        self.background.follow(_mog2(config) if isinstance(self.background, Mog2) else config)  # type: ignore[arg-type]
        self._set(config)

    def _set(self, config: BlobConfig) -> None:
        from scipy.special import chdtri

        self.config = config
        # d^2 of 4 and 5 degrees of freedom, without and with a direction, at these shares (eq. 10)
        self.gates = chdtri(np.array([4, 5]), 1 - config.gate)
        self.confirm_gates = chdtri(np.array([4, 5]), 1 - config.confirm_gate)
        self.angle_noise = np.radians(config.angle_noise) ** 2

    def _take_scale(self) -> None:
        """The learned px per m, where the context has none."""
        if np.isnan(self.context.px_per_m):
            self.scale = self.size.px_per_m
            self.people.context = self.context.replace(px_per_m=self._known_scale())

    def _foreground(self, image: Image) -> tuple[Image, Bools]:
        """(H, W) classes, and foreground after cleaning (3.2, 3.3)."""
        classes = self.background.classify(image)
        return classes, detect.clean(foreground(classes), self._known_scale())

    def _known_scale(self) -> float:
        """px per m; a guess as long as nobody was seen."""
        return lone.or_guess(self.scale, self.background.valid.shape[0])

    def step(self, frame: Frame, detections: Detections | None) -> None:
        """Predict; measure by the picture, if it is there and no more of it than possible is foreground; manage."""
        people = self.people
        people.predict()
        people.look(np.zeros((0, 4)))
        if frame.image is None:
            return self._unseen(frame.t)
        classes, mask = self._foreground(frame.image)
        if np.count_nonzero(mask) / mask.size > self.config.most_foreground:
            self.background.adapt(frame.image, classes, self._protected())
            return self._unseen(frame.t)
        found = lone.people(mask, self._known_scale())
        self._measure(frame.t, mask, found)
        self.background.adapt(frame.image, classes, self._protected())
        if len(found):
            places = self.people.uprights()
            alone = self._lone(found, places) if self.size.reliable else ~self._several(found.box, places)
            alone &= ~lone.cut(found.box, self.background.valid.shape)
            self.size.learn(found.box, found.ellipse, alone)
            self._take_scale()
        return None

    def _unseen(self, t: float) -> None:
        """Nobody was measured: gain 0 for all (4.4)."""
        people = self.people
        people.mark(np.zeros(0, np.int64), np.zeros(0, bool), np.zeros(0))
        people.bury(t)

    def _protected(self) -> Bools:
        """(H, W) the places of confirmed tracks."""
        places = _templates(self._boxes(self.people.uprights()[self.people.confirmed]))
        return painted(self.background.valid.shape, places)

    def reported(self, rows: Ints) -> Array:
        """(K, 4) boxes x, y, h, w of tracks, as they are told."""
        return self._boxes(self.people.uprights()[rows])

    def _measure(self, t: float, mask: Bools, found: detect.Blobs) -> None:
        """Associate, split, update and manage by the cleaned foreground (H, W) and its blobs."""
        people, c = self.people, self.config
        expected = people.uprights()
        split = c.split and self.size.reliable
        lone = self._lone(found, expected) if split else np.ones(len(found), bool)
        columns = lone.nonzero()[0]
        z, angle_var = found.ellipse[columns], found.angle_var[columns] + self.angle_noise
        rows, taken, gated = self._associate(z, angle_var)
        noise = np.tile(people.noise, (len(rows), 1))
        measured, angles = z[taken], angle_var[taken]
        support = np.ones(len(rows))
        free = ~np.isin(np.arange(len(z)), taken)
        newborn = z[free if split else free & ~gated]
        if split:
            scene = Mask(mask)
            scene.close(found.label, columns)
            for sure in (True, False):
                more = self._split(scene, expected, rows, sure)
                rows, measured = np.concatenate([rows, more[0]]), np.concatenate([measured, more[1]])
                noise, support = np.concatenate([noise, more[2]]), np.concatenate([support, more[3]])
                angles = np.concatenate([angles, np.full(len(more[0]), self.upright)])
            entered = new_people.newcomers(scene, self.size, c.entry_support)
            newborn = np.concatenate([newborn, self._ellipses(_places(entered))])
        d2 = people.update(rows, measured, noise, angles)
        if split:
            self._settle_sizes()
        near = d2 <= self.confirm_gates[kalman.directed(angles).astype(int)]
        people.mark(rows, near, support)
        people.excuse()
        people.bury(t)
        people.give_birth(newborn, np.ones(len(newborn)), t)

    def _settle_sizes(self) -> None:
        """Tracks' axes return to what a person's are at their places."""
        at = _templates(self.people.uprights())
        axes = self.size.axes(at[:, :2])
        rows = np.flatnonzero(np.isfinite(axes).all(1))
        self.people.settle(rows, -np.sort(-axes[rows]), self.config.person_noise**2)

    def _lone(self, found: detect.Blobs, expected: Array) -> Bools:
        """(M,) blobs of one person's size, whole, in which at most one confirmed track is expected."""
        box = found.box
        whole = ~lone.cut(box, self.background.valid.shape)
        return np.asarray(self.size.one(box, found.ellipse) & whole & ~self._several(box, expected))

    def _boxes(self, upright: Array) -> Array:
        """(N, 4) x, y, h, w: boxes of people whose ellipses have these upright boxes (N, 4)."""
        return np.concatenate([upright[:, :2], upright[:, 2:] * self.size.loose], 1)

    def _ellipses(self, place: Array) -> Array:
        """(N, 5) x, y, h, w, theta: the ellipses of people in upright boxes (N, 4) x, y, h, w."""
        return box_geometry.lying(np.concatenate([place[:, :2], place[:, 2:] / self.size.loose], 1))

    def _several(self, box: Array, expected: Array) -> Bools:
        """(M,) blobs, boxes ltwh (M, 4), in which several confirmed tracks are expected; expected (N, 4) x, y, h, w."""
        sure = expected[self.people.confirmed]
        places = np.column_stack([box[:, 0] + box[:, 2] / 2, box[:, 1] + box[:, 3] / 2, box[:, 3], box[:, 2]])
        return np.asarray((box_geometry.covered(sure, places) >= SHARED).sum(0) > 1)

    def _associate(self, z: Array, angle_var: Array) -> tuple[Ints, Ints, Bools]:
        """Tracks and ellipses z (M, 5) that belong together, and which ellipses (M,) lie in some track's gate: of 5
        degrees of freedom where the ellipse has a direction, else of 4 (eqs 9, 10). From straight above of 4 always:
        people turn on the spot.
        """
        people = self.people
        if not len(z) or not len(people.id):
            return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(len(z), bool)
        d2 = kalman.distances(people.bank, z[:, :4], people.noise, people.scale)
        gate = np.tile(self.gates[0], len(z))
        if not self.size.above:
            d2 = d2 + people.turned(z[:, 4], angle_var)
            gate = self.gates[kalman.directed(angle_var).astype(int)]
        cost = np.where(d2 <= gate, d2, np.inf)
        gated = np.asarray(np.isfinite(cost).any(0))
        return *people.pairs(cost, self.gates[1]), gated

    def _split(self, scene: Mask, expected: Array, rows: Ints, sure: bool) -> tuple[Ints, Array, Array, Array]:
        """Tracks but `rows` measured by templates, the confirmed (`sure`) or the others: rows (K,), z (K, 5), R (K, 4)
        m^2, support (K,). R grows with the inverse square of the share `shown`; h and w, little but the track's own,
        get BLIND times it.
        """
        people, c = self.people, self.config
        open_rows = np.setdiff1d(np.flatnonzero(people.confirmed == sure), rows)
        at = _templates(self._boxes(expected[open_rows]))
        size = self.size.at(at[:, :2])
        size = np.where(np.isfinite(size), size, at[:, 2:])
        at[:, 2:] = np.clip(at[:, 2:], EXTENT[0] * size, EXTENT[1] * size)
        var = (people.bank[kalman.VAR, open_rows] + people.noise)[:, :2]
        spread = np.sqrt(var) * people.scale[open_rows, None]
        at = scene.settle(at, spread, c.evidence)
        keep = scene.prune(at, c.track_support if sure else c.entry_support, pieces=sure)
        at = at[keep]
        worth, shown = scene.alone(at), scene.shown(at)
        noise = people.noise / np.maximum(shown, LEAST_SHOWN)[:, None] ** 2
        noise[:, 2:] *= BLIND
        return open_rows[keep], self._ellipses(_places(at)), noise, np.clip(worth, 0.0, 1.0)


def _mog2(config: BlobConfig) -> Mog2Settings:
    return Mog2Settings(shadow=config.dark, background_time=config.background_time)


def _templates(place: Array) -> Array:
    """(N, 4) x, foot, h, w of boxes x, y, h, w round their centre."""
    out = place.copy()
    out[:, 1] += place[:, 2] / 2
    return out


def _places(template: Array) -> Array:
    """(N, 4) x, y, h, w round the centre of templates x, foot, h, w."""
    out = template.copy()
    out[:, 1] -= template[:, 2] / 2
    return out
