"""Strict reader for MOTChallenge text: gt.txt and det.txt of a folder, and single texts as Sequences (`open_text`).

Lines have 6 to 10 columns, the first of which are frame (from 1), id, and the box's left, top, width, height in px.
Column 7 is a confidence or flag. 8 or 9 columns go on with class and visibility (from MOT16 on), 10 columns with the
ground position x, y, z in m, unknown where z is -1 (MOT15). Lines of 4 columns are no MOTChallenge text: they are
frame, id and the ground position x, y in m. A wrong line raises InputError that names it.

Decides which rows of a MOTChallenge text are people, which are distractors, and if it has ground positions.

People are told by class (column 8) and flag (column 7). A distractor looks like a person: people on vehicles (class 2),
static people (7), other distractors (8), reflections (12), and in MOT20 vehicles without a motor (6). The benchmark
leaves a track on a distractor out of the scores. Which tracks lie on distractors follows from a matching with all
labelled rows, so the other unscored rows are kept, too. Columns 8 to 10 are ground positions if people in them move as
people; other programs write categories, occlusion flags, zeros or pixels there.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, reject
from scenarios.reading import is_present
from sim.arrays import repeated_ids
from sim.geometry.boxes import centres
from sim.scene.camera import scale_of_all_boxes
from sim.store.numeric_text import LARGEST
from sim.store.recorded_sequence import recorded_sequence
from sim.truth.velocities import chords, differentiate
from sim.types import Array, Bools, Detections, Ints, Plane, Sequence, Truth, Unscored
from tracking.recordings.biwi import labels_of
from tracking.recordings.labelled_truth import warn_of_places, with_labels
from tracking.recordings.mot_table import GROUND_COLUMNS, PEOPLE, MotTable, corner_doubt, read_table, require_pixels
from tracking.recordings.options import NO_OPTIONS, RATES, BoxOptions, Classes, RecordingOptions
from tracking.recordings.worded_cells import SHOWN, usual_step

# step in m from one frame to the next that nobody makes. The frame rate may be wrong, so speeds decide nothing.
LONGEST = 12.0

ENOUGH = 10  # rows or steps that are needed to judge by how many of them something is true

# share of rows at the position of another row of their frame, above which these are no positions of people
SHARED = 0.1

MOVED = 0.5  # A box that moves by more than this share of its height belongs to somebody who does not stand

# files beside a text, or in the folder above it, that vouch for positions in m
VOUCHERS = ("manifest.json", "camera.json", "run.json")


FAST = 12.0  # m/s that nobody keeps up. Half of the steps above it are centimetres, or a wrong frame rate.


def ground_positions(table: MotTable) -> Array | None:
    """Returns the ground positions x, y, z in m, (N, 3), nan where unknown (z = -1); None if there are none.

    None, with a warning, if columns 8 to 10 cannot be people's places in m (they jump, are shared, hold few whole
    numbers, lie in the own boxes, or stay while boxes move), and no manifest.json, camera.json or run.json beside the
    text or one folder up says that they are. None without a warning if all rows are equal.
    """
    known, doubt = _known(table)
    if doubt:
        text = f"{table.rows.file}: columns 8 to 10 are not taken as metres: {doubt}; the boxes are used"
        warnings.warn(text, stacklevel=3)
    return None if known is None else np.where(known[:, None], table.rest[:, 1:4], np.nan)


def _known(table: MotTable) -> tuple[Bools | None, str]:
    """Returns which rows have a ground position (N,), None if none is one, and what speaks against metres."""
    known = np.asarray(table.rest[:, 3] != -1) if table.rest.shape[1] > 3 else np.zeros(0, bool)
    if not known.any():
        return None, ""
    if table.on_ground or _vouched(table):
        return known, ""
    xyz, alone = table.rest[:, 1:4], len(known) == len(np.unique(table.frame))
    # All rows equal: a category, or a value that stands for "unknown".
    if len(known) > 1 and (xyz == xyz[0]).all() and (not alone or (xyz == np.round(xyz)).all()):
        return None, ""
    doubt = _doubt(table, known)
    return (None, doubt) if doubt else (known, "")


def require_metres(table: MotTable, fps: float) -> None:
    """Raises InputError if a text has only positions, and people would move impossibly fast if these were metres."""
    if not table.on_ground or _vouched(table):
        return
    steps = first, second = _steps(table.frame, table.id)
    speed = _pace(table.rest[:, 1:3], table.frame, *steps) * fps
    if len(speed) >= ENOUGH and np.median(speed) > FAST and (table.frame[first] < table.frame[second]).all():
        # positions that err look fast from frame to frame, and are not over 0.5 s
        known = table.id >= 0
        speed = np.hypot(*chords(table.frame[known], table.id[known], table.rest[known, 1:3], fps).T)
        speed = speed[np.isfinite(speed)]
    if len(speed) >= ENOUGH and np.median(speed) > FAST:
        raise InputError(
            file=table.rows.file, place="columns x, y", got=f"half of the steps faster than {np.median(speed):.3g} m/s",
            expected="positions in m", remedy="if they are in cm, mm or px, name them x_cm,y_cm, x_mm,y_mm or x_px,y_px"
            " (with --px-per-m) in the first line, as frame,id,x_cm,y_cm (in a text of PedPy in its comment, as "
            f"# id frame x/cm y/cm z/cm); else correct --fps, here {fps:g}",
        )  # fmt: skip


def _vouched(table: MotTable) -> bool:
    file = table.rows.file
    return any(is_present(folder / name) for folder in (file.parent, file.parent.parent) for name in VOUCHERS)


def _doubt(table: MotTable, known: Bools) -> str:
    rows = np.flatnonzero(known)
    xy, frame, id = table.rest[rows, 1:3], table.frame[rows], table.id[rows]
    places, count = np.unique(np.c_[frame, xy], axis=0, return_counts=True)
    if count[count > 1].sum() > SHARED * len(rows):
        return "people of one frame have the same position"
    if len(rows) > 3 and (xy == np.round(xy)).all() and 2 * len(np.unique(xy, axis=0)) <= len(places):
        return "they hold few whole numbers, as categories or flags do"
    inside = ((xy >= table.box[rows, :2]) & (xy <= table.box[rows, :2] + table.box[rows, 2:])).all(axis=1)
    if len(rows) >= ENOUGH and inside.mean() > 0.5:
        return "most lie inside their own boxes, as pixels do"
    first, second = _steps(frame, id)
    if not len(first):
        return ""
    if _stand_while_boxes_move(table.box[rows], id, first, second, np.hypot(*(xy[second] - xy[first]).T)):
        return "they stay the same while the boxes move"
    pace = _pace(xy, frame, first, second)
    if len(pace) >= ENOUGH and np.quantile(pace, 0.75) > LONGEST:
        return f"a quarter of the steps are longer than {LONGEST:g} m per frame"
    return ""


def _steps(frame: Ints, id: Ints) -> tuple[Ints, Ints]:
    order = np.lexsort((frame, id))
    order = order[id[order] >= 0]
    pairs = np.flatnonzero(np.diff(id[order]) == 0)
    return order[pairs], order[pairs + 1]


def _pace(xy: Array, frame: Ints, first: Ints, second: Ints) -> Array:
    return np.asarray(np.hypot(*(xy[second] - xy[first]).T) / np.maximum(frame[second] - frame[first], 1))


def _stand_while_boxes_move(box: Array, id: Ints, first: Ints, second: Ints, step: Array) -> bool:
    people, who = np.unique(id[first], return_inverse=True)
    centre = box[:, :2] + box[:, 2:] / 2
    way = np.bincount(who, np.hypot(*(centre[second] - centre[first]).T))
    height = np.bincount(who, box[first, 3]) / np.bincount(who)
    moves = way > MOVED * height
    stands = np.bincount(who, step > 0, minlength=len(people)) == 0
    return bool(moves.any() and (moves & stands).sum() > moves.sum() / 2)


DISTRACTORS = (2, 7, 8, 12)  # classes of distractors from MOT16 on

MOT20 = "MOT20"  # begins the names of MOT20's sequences

MOT20_DISTRACTORS = (*DISTRACTORS, 6)

# columns after the box in labels of MOTChallenge: flag, class, visibility. More columns have other classes.
LABEL_COLUMNS = 3

CLASSES = range(1, 14)  # classes of MOTChallenge. A text with another class has classes of its own, and no distractors.


def unscored_rows(table: MotTable, people: Bools, name: str, person_class: Classes | None) -> Unscored | None:
    """Returns the labelled rows with a box where the flags people (N,) are False, sorted by frame; None without any."""
    found = classes_of(table, person_class is not None)
    # 0 is no class of MOTChallenge's labels, but people in the texts of many trackers: --class 0,1 is for both.
    usual = {*(person_class or PEDESTRIANS)} - {"0"} == {*PEDESTRIANS} and not table.rows.classes
    usual = usual and table.rest.shape[1] <= LABEL_COLUMNS
    distractor = np.zeros_like(people)
    if found is not None and usual and np.isin(found, CLASSES).all():
        mot20 = any(each.startswith(MOT20) for each in (name, table.rows.file.resolve().parent.parent.name))
        distractor = np.isin(found, MOT20_DISTRACTORS if mot20 else DISTRACTORS)
    rows = np.flatnonzero(~people & (table.id >= 0) & ~table.without_box())
    if not len(rows):
        return None
    rows = rows[np.argsort(table.frame[rows], kind="stable")]
    return Unscored(table.frame[rows], table.box[rows], distractor[rows])


PEDESTRIANS = ("1",)  # classes of people from MOT16 on

LABELS = "gt.txt"  # name of a text of labels. Its column 7 is a flag; that of another text may be a confidence.

LAST_CLASS = 100  # greatest class of the usual sets of classes; COCO has up to 91


def labelled_people(table: MotTable, person_class: Classes | None) -> Bools:
    """Returns flags (N,) of rows that are people: an id from 0, another flag than 0, the right class.

    person_class: the classes of people; None: 1, or PEOPLE if classes are words, with a warning about other classes.
    """
    keep, file = np.asarray(table.id >= 0), table.rows.file
    got = f"negative ids in all {len(keep)} rows"
    reject(len(keep) and not keep.any(), file, got, "ids from 0", "give each person an id", "column 2")
    flag = table.scores()
    # Column 7 of another text may be a confidence.
    if file.name == LABELS or (np.isin(flag, (0, 1, -1)).all() and flag.any()):
        keep &= flag != 0
        got, remedy = f"0 in all {len(keep)} rows, which leaves nobody", "write 1 in column 7 of rows that count"
        reject(len(keep) and not keep.any(), file, got, "another flag than 0 for people", remedy, "column 7")
    return of_class(table, keep, person_class)


def require_classes(table: MotTable, person_class: Classes | None) -> None:
    """Raises InputError if `person_class` is given but the text has no classes."""
    if person_class is not None and classes_of(table, True) is None:
        got, expected = "no classes", "a column class, or classes in column 8"
        raise InputError(file=table.rows.file, place="--class", got=got, expected=expected, remedy="leave --class out")


def of_class(table: MotTable, keep: Bools, person_class: Classes | None) -> Bools:
    """Returns flags (N,): `keep`, but False for rows whose class is not that of people. See `labelled_people`."""
    found, file = classes_of(table, person_class is not None), table.rows.file
    if found is None or not keep.any():
        return keep
    words = table.rows.classes
    wanted = person_class or (PEOPLE if words else PEDESTRIANS)
    values, row = np.unique(found, return_inverse=True)
    name = [words[int(v)] if words else f"{v:.12g}" for v in values]
    people: Bools = keep & np.isin(name, wanted)[row]
    counts = np.bincount(row[keep & ~people], minlength=len(name))
    others = [f"{n} rows of class {each}" for each, n in zip(name, counts, strict=True) if n]
    said, people_are = ", ".join(others[:SHOWN]) + ", …" * (len(others) > SHOWN), " or ".join(wanted)
    remedy = "name the classes of people with --class, those of labels and tracks, as 0,1"
    reject(not people.any(), file, said, f"people, of class {people_are}", remedy, "classes")
    if others and person_class is None:
        text = f"{file}: {said} are left out; people are class {people_are} (--class says otherwise)"
        warnings.warn(text, stacklevel=3)
    return people


def classes_of(table: MotTable, named: bool) -> Array | None:
    """Returns column 8 (N,) if it holds classes, else None. named: True if the user gave --class."""
    if table.on_ground:
        return table.rows.values[:, 4] if table.rows.values.shape[1] > GROUND_COLUMNS else None
    if table.rest.shape[1] == 1:
        _reject_categories(table)
    if table.rest.shape[1] < 2 or (table.rest[:, 1] == -1).all():
        return None
    column = table.rest[:, 1]
    if table.rest.shape[1] < 4:
        table.rows.reject(column != np.round(column), "a whole number as class in column 8", "name the columns")
        return column
    whole = (column >= 0).all() and (column == np.round(column)).all()
    # If columns 8 to 10 are no metres, column 8 may be a category, as in VisDrone.
    return column if whole and (named or (table.rest[:, 3] == -1).all() or _one_for_each(table, column)) else None


def _reject_categories(table: MotTable) -> None:
    """Raises InputError if column 7 of 7 seems to hold classes: a few whole numbers, one for each id."""
    column, id = table.rest[:, 0], table.id
    values = np.unique(column)
    few = 2 <= len(values) <= SHOWN and ENOUGH * len(values) <= len(column) and (values == np.round(values)).all()
    one = (id < 0).all() or len(np.unique(np.c_[id, column], axis=0)) == len(np.unique(id))
    if few and one and values[0] >= 0 and 2 <= values[-1] <= LAST_CLASS:
        got, file = f"{', '.join(f'{v:g}' for v in values)}, as classes have", table.rows.file
        expected = "a confidence, or a flag 0 or 1"
        remedy = "name the columns in the first line: frame,id,left,top,width,height,class (…,score if it is one)"
        raise InputError(file=file, place="column 7", got=got, expected=expected, remedy=remedy)


def _one_for_each(table: MotTable, column: Array) -> bool:
    highest = column.max(initial=0)
    if (table.id < 0).any() or not 2 <= highest <= LAST_CLASS or _known(table)[0] is not None:
        return False
    order = np.lexsort((column, table.id))
    same = np.diff(table.id[order]) == 0
    return bool(same.any() and not np.diff(column[order])[same].any())


FEW = 0.02  # share of scores outside [0, 1] up to which they count as outliers of scores in [0, 1]


def unit_scores(score: Array) -> tuple[Array, str]:
    """Returns scores (N,), finite numbers, mapped into [0, 1], and words that say how; "" if nothing was changed.

    If only a few scores are outside [0, 1], these are clipped. If many are, each score s becomes 1 / (1 + exp(-(s - c)
    / d)), with c the lower quartile and d such that the median becomes about 0.75. Equal scores outside become 1.
    """
    outside = (score < 0) | (score > 1)
    count = int(outside.sum())
    if not count:
        return score, ""
    if (score == score[0]).all():
        return np.ones_like(score), ""
    if count <= max(FEW * len(score), 1):
        return np.clip(score, 0, 1), f"{count} of {len(score)} scores outside 0 to 1 are clipped"
    quarter, median = np.quantile(score, (0.25, 0.5))
    # A det.txt holds what its detector takes for people, so that most boxes must be able to start a track.
    # Rounded, so that a few more scores seldom move them.
    c, d = float(f"{quarter:.2g}"), float(f"{(median - quarter) / np.log(3) or 1.0:.1g}")
    mapped = 1 / (1 + np.exp(-np.clip((score - c) / d, -500, 500)))
    span = f"scores from {score.min():g} to {score.max():g}"
    return mapped, f"{span} are mapped into 0 to 1 by 1 / (1 + exp(-(score - {c:g}) / {d:g}))"


# remedy if most rows have the id of another row of their frame
NO_ID = "check that column 2 is the id: name the columns in the first line, as frame,left,top,width,height,score"


def reject_duplicate_ids(table: MotTable, keep: Bools) -> None:
    """Raises InputError if an id from 0 is in two rows of one frame. keep (N,): flags of the rows examined."""
    counted = np.flatnonzero(keep & (table.id >= 0))
    again = np.zeros(len(table.frame), bool)
    again[counted] = repeated_ids(table.frame[counted], table.id[counted])
    table.rows.reject(again, "each id once in a frame", "remove one of the two lines", NO_ID)


@dataclass(frozen=True)
class DetectionTable:
    """The content of a det.txt, N rows sorted by frame, those of a frame in the order of the file."""

    frame: Ints  # (N,) from 1
    plane: Plane  # "ground" (pos in m) or "image" (pos in px)
    pos: Array  # (N, 2) x, y on the ground, or the box's centre
    box: Array | None  # (N, 4) left, top, width, height in px, None if any row has none
    score: Array  # (N,) in [0, 1]

    def at(self, index: int, fps: float) -> Detections:
        """Returns the detections of frame `index` (from 1) at the time (index - 1) / fps s."""
        low, high = np.searchsorted(self.frame, (index, index + 1))
        box = None if self.box is None else self.box[low:high]
        return Detections(index, (index - 1) / fps, self.plane, self.pos[low:high], None, box, self.score[low:high])


def detections_of_table(table: MotTable, options: BoxOptions) -> DetectionTable:
    """Returns a table as detections: on the ground (m) if every row has a position, else the boxes' centres (px)."""
    ground, boxless = _places(table)
    path, rows = table.rows.file, np.argsort(table.frame, kind="stable")
    rows = rows[of_class(table, np.ones(len(rows), bool), options.person_class)[rows]]
    raw = table.scores()[rows]
    score, mapped = unit_scores(raw)
    if mapped:
        warnings.warn(f"{path}: {mapped}", stacklevel=3)
    plane: Plane = "image" if ground is None or np.isnan(ground).any() else "ground"
    pos = ground[:, :2] if plane == "ground" and ground is not None else centres(table.box)
    good = raw >= (-np.inf if options.min_score is None else options.min_score)
    if len(raw) and not good.any():
        got, expected = options.min_score, f"at most {raw.max():g}, the greatest score"
        raise InputError(file=path, place="--min-score", got=got, expected=expected, remedy="lower it")
    rows, score = rows[good], score[good]
    return DetectionTable(table.frame[rows], plane, pos[rows], None if boxless.any() else table.box[rows], score)


