"""`group-pda`: groups of people tracked as wholes, from points or foreground pixels.

Gennari & Hager, "Probabilistic data association methods in visual tracking of groups", CVPR 2004. A group is
(xi, v, Sigma, N): centroid and velocity x with covariance P, extent of its members, how many people they are. Each
frame (Fig. 1):

    predict    x = F x, P = F P F' + Q                                                  (2.3; bank)
    gate       {y : (y - xi)' S^-1 (y - xi) < gamma}                                    (2.2; kernels.search)
    associate  Y_ns + the first j of the shared points, by distance, for all j          (4.1; kernels._claims)
    masses     m_d m_N m_g: centroid, number, group constraint |G_y| = 1                (4.2; kernels._estimate)
    update     x, P, Sigma, N as means over the associations                            (2.4, 4.3; kernels._mix, _adapt)
    split      after a spell in which no association has a mass                         (3.3, 4.2; changes.split)
    merge      groups near each other with like velocities, on updated states           (3.1; merging.Merging)
    birth      unclaimed points, grouped by G_y                                         (3.3; changes.births)

Departures, all ours:
- The search region has the centroid's and the points' uncertainty beside Sigma; it widens while no association is
  feasible. What its edge cuts from Sigma is put back, extents of few people are shrunk to a prior one, the same ones in
  splitting and merging, so that what is split is not merged.
- R of the centroid: members keep their places and are drawn without replacement out of those there (of those seen, if
  they are more). m_N grows with N and has tails; a further association is that nothing is the group's (the miss).
- Sigma and N rest while points are shared, and in spells. A shared point is told as the likelier group's. Of two groups
  that lie on the points of one for too long one is lost (doubles).
- From points, members who are not measured are carried along for a while as points of their group (carry); points that
  are linked to a group's, but in no region, are its own (attach).
- P of merged groups is that of a weighted mean. SR_v is a physical difference of velocities, and must last. Groups that
  are tentative, coasting, in a spell, or without points of their own do not merge; linked points are near, whatever the
  regions. From pixels who is far behind is not near, and groups on the same points may merge. A spell is
  shortened by good frames rather than ended.
- Children of a split have their parent's velocity; so has who walks out of its region. The largest keeps the id.
- Groups are tentative at first, coast, are lost, and take their id back from a newborn that fits.
- Onsets of merges and splits are looked at afterwards (onset). In an image seen at an angle, velocities and distances
  in depth count for more px than they show.
- association="none", the paper's 5.2.1, takes all points in the region, attached and carried ones, too: no masses, no
  miss, no spell, so no split but by walking out.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sim.geometry.footprints import FOOTPRINT
from sim.types import Array, Bools, Context, Detections, Frame, Plane, Tracks
from tracking.image_scale import required
from tracking.papers.group_pda import association_kernels as kernels
from tracking.papers.group_pda import split_birth_loss as changes
from tracking.papers.group_pda.carried_members import Claims, claimed, exclusive, remember, with_carried
from tracking.papers.group_pda.colour import colours, learn, speaks
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.duplicate_groups import Doubles
from tracking.papers.group_pda.from_pixels import Pixels, steepness
from tracking.papers.group_pda.group_bank import Bank
from tracking.papers.group_pda.kernel_parameters import Rules, make_rules
from tracking.papers.group_pda.merging import Change, Merging
from tracking.papers.group_pda.report import tracks

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


class GroupPda:
    """The tracker. State: the bank of groups, who is about to merge, the names given, what tells foreground.

    innovation: of the last step (id, y (2,), S (2, 2)) of each named group's likeliest association.
    """

    needs: ClassVar[tuple[str, ...]] = ("pixels", "points")
    config_class: ClassVar[type[GroupPdaConfig]] = GroupPdaConfig

    def __init__(self, config: GroupPdaConfig | None = None) -> None:
        self.config = config or GroupPdaConfig()

    def reset(self, context: Context, seed: int) -> None:
        """Forget everything; with a background sample pixels are tracked, else points. `seed` is unused."""
        self.context = context
        self.bank, self.names = Bank.empty(), changes.Names()
        self.merging, self.doubles = Merging(), Doubles()
        self.pixels = None if context.background is None else Pixels(self.config, context)
        if self.pixels is not None:
            self.context = context.replace(px_per_m=self.pixels.scale)
        self.rules: Rules | None = None
        flat = context.camera is None and context.px_per_m > 0
        self.plane: Plane = "image" if flat or self.pixels is not None else "ground"
        self.innovation: list[tuple[int, Array, Array]] = []
        self.colour = np.zeros(0, np.int64)
        self.box: Array | None = None

    @property
    def px_per_m(self) -> float:
        """Of the image: the context's, or learned from its background sample."""
        return self.context.px_per_m

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Predict; gate, associate, update, split (Fig. 1); merge; births and deaths.

        `config` may have been replaced since the last frame: the groups go on with the new one.
        """
        if self.pixels is not None and self.pixels.config is not self.config:
            self.pixels.follow(self.config)
        points, weights = self._points(frame, detections)
        if points is None and self.rules is None and self.pixels is None:
            return self._silent(frame)
        rules = self._rules()
        bank, t = self.bank, frame.t
        if bank.look.shape[1] != rules.colours:
            bank.look = np.zeros((len(bank), rules.colours))
        self.innovation = []
        bank.predict(rules)
        told: list[Change] = []
        if points is not None:
            told += self._measure(points, weights, rules, t)
        self.doubles.step(bank, rules, t)
        told += self.merging.step(bank, rules, t)
        told += changes.confirm(bank, rules, t, self.names)
        told += changes.deaths(bank, rules, t)
        return tracks(bank, told, rules, frame.index, t, self.plane, self.context.fps, self._outline(detections))

    def _points(self, frame: Frame, detections: Detections | None) -> tuple[Array | None, Array]:
        """The frame's points (M, 2) and the people each stands for (M,); None where the frame tells nothing."""
        if self.pixels is not None:
            found = None if frame.image is None else self.pixels.points(frame.image, self.outlines())
            if found is not None and frame.image is not None and self.config.appearance > 0:
                self.colour = colours(frame.image, found)
            return found, np.full(0 if found is None else len(found), self.pixels.share)
        if detections is None:
            return None, np.zeros(0)
        self.plane = "image" if detections.plane == "image" else "ground"
        return np.ascontiguousarray(detections.pos[:, :2]), np.ones(len(detections.pos))

    def _outline(self, detections: Detections | None) -> Array:
        """(V, 2) what stands round a place: a cell of the grid, a footprint, in the image a person's usual box."""
        if self.pixels is not None:
            return SQUARE * self.pixels.step / 2
        if self.plane == "ground":
            return FOOTPRINT
        if detections is not None and detections.box is not None and len(detections.box):
            self.box = np.median(detections.box[:, 2:], 0)
        return FOOTPRINT * self.context.px_per_m if self.box is None else SQUARE * self.box / 2

    def outlines(self) -> list[Array]:
        """The outlines of the groups that have an id, px, the whole cells of the grid."""
        bank, cell = self.bank, self._outline(None)
        rows = np.flatnonzero(bank.named).tolist()
        return [((bank.places[r][0] + bank.x[r, :2])[:, None] + cell).reshape(-1, 2) for r in rows]

    def _silent(self, frame: Frame) -> Tracks:
        """Nothing was seen yet, not even what the plane is."""
        none, ids = np.zeros((0, 2)), np.zeros(0, np.int64)
        return Tracks(frame.index, frame.t, self.plane, "group", ids, ids, none, none, np.zeros((0, 4, 4)))

    def _rules(self) -> Rules:
        """The rules by the present config; those for points only once it is known what plane they lie in."""
        if self.rules is not None and self.rules.config is self.config:
            return self.rules
        if self.pixels is not None:
            p, scale = self.pixels, self.context.px_per_m
            steep = steepness(self.context.camera)
            self.rules = make_rules(self.config, self.context.fps, scale, p.spread, steep)
            return self.rules
        scale = required(self.context.px_per_m) if self.plane == "image" else 1.0
        steep = steepness(self.context.camera) if self.plane == "image" else 1.0
        self.rules = make_rules(self.config, self.context.fps, scale, steep=steep)
        return self.rules

    def _measure(self, points: Array, weights: Array, rules: Rules, t: float) -> list[Change]:
        """Search regions, associations, updates (4); splits and births (3.3)."""
        bank = self.bank
        d2 = self._search(points, rules, t)
        own = changes.attached(points, d2, bank, rules) if self.config.attach else np.full(len(points), -1)
        claims = with_carried(claimed(points, weights, d2, own, t), bank, rules, t)
        before = changes.standing(bank, rules, t)
        looks = speaks(bank, claims.d2, self.colour) if rules.colours else np.zeros((len(bank), 0))
        chosen = self._associate(claims, looks, rules, t)
        told = self._split(claims, chosen, looks, rules, t)
        free = claims.hits[: len(points)] == 0
        changes.births(bank, points[free], weights[free], before, rules, t)
        return told

    def _associate(self, claims: Claims, looks: Array, rules: Rules, t: float) -> Bools:
        """Update the groups by their associations; (G, M) the points of each group's likeliest one."""
        bank = self.bank
        state, chosen, said = kernels.associate(
            claims.points, claims.weights, claims.d2, self.config.appearance * looks, claims.own, claims.hits,
            bank.x, bank.P, bank.extent, bank.size, bank.null > 0, rules.numbers,
        )  # fmt: skip
        fresh = (chosen & (claims.seen >= t)).any(1)  # more than members carried along
        measured, null = (state == kernels.MEASURED) & fresh, state == kernels.NULL
        bank.seen[measured | null] = t
        bank.measured[measured] += rules.dt
        bank.null = np.where(null, bank.null + rules.dt, np.maximum(bank.null - rules.dt * measured, 0.0))
        self.innovation = [
            (int(bank.id[g]), said[g, :2].copy(), said[g, [2, 3, 3, 4]].reshape(2, 2))
            for g in np.flatnonzero(measured & bank.named).tolist()
        ]
        mine = chosen & exclusive(chosen, claims.d2, looks)
        bank.own = mine @ claims.weights
        remember(bank, claims, mine, rules, t)
        if rules.colours:
            learn(bank, mine, claims.hits, self.colour, claims.weights, rules)
        return chosen

    def _search(self, points: Array, rules: Rules, t: float) -> Array:
        """d2 (G, M). Lost groups claim nothing; tentative ones what no other claims."""
        bank = self.bank
        lost = bank.named & (t - bank.seen > max(self.config.coast_time, rules.dt) + 1e-9)
        wider = np.square(rules.scale * self.config.split_speed * bank.null)
        d2 = kernels.search(points, bank.x, bank.P, bank.extent, rules.noise**2, wider, self.config.gate)
        d2[lost] = np.inf
        tentative = ~bank.named
        if tentative.any():
            claimed = np.isfinite(d2[~tentative]).any(0)
            d2[np.ix_(tentative, claimed)] = np.inf
        return d2

    def _split(self, claims: Claims, chosen: Bools, looks: Array, rules: Rules, t: float) -> list[Change]:
        """Groups that had no feasible association for split_time fall into those that their points form; shared points
        go with the likeliest group."""
        bank, told = self.bank, []
        due = np.flatnonzero((bank.null >= self.config.split_time - 1e-9) & (bank.null > 0))
        shared = exclusive(np.isfinite(claims.d2), claims.d2, looks)
        mine = chosen & (shared | (claims.own == np.arange(len(bank))[:, None]))  # attached and carried ones, too
        for row in due.tolist()[::-1]:  # from behind: children stand at the end
            points, weights = claims.points[mine[row]], claims.weights[mine[row]]
            change = changes.split(bank, row, points, weights, rules, t, self.names)
            told += [] if change is None else [change]
        return told
