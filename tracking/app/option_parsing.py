"""What options mean: `--seeds a:b`, `--streams a,b`, `--set subject.key=value`, folders to write to."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from scenarios.errors import InputError

SUBJECTS = ("tracker", "sensor", "scenario")


def seeds(text: str, option: str = "--seeds") -> range:
    """`a:b`, half-open, or one seed."""
    found = re.fullmatch(r"(\d{1,18})(?::(\d{1,18}))?", text.strip())
    if found is None:
        raise InputError(
            place=option, got=repr(text), expected="a:b (from a to b - 1) or one seed", remedy="write 0:10 or 7"
        )
    first = int(found[1])
    return range(first, first + 1 if found[2] is None else int(found[2]))


def settings(texts: Iterable[str], own: str, takes: Iterable[str]) -> list[tuple[str, str]]:
    """`--set` assignments as (subject, key=value without the subject); a bare key is about `own`.

    InputError for one without "=", and for a subject that the command does not take.
    """
    return [_setting(text, own, tuple(takes)) for text in texts]


def _setting(text: str, own: str, takes: tuple[str, ...]) -> tuple[str, str]:
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise InputError(
            place=f"--set {text}", got=repr(text), expected="key=value", remedy=f"write --set {own}.key=value"
        )
    subject, dot, rest = key.strip().partition(".")
    if not dot or subject not in SUBJECTS:
        subject, rest = own, key.strip()
    if subject not in takes:
        raise InputError(
            place=f"--set {text}",
            got=f"a setting of the {subject}",
            expected="one of the " + " or the ".join(takes),
            remedy="give it to the command that makes the " + subject,
        )
    return subject, f"{rest}={value}"


def scenario_settings(texts: Iterable[str]) -> list[str]:
    """`--set` of commands about scenarios: `sensor.` is the scenario's own sensor."""
    found = settings(texts, "scenario", ("scenario", "sensor"))
    return [f"sensor.{text}" if subject == "sensor" else text for subject, text in found]


def sensor(file: Path | None) -> tuple[str, ...]:
    """`--sensor FILE.toml` as `--set` would say it: `sensor.key=value`; what `--set` says itself comes after it."""
    if file is None:
        return ()
    from scenarios import sensor_settings

    return sensor_settings(file)


def streams(text: str) -> tuple[str, ...]:
    """Words between commas; () for none."""
    return () if text.strip() == "none" else tuple(word.strip() for word in text.split(",") if word.strip())


def pictures(text: str, images: str | None) -> tuple[tuple[str, ...], str]:
    """`--streams` and `--images`; InputError for images of streams that have no choice."""
    from sim.io.store.streams import coding

    wanted = streams(text)
    if images is not None and coding(wanted, images) is None:
        got, remedy = f"{images} with --streams {text}", "leave --images out: ids and disparity are always png"
        raise InputError(place="--images", got=got, expected="left, right or background", remedy=remedy)
    return wanted, images or "jpg"


def values(texts: Iterable[str]) -> dict[str, Any]:
    """key=value texts as TOML values by key."""
    from scenarios.loading.overrides import parse

    return {".".join(steps): value for steps, value in map(parse, texts)}


def named(out: Path, suffix: str) -> Path:
    """A file to write whose name says what it is; InputError where it says something else."""
    there = out.is_dir()
    if there or out.suffix.lower() != suffix:
        got, better = (f"{out}, a folder", out / "page") if there else (str(out), out.with_suffix(""))
        remedy = f"write {better}{suffix}"
        raise InputError(place="--out", got=got, expected=f"a file that ends in {suffix}", remedy=remedy)
    return out


def folder(out: Path) -> Path:
    """A folder to write to, there or to be made; InputError before any work where it cannot be one."""
    there = next(p for p in (out, *out.parents) if p.exists())
    if not there.is_dir():
        raise InputError(
            file=there, place="--out", got="a file", expected="a folder, there or to be made", remedy="choose another"
        )
    return out