def _places(table: MotTable) -> tuple[Array | None, Bools]:
    """Returns the ground positions as `ground_positions` does, and which rows have no box: (N,)."""
    require_pixels(table.rows, table.boxes())
    doubt = corner_doubt(table.boxes())
    if doubt:
        warnings.warn(f"{table.rows.file}: {doubt}", stacklevel=3)
    ground, boxless = ground_positions(table), table.without_box()
    if ground is None or np.isnan(ground).any():
        table.rows.reject(boxless, "a box, or x, y, z in every line", "give each line a box or a ground position")
    return ground, boxless


def truth_of_table(
    table: MotTable, name: str, fps: float, length: int | None = None, px_per_m: float = float("nan"),
    person_class: Classes | None = None,
) -> Truth:  # fmt: skip
    """Returns the table of a gt.txt as truth of people, as MOTChallenge's own scoring counts them.

    length: None: up to the last frame kept. px_per_m: nan: the boxes' median height / 1.7 m. Boxes are None if a row
    has none. Positions and velocities are None if no row has a position, else nan in rows without. Groups are those of
    a column `group`, or of a file: groups.txt beside gt.txt, NAME.groups.txt beside any other NAME.txt.
    """
    require_metres(table, fps)
    ground, boxless = _places(table)
    boxed = not boxless.any()
    # Rows that do not count must be valid all the same.
    keep = labelled_people(table, person_class)
    reject_duplicate_ids(table, keep)
    order = np.flatnonzero(keep)
    order = order[np.lexsort((table.id[order], table.frame[order]))]
    frame, id, box = table.frame[order], table.id[order], table.box[order]
    visibility = np.ones(len(order))
    # MOT16 and later: flag, class, visibility.
    if table.rest.shape[1] == 3:
        v = table.rest[:, 2]
        table.rows.reject((v > 1) | ((v < 0) & (v != -1)), "visibility from 0 to 1, or -1", "correct the last column")
        visibility = np.where(v[order] < 0, 1.0, v[order])
    pos = None if ground is None else ground[order, :2]
    vel = None if pos is None else differentiate(frame, id, pos, fps)
    if not np.isfinite(px_per_m) and boxed:
        px_per_m = scale_of_all_boxes(box[:, 3])
    frames = length if length is not None else int(frame.max(initial=0))
    truth = Truth(
        name=name, fps=fps, length=frames, px_per_m=px_per_m, frame=frame, id=id,
        group=np.full(len(order), -1, np.int64), pos=pos, vel=vel, box=box if boxed else None, visibility=visibility,
        z=None if ground is None else ground[order, 2], labelled=np.zeros(frames, bool),
        unscored=unscored_rows(table, keep, name, person_class) if boxed else None,
    )  # fmt: skip
    warn_of_places(table.rows.file, truth)
    if table.group is not None:
        return with_labels(truth, table.group[order])
    path = table.rows.file
    path = path.with_name("groups.txt" if path.name == LABELS else f"{path.stem}.groups.txt")
    return with_labels(truth, labels_of(path, id)) if is_present(path) else truth


