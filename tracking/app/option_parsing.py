"""Parses the texts of options: `--seeds a:b`, `--streams a,b`, `--set key=value`, `--sensor`, and checks `--out`."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from scenarios.errors import InputError

SUBJECTS = ("tracker", "sensor", "scenario")  # What a setting can belong to, as in `--set sensor.noise_m=0.2`.


def seeds(text: str, option: str = "--seeds") -> range:
    """Returns the seeds of the text "a:b", a to b - 1 (empty if b <= a), or of one number, a range of length 1."""
    found = re.fullmatch(r"([0-9]{1,18})(?::([0-9]{1,18}))?", text.strip())
    if found is None:
        raise InputError(
            place=option,
            got=repr(text),
            expected="a:b (from a to b - 1) or one seed, in digits 0 to 9",
            remedy="write 0:10 or 7",
        )
    first = int(found[1])
    return range(first, first + 1 if found[2] is None else int(found[2]))


def settings(texts: Iterable[str], default: str, subjects: Iterable[str]) -> list[tuple[str, str]]:
    """Splits `--set` texts into pairs (subject, "key=value"), in the order given."""
    found = [_setting(text, default, tuple(subjects)) for text in texts]
    _refuse_repeated(found, default)
    return found


def _refuse_repeated(settings: list[tuple[str, str]], default: str) -> None:
    earlier: dict[tuple[str, str], str] = {}
    for subject, text in settings:
        key, _, value = text.partition("=")
        name = key if subject == default else f"{subject}.{key}"
        if (subject, key) in earlier:
            raise InputError(
                place=f"--set {name}", got=f"it twice: {earlier[subject, key]} and {value}", expected="one value",
                remedy="leave one out",
            )  # fmt: skip
        earlier[subject, key] = value


def _setting(text: str, default: str, subjects: tuple[str, ...]) -> tuple[str, str]:
    """Returns (subject, "key=value") of one `--set` text."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise InputError(
            place=f"--set {text}", got=repr(text), expected="key=value", remedy=f"write --set {default}.key=value"
        )
    subject, dot, rest = key.strip().partition(".")
    if not dot or subject not in SUBJECTS:
        if dot and default == "tracker" and "scenario" in subjects:
            raise InputError(
                place=f"--set {text}", got=repr(key), expected="a parameter of the tracker, sensor.… or scenario.…",
                remedy=f"write --set scenario.{text}",
            )  # fmt: skip
        subject, rest = default, key.strip()
    if subject not in subjects:
        raise InputError(
            place=f"--set {text}",
            got=f"a setting of the {subject}",
            expected="a setting of the " + " or the ".join(subjects),
            remedy=f"set it in the command that makes the {subject}",
        )
    return subject, f"{rest}={value}"


def scenario_settings(texts: Iterable[str]) -> list[str]:
    """Returns `--set` texts of a command on scenarios as "key=value", in the order given."""
    found = settings(texts, "scenario", ("scenario", "sensor"))
    return [f"sensor.{text}" if subject == "sensor" else text for subject, text in found]


def sensor_settings(file: Path | None) -> tuple[str, ...]:
    """Returns the texts "sensor.key=value" of the file of `--sensor`, a detector profile in TOML; () for None."""
    if file is None:
        return ()
    from scenarios import sensor_settings

    return sensor_settings(file)


def pictures(streams: str, images: str | None) -> tuple[tuple[str, ...], str]:
    """Returns (names of the streams, picture format) from the texts of `--streams` and `--images`."""
    from sim.streams import coding

    words = () if streams.strip() == "none" else tuple(word.strip() for word in streams.split(",") if word.strip())
    if images is not None and coding(words, images) is None:
        got, remedy = f"{images} with --streams {streams}", "leave --images out: ids and disparity are always png"
        raise InputError(place="--images", got=got, expected="left, right or background", remedy=remedy)
    return words, images or "jpg"


def toml_values(texts: Iterable[str]) -> dict[str, Any]:
    """Returns texts "key=value" as a dictionary from key to value; of equal keys the last counts."""
    from scenarios.loading.toml_files import parse_setting

    return {".".join(steps): value for steps, value in map(parse_setting, texts)}


def output_file(out: Path, suffix: str, option: str = "--out") -> Path:
    """Returns `out` if it is a file name with this suffix; else raises InputError."""
    is_folder = out.is_dir()
    if is_folder or out.suffix.lower() != suffix:
        got, better = (f"{out}, a folder", out / "page") if is_folder else (str(out), out.with_suffix(""))
        remedy = f"write {better}{suffix}"
        raise InputError(place=option, got=got, expected=f"a file that ends in {suffix}", remedy=remedy)
    return out


def output_folder(out: Path) -> Path:
    """Returns `out` if it is, or can become, a folder; else raises InputError."""
    existing = next(p for p in (out, *out.parents) if p.exists())
    if not existing.is_dir():
        raise InputError(
            file=existing, place="--out", got="a file", expected="a folder, existing or new",
            remedy="choose another --out",
        )  # fmt: skip
    return out
