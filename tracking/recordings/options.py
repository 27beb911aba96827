"""The user's options for a recording: what it does not state itself, and how it is read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.errors import reject
from scenarios.limits import PICTURE_SIDE
from sim.pictures.background_sample import BackgroundChoice
from sim.store.numeric_text import number_or_nan
from sim.types import Camera

Classes = tuple[str, ...]  # words, in lower case, or numbers as words
RATES = (0.1, 300.0)  # plausible frames/s of a recording whose times are known
BoxScale = tuple[float, float]  # factors of x and y that make the boxes of a text pixels of the pictures


@dataclass(frozen=True)
class BoxOptions:
    """How the boxes of a MOTChallenge text are read; an option that is not given is None."""

    person_class: Classes | None = None  # the classes of people
    box_scale: BoxScale | None = None  # factors of x and y
    min_score: float | None = None  # least score of detections, as it stands there

    def given(self) -> dict[str, Any]:
        """Returns the values of the options that are given, by name: "class", "box_scale", "min_score"."""
        return {key.removeprefix("person_"): value for key, value in vars(self).items() if value is not None}


@dataclass(frozen=True)
class RecordingOptions:
    """The options of `open_source`, parsed; an option that is not given is None."""

    fps: float | None = None  # frames per second
    px_per_m: float | None = None  # image scale
    camera: Camera | None = None  # its calibration
    images: bool = True  # False leaves out the pictures of MOTChallenge folders
    background: BackgroundChoice | None = None  # which frames are the sample for background models
    box_options: BoxOptions = BoxOptions()  # of MOTChallenge texts

    @property
    def scale(self) -> float:
        """The image scale, px per m; nan if not given."""
        return float("nan") if self.px_per_m is None else self.px_per_m

    def reject(self, path: Path, kind: str, why: str, names: str) -> None:
        """Calls `refuse_options` with these options; "box_options" in `names` stands for all fields of BoxOptions."""
        values = {**vars(self), **vars(self.box_options)}
        refuse_options(values, names.replace("box_options", " ".join(vars(self.box_options))), path, kind, why)


def refuse_options(values: Mapping[str, Any], names: str, path: Path, kind: str, why: str) -> None:
    """Raises InputError if an option in `names` ("camera fps") is given, because it has no effect on a `kind`."""
    found = [name for name in names.split() if values[name] is not None and values[name] is not False]
    given = [f"--{name.removeprefix('person_').replace('_', '-')}" for name in found]
    remedy = f"leave {'it' if len(given) == 1 else 'them'} out: {why}"
    reject(given, path, " and ".join(given), f"none for {kind}", remedy)


NO_OPTIONS = RecordingOptions()


def parse_box_scale(text: str) -> BoxScale:
    """Returns the factors of x and y in a text such as "2" (both) or "1920,1080"; raises InputError for other texts."""
    factors = list(map(number_or_nan, text.split(",")))
    wrong = len(factors) > 2 or not all(0 < f <= PICTURE_SIDE for f in factors)
    expected, remedy = f"X or X,Y, above 0, at most {PICTURE_SIDE}", "give pixels of the picture per unit of the boxes"
    reject(wrong, "", repr(text), expected, remedy, "--box-scale")
    return factors[0], factors[-1]


def parse_classes(given: int | str) -> Classes:
    """Returns the classes in a number or a text such as "1,2" or "person", as lower-case texts; else InputError."""
    classes = tuple(cell.strip().lower() for cell in str(given).split(","))
    expected = "classes apart by commas, as 1,2 or person"
    reject(not all(classes), "", repr(given), expected, "correct it", "--class")
    return classes
