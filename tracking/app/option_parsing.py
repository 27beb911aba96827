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
        expected = "a:b (from a to b - 1) or one seed, in digits 0 to 9"
        raise InputError(place=option, got=repr(text), expected=expected, remedy="write 0:10 or 7")
    first = int(found[1])
    return range(first, first + 1 if found[2] is None else int(found[2]))


def settings(texts: Iterable[str], default: str, subjects: tuple[str, ...]) -> list[tuple[str, str]]:
    """Splits `--set` texts "subject.key=value" into pairs (subject, "key=value"), in the order given. default: subject
    of a text without one of `subjects`. Raises InputError for a wrong text or a key that is given twice."""
    found: dict[tuple[str, str], str] = {}
    for text in texts:
        subject, key, value = _setting(text, default, subjects)
        if (subject, key) in found:
            name, got = key if subject == default else f"{subject}.{key}", f"{found[subject, key]} and {value}"
            raise InputError(
                place=f"--set {name}", got=f"it twice: {got}", expected="one value", remedy="leave one out"
            )
        found[subject, key] = value
    return [(subject, f"{key}={value}") for (subject, key), value in found.items()]


def _setting(text: str, default: str, subjects: tuple[str, ...]) -> tuple[str, str, str]:
    """Returns subject, key and value of one `--set` text."""
    name, equals, value = text.partition("=")
    name, expected, remedy = name.strip(), "key=value", f"write --set {default}.key=value"
    subject, dot, key = name.partition(".")
    own = dot and subject in SUBJECTS
    got = repr(text) if not equals or not name else ""
    if not got and dot and not own and default == "tracker" and "scenario" in subjects:
        got, expected = repr(name), "a parameter of the tracker, sensor.… or scenario.…"
        remedy = f"write --set scenario.{text}"
    if not got and own and subject not in subjects:
        got, expected = f"a setting of the {subject}", "a setting of the " + " or the ".join(subjects)
        remedy = f"set it in the command that makes the {subject}"
    if got:
        raise InputError(place=f"--set {text}", got=got, expected=expected, remedy=remedy)
    return (subject, key, value) if own else (default, name, value)


def scenario_settings(texts: Iterable[str]) -> list[str]:
    """Returns `--set` texts of a command on scenarios as "key=value" in the order given, without "scenario."."""
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
    """Returns texts "key=value" as a dictionary from key to the TOML value; of equal keys the last counts."""
    from scenarios.loading.toml_files import parse_setting

    return {".".join(steps): value for steps, value in map(parse_setting, texts)}


def check_output_folder(out: Path) -> None:
    """Raises InputError unless `out` is, or can become, a folder."""
    existing = next(p for p in (out, *out.parents) if p.exists())
    if not existing.is_dir():
        expected, remedy = "a folder, existing or new", "choose another --out"
        raise InputError(file=existing, place="--out", got="a file", expected=expected, remedy=remedy)
