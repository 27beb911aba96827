"""The tracker `blob`: gates, association, a bank of Kalman filters and track management, on boxes or from pixels.

Gonzalez, Rowe, Andrade, Villanueva, "Efficient management of multiple agent tracking through observation handling",
2006. State of a track (sec. 4.1): (x, x', y, y', h, h', w, w'), constant speed with white acceleration; places in image
px, covariances in m and s. The measurement is z = (x, y, h, w): centre, height and width of a box. A box has no
direction; the paper's ninth state, the angle theta, is measured from pixels only. There h and w are the full axes
of a blob's ellipse. With a camera each track has a second filter, of the person on the ground (ours).

    (A, Q: transition and process noise; P: covariance of x; C: picks the measured coordinates; R: measurement noise;
    y = z - C x: innovation; S = C P C' + R its covariance; K: gain; d^2: squared Mahalanobis distance; chi2:
    chi-squared)

    predict    x = A x,  P = A P A' + Q                        eqs 1, 2        tracking.filters.kalman
    gate       z_pred = C A x (x before the prediction)        eq. 8           update_from_boxes, update_from_pixels
               d^2 = (z - z_pred)' S^-1 (z - z_pred) <= q      eqs 9, 10       q: the quantile `gate` of chi2 with 4
                                                                               degrees of freedom, 5 with theta
    associate  measurements and gated tracks                   sec. 4.4        track_management.associate
    update     K = P C' S^-1,  x = x + K y,  P = (I - K C) P   eqs 3 to 7      tracking.filters.kalman
    ground     x, y, x', y' and height of the person, by an    ours            track_management.measure_on_ground
               extended Kalman filter, where a camera is known
    manage     rho = sqrt|S| / asymptote: confirmed if rho     secs. 4.5, 5    track_management,
               and d^2 are low, deleted if rho is high                         tracking.filters.track_uncertainty
               or by existence                                 ours            existence
    pixels     background, classes, cleaning, ellipses         secs. 3.1-3.3   tracking.detect

Readings: eq. 4 lacks brackets. Eq. 9 has row and column exchanged; eq. 5 of theta is modulo pi. The "Mahalanobis
radius" of sec. 4.3 is the quantile of chi2. The nearest track (sec. 4.4) is that of least d^2. The percentage of the
asymptotic value (sec. 5) is above 100 % (`confirm_ratio`), as rho falls to 1. The "given ellipsoid variance" of secs.
4.5 and 5 is the quantile 0.99 of chi2. With "rho" a confirmed track stays confirmed, and all confirmed tracks are
reported.

Departures, from boxes and from pixels. In this list those from `management` on hold unless it is "rho". A departure
without a parameter that switches it off holds in the preset `paper`, too.

- input: also boxes, without θ. Paper: blobs. Why: detectors report boxes.
- noises: in m at the person and per root second, those of x, y, h, w, θ independent. Paper: no values. Why: any scale
  and frame rate.
- scale of a track: its longer side is 1.7 m, but at most a factor of 2 from the image's scale; from straight above the
  image's. An unknown scale of the image follows from the first boxes, or from lone blobs. Paper: none. Why: near people
  are larger.
- first P: R, `speed_prior` and 0.2 m/s for sizes, at rest. Paper: not stated. Why: a filter needs it.
- deletion: also missed tracks outside the image. Paper: ρ. Why: they do not come back.
- deletion, with "rho": missed tracks by ρ: confirmed ones 2 % below its value after `coast_time` of misses from the
  steady state, tentative ones at its value at birth; tentative ones, missed or not, also after `tentative_time`. Paper:
  one value of ρ, by a number of frames. Why: false alarms end early.
- several boxes or blobs of one track, with "rho": the nearest counts. Paper: all are assigned (frame 367), not how.
  Why: a filter takes one.
- places: where a camera is known, reported on the ground, or on the scene's stairs. A second filter has the state x, y,
  x', y' and the person's height, 1.7 +- 0.1 m at first, below the box, but not where the box would be too high by far.
  An extended Kalman update takes the centre and the height of each associated box, with R; `accel_noise` and
  `speed_prior` are those of the first filter. Gates, association and boxes are those of the first filter alone. Tracks
  above the horizon are not reported. Paper: px. Why: scenes are in m, and motion in depth moves a box little.
- `management`: by an existence probability (existence), of which a frame that nobody observed is no evidence; a track
  below 0.5 is tentative again, one below 0.01 is deleted. Paper: ρ. Why: rates hold at any frame rate and detector.
- association: one to one, most likely, against false and new boxes. Paper: nearest gated track. Why: a wide gate must
  not win.
- scores of boxes: likelihood ratios, learned from the existence of the boxes' tracks. Paper: none. Why: scores are no
  probabilities.
- births: the first existence is by the odds of new people to false boxes and second boxes of people; boxes start tracks
  from 0.01, also inside gates; from 0.5 a new track is confirmed at once. Paper: a measurement in no gate starts a
  tentative track. Why: people near others must start tracks.
- hidden people: detected as far as no other in front covers them, and not at all for `hidden_time`. Paper: none. Why:
  misses come in rows.
- rates of height and width, from boxes: return to zero. Paper: constant. Why: a missed person's size settles.
- report: boxes that are right with a probability of at least 0.5, and not leaving while missed. Paper: not stated.
  Why: fewer false positives.

Departures from pixels only:

- training: from inliers, of two colours of a pixel the more frequent; with least σ, normalisers and thresholds, from
  pixels that nothing covered in the sample. Paper: all frames; the histogram of a frame (Fig. 2). Why: people walk
  through the sample.
- unsteady pixels, first σ above 20 grey levels: always background. Paper: none. Why: they show no background.
- light: gain of each frame; far brighter pixels are foreground; ghosts are replaced, also those of the sample
  (`background`). Paper: none. Why: light and scene change.
- dark foreground: by the brightness itself (`dark`), and only below the lower threshold. Paper: a normalised threshold.
  Why: noise must not move the limit.
- grey samples: no shadows or highlights. Paper: colour. Why: no chromaticity.
- opening: none up to 40 px per m. Paper: opening. Why: it removes heads.
- cleaning: windows and least area in m. Paper: not stated. Why: any scale.
- contours: none. Paper: extracted (sec. 3.3). Why: only pictures need them.
- θ: noise by the blob's moments and 8°; not used if it is 30° or more, nor in the gates of association from straight
  above. Paper: one R, gates with θ. Why: a circle has no direction.
- noise of θ: 30° at birth, then 15° per root second, 90° from straight above. Paper: no values. Why: as above.
- lone blobs (`split`): once the size of a person is known, from a camera or from earlier lone blobs, a blob is a
  measurement only if it has that size, is not cut by the image's edge, and at most one confirmed track is expected in
  it. Paper: each blob. Why: others are not one whole person.
- shared blobs (`split`): in the rest templates share the foreground: each moves to the most support, confirmed tracks
  first; no gate. Paper: one measurement for each blob; event management, not printed. Why: people merge in the mask.
- size of templates (`split`): as predicted, 0.75 to 1.3 of a person's. Paper: none. Why: they measure none.
- looks (`split`): templates of confirmed tracks that touch move also to where the person's colours are seen, learned
  where nobody hides them. Paper: none. Why: people who meet in the mask must not change places.
- misses (`split`): too little foreground under the template. Paper: no blob in the gate. Why: templates always fit
  somewhere.
- noise of templates (`split`): R over the square of the visible share, at least 0.2; 25 times that for h, w; 25° for θ,
  which is not measured from straight above. Paper: R. Why: hidden parts are not measured, templates measure no size.
- births (`split`): also a lone blob inside a gate; other unexplained foreground, by templates. Paper: a blob outside
  all gates. Why: people enter as one blob.
- sizes (`split`): return to those of a person at that place. Paper: free. Why: templates measure none.
- ρ: of a nominal covariance without θ. Paper: of the filter. Why: noise must not count.
- report from pixels: boxes, by the median ratio of lone blobs' boxes to ellipses. Paper: ellipses. Why: scores need
  boxes.
- too much foreground (`background`): nobody is observed, and no track starts. Paper: none. Why: light has changed.
- background: adapts where no confirmed track is, foreground ten times as slowly, ghosts anywhere (`background`). Paper:
  trained once. Why: light changes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, cast

import numpy as np

from sim.types import Context, Detections, Frame, Plane, Tracks
from tracking.filters import kalman
from tracking.papers.blob import box_geometry
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.track_management import TrackedEllipses, TrackedPeople
from tracking.papers.blob.track_management_kernels import image_covariance
from tracking.papers.blob.update_from_boxes import BoxUpdater

if TYPE_CHECKING:
    from tracking.papers.blob.update_from_pixels import PixelUpdater


class Blob:
    """The tracker `blob`: people tracked from pixels if the context has a background sample, else from boxes.

    Made from a BlobConfig; None: the defaults. State: config, a BlobConfig, which may be replaced between two frames;
    people, the table of tracks; updater, which updates the table from boxes or from pixels; context, of the sequence.
    All but config exist after `reset` only.
    """

    needs: ClassVar[tuple[str, ...]] = ("pixels", "boxes")
    config_class: ClassVar[type[BlobConfig]] = BlobConfig

    def __init__(self, config: BlobConfig | None = None) -> None:
        self.config = config or BlobConfig()

    def reset(self, context: Context, seed: int) -> None:
        """Deletes all tracks and starts a sequence, from pixels if the context has a background sample, else boxes.

        Ids begin at 1 again. `seed` is not used. If the image's size is unknown, it is taken from the background
        sample. From pixels, raises InputError if the sample has a wrong shape or dtype, too few frames or shows no
        background, or if the scale px_per_m is zero or negative (nan: it is learned).
        """
        c = self.config
        if context.image_size is None and context.background is not None:
            context = context.replace(image_size=context.background.shape[2:0:-1])
        self.context = context
        dynamics = c.dynamics(context.fps)
        self.people: TrackedPeople
        self.updater: BoxUpdater | PixelUpdater
        if context.background is None:
            self.people = TrackedPeople(c, dynamics, context)
            self.updater = BoxUpdater(c, self.people)
        else:
            from tracking.papers.blob.update_from_pixels import PixelUpdater

            people = TrackedEllipses(c, dynamics, context)
            self.people, self.updater = people, PixelUpdater(c, people, context)

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Returns the tracks to report after a frame, unit "person", each `group` -1; updates all tracks.

        They are boxes in the image (plane "image", px). With a camera they are on the ground (plane "ground", m) with
        boxes, and a track above the horizon is left out. detections: used from boxes only; None is a frame without
        measurement. From pixels a frame without image, or with too much foreground, is one. If `config` was replaced
        since the last frame, all tracks go on with the new one.

        Raises InputError if the picture's size or dtype is not the background sample's, or if there are boxes and the
        scale px_per_m is unknown, zero or negative.
        """
        if self.config is not self.people.config:
            self.people.follow(self.config, self.config.dynamics(self.context.fps))
            self.updater.follow(self.config)
        self.updater.step(frame, detections)
        camera, every = self.context.camera, np.arange(len(self.people.id))
        if camera is not None:
            self.people.place_on_ground(camera, self.updater.reported_boxes(every))
        return self._report(frame)

    def _report(self, frame: Frame) -> Tracks:
        people = self.people
        rows = people.rows_to_report()
        state, scale = people.bank.take(rows, 1), people.scale[rows]
        box, alone = box_geometry.ltwh_from_centred(self.updater.reported_boxes(rows)), np.full(len(rows), -1)
        if self.context.camera is None:
            pos, vel = state[kalman.PLACE, :, :2].copy(), state[kalman.RATE, :, :2].copy()
            cov, plane = image_covariance(state, scale), "image"
        else:
            shown = np.isfinite(people.stand[rows]).all(1)
            rows, box, alone, plane = rows[shown], box[shown], alone[shown], "ground"
            pos, vel, cov = people.stand[rows, :2], people.stand[rows, 2:4], people.stand_cov[rows, :4, :4]
        id, score, seen = people.id[rows], people.score[rows], people.measured[rows]
        return Tracks(
            frame.index, frame.t, cast(Plane, plane), "person", id, alone, pos, vel, cov, box, score, seen=seen
        )