FPS = 25.0


def frame_rate(given: float | None, found: float | None, what: str = "MOTChallenge data", usual: float = FPS) -> float:
    """Returns the first of `given` (--fps) and `found` (in the recording) that is not None; else `usual`, and warns."""
    if given is None and found is None:
        # The text names no path, so that a command over many recordings prints it once.
        warnings.warn(f"{what} without a frame rate: taken at {usual:g} fps (--fps says otherwise)", stacklevel=3)
    return given or found or usual


def rate_of_times(path: Path, seconds: Array, id: Array) -> float:
    """Returns the frames per second at which times (N,) of one id (N,) follow each other, where none is missing."""
    step = usual_step(seconds, id)
    rate = 1 / step if step else 1.0
    expected = "{:g} to {:g} times per second".format(*RATES)
    remedy = "correct the unit in the name of the column (t_s, t_ms, t_us, t_ns), or give --fps"
    reject(not RATES[0] <= rate <= RATES[1], path, f"{rate:.3g} per second", expected, remedy, "times")
    return round(float(rate), 3)


def frames_of_times(seconds: Array, begin: float, fps: float) -> Ints:
    """Returns the nearest frames (N,) of times (N,); begin: time of frame 1. Both in s."""
    return np.asarray(np.clip(np.round((seconds - begin) * fps) + 1, -LARGEST, LARGEST), np.int64)


