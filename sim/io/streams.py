"""Which pictures a stored sequence has, and as what."""

from __future__ import annotations

from collections.abc import Iterable

from scenarios.errors import InputError

STREAMS = ("left", "right", "disparity", "ids", "background")
IMAGES = ("jpg", "png", "mp4")


def chosen(streams: Iterable[str], images: str) -> tuple[str, ...]:
    """The streams in their order, the background with those that need one; InputError for a word that is none."""
    wanted = set(streams)
    unknown = sorted(wanted - set(STREAMS))
    if unknown:
        expected = f"none, or some of {', '.join(STREAMS)}"
        raise InputError(place="--streams", got=", ".join(unknown), expected=expected, remedy="correct --streams")
    if images not in IMAGES:
        raise InputError(place="--images", got=images, expected=" or ".join(IMAGES), remedy="correct --images")
    if wanted & {"left", "right"}:
        wanted.add("background")
    return tuple(name for name in STREAMS if name in wanted)
