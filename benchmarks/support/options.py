"""Command-line options that several benchmarks share: seeds, the folder of real recordings, one thread per library."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable
from pathlib import Path

from sim.workers.calls import THREAD_VARIABLES

SHARED_DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
PETS = "mot/PETS09-S2L1-first200"
CAMPUS = "mot/TUD-Campus"
TOWN_CENTRE = "mot/AVG-TownCentre-first225"
HOTEL = "biwi/seq_hotel"
ZARA = "biwi/zara01"
WALK_TOGETHER = "caviar/mwt1gt.xml"


def new_parser(doc: str | None) -> argparse.ArgumentParser:
    """Returns a parser whose help is the docstring of the benchmark, line breaks kept."""
    return argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)


def seed_range(text: str) -> range:
    """Returns the range a, …, b - 1 of the text "a:b". Raises ArgumentTypeError, which argparse reports, otherwise."""
    try:
        first, last = map(int, text.split(":"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a:b, for example 20000:20100, got {text!r}") from None
    return range(first, last)


def seeds_text(seeds: range) -> str:
    """Returns a range of seeds as it is written on the command line."""
    return f"{seeds.start}:{seeds.stop}"


def add_seeds(parser: argparse.ArgumentParser, default: str, option: str = "--seeds", what: str = "") -> None:
    """Adds the option of a half-open range of seeds; what: for which part of the benchmark they are."""
    parser.add_argument(option, type=seed_range, default=default, metavar="A:B", help=f"{what}half-open range of seeds")


def add_data(parser: argparse.ArgumentParser) -> None:
    """Adds --data, the folder of real recordings: by default $FLOCKSCOPE_DATA, else ../shared/data."""
    default = Path(os.environ.get("FLOCKSCOPE_DATA", SHARED_DATA))
    parser.add_argument("--data", type=Path, default=default, metavar="FOLDER", help="folder of real recordings")


def add_trackers(parser: argparse.ArgumentParser, known: Iterable[str], absent: str = "all") -> None:
    """Adds the names of trackers as an argument; `trackers` is [] without any. known: those that may be given; absent:
    which are meant without any."""

    def name(text: str) -> str:
        if text not in known:
            raise argparse.ArgumentTypeError(f"{text}: give {', '.join(known)}")
        return text

    known = tuple(known)
    parser.add_argument(
        "trackers", nargs="*", type=name, metavar="TRACKER", help=f"{', '.join(known)}; {absent} if absent"
    )


def one_thread() -> None:
    """Restarts the program with one thread per numerical library, unless it has been started so.

    The libraries read these variables when they are loaded, so setting them later has no effect.
    """
    import sys

    if any(os.environ.get(name) != "1" for name in THREAD_VARIABLES):
        spec = sys.modules["__main__"].__spec__
        words = ["-m", spec.name.removesuffix(".__main__"), *sys.argv[1:]] if spec is not None else sys.argv
        os.execve(sys.executable, [sys.executable, *words], {**os.environ, **dict.fromkeys(THREAD_VARIABLES, "1")})