def open_text(path: Path, options: RecordingOptions = NO_OPTIONS) -> Sequence:
    """Returns a MOT text as Sequence without pictures: detections if every id is -1, else truth.

    `options.camera` becomes its camera, unchanged.
    """
    of_boxes, fps, begin = options.box_options, options.fps, 0.0

    def frames_at(seconds: Array, id: Array) -> Ints:
        nonlocal fps, begin
        fps, begin = fps or rate_of_times(path, seconds, id), float(seconds.min(initial=np.inf))
        return frames_of_times(seconds, begin, fps)

    table = read_table(path, box_scale=of_boxes.box_scale, frames_at=frames_at, px_per_m=options.px_per_m)
    rate = frame_rate(fps, None)
    reject(not len(table.frame), path, "no row", "people or detections", "check the file")
    length = int(table.frame.max())

    require_classes(table, of_boxes.person_class)
    if (table.id == -1).all():
        more: dict[str, Any] = {"detections": partial(detections_of_table(table, of_boxes).at, fps=rate)}
    else:
        options.reject(path, "a text of people with ids", "it is for detections", "min_score")
        known = (path.stem, rate, length, options.scale, of_boxes.person_class)
        more = {"load_truth": partial(truth_of_table, table, *known)}
    source = {"kind": "mot text", "path": str(path), "begin": begin, **of_boxes.given()}
    if table.rows.names:
        source["ids"] = dict(table.rows.names)
    return recorded_sequence(source, path.stem, rate, length, px_per_m=options.scale, camera=options.camera, **more)
