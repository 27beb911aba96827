"""The user's options for a recording: what it does not state itself, and how it is read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from scenarios.errors import InputError
from scenarios.limits import PICTURE_SIDE
from sim.io.files.numeric_text import is_number_text
from sim.io.pictures.background_sample import BackgroundChoice
from sim.types import Camera

BoxScale = tuple[float, float]  # factors of x and y that make the boxes of a text pixels of the pictures


@dataclass(frozen=True)
class RecordingOptions:
    """The options of `open_source`, parsed; None: not given."""

    fps: float | None = None  # frames per second
    px_per_m: float | None = None  # image scale
    camera: Camera | None = None  # its calibration
    images: bool = True  # False leaves out the pictures of MOTChallenge folders
    background: BackgroundChoice | None = None  # which frames are the sample for background models
    person_class: int | None = None  # the class of people in MOTChallenge texts
    box_scale: BoxScale | None = None  # factors of x and y of the boxes of these
    min_score: float | None = None  # least score of their detections, as it stands there

    @property
    def scale(self) -> float:
        """The image scale, px per m; nan if not given."""
        return float("nan") if self.px_per_m is None else self.px_per_m

    def reject(self, path: Path, kind: str, why: str, names: str) -> None:
        """Raises InputError if any of the options `names` ("camera fps") is given: `why` says why it has no effect."""
        found = [name for name in names.split() if getattr(self, name) is not None]
        given = [f"--{name.removeprefix('person_').replace('_', '-')}" for name in found]
        if given:
            remedy = f"leave {'it' if len(given) == 1 else 'them'} out: {why}"
            raise InputError(file=path, got=" and ".join(given), expected=f"none for {kind}", remedy=remedy)


NO_OPTIONS = RecordingOptions()


def parse_box_scale(text: str) -> BoxScale:
    """Returns the factors of x and y that a text such as "2" or "1920,1080" names."""
    cells = text.split(",")
    factors = [float(cell) if is_number_text(cell) else float("nan") for cell in cells]
    if len(cells) > 2 or not all(0 < f <= PICTURE_SIDE for f in factors):
        raise InputError(
            place="--box-scale", got=repr(text), expected=f"X or X,Y, above 0, at most {PICTURE_SIDE}",
            remedy="give pixels of the picture per unit of the boxes",
        )  # fmt: skip
    return factors[0], factors[-1]
