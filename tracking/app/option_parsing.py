"""Parses the texts of options: `--seeds a:b`, `--streams a,b`, `--set key=value`, `--sensor`, and checks `--out`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
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


def split_label(text: str) -> tuple[str, str]:
    """Returns label and rest of a run or tracker "LABEL=rest"; the label is "" if the text has none.

    A text that is a path, or a class of a file ("path.py:Class"), has no label: what exists comes first. Nor has a text
    with a slash before its "=". Raises InputError for an empty label or rest, or a label whose first word is oracle.
    """
    label, equals, rest = text.partition("=")
    exists = Path(text).exists() or (".py:" in text and Path(text.rpartition(":")[0]).exists())
    if exists or not equals or "/" in label:
        return "", text
    if not label.strip() or not rest or label.split()[0] == "oracle":
        expected = "LABEL=RUN, with a label that is not the oracle's"
        raise InputError(place="label", got=repr(text), expected=expected, remedy="write mine=FOLDER, or leave it out")
    return label, rest


def labelled(texts: Iterable[str], short: Callable[[str], str] = str) -> dict[str, str]:
    """Returns runs or trackers by name, as {name: text without its label}. The name is the label, else what `short`
    makes of the text; the text itself where several are equal. Raises InputError if a name is given twice."""
    parts = [split_label(text) for text in texts]
    names = [label or short(rest) for label, rest in parts]
    names = [n if label or (n and names.count(n) == 1) else rest for n, (label, rest) in zip(names, parts, strict=True)]
    if twice := [name for name in names if names.count(name) > 1]:
        remedy = "leave one out, or give each a label of its own: mine=…"
        raise InputError(place="TRACKS", got=f"{twice[0]} twice", expected="each run once", remedy=remedy)
    return dict(zip(names, (rest for _, rest in parts), strict=True))


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
