"""One case: a copy of a whole input, one file damaged, read within bounds of time and memory; and what came out."""

from __future__ import annotations

import json
import resource
import shutil
import signal
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random

from benchmarks.fuzz.mutations import mutate
from benchmarks.fuzz.readers import FILES, READERS
from scenarios.errors import FlockscopeError

SECONDS = 20.0
"""CPU time that reading a damaged input may take."""
MEMORY = 4 * 2**30
"""Bytes of address space that reading may add."""
SEALS = {"dataset": "manifest.json", "run": "run.json"}
"""The file that names the hashes of all others, by kind."""
LINE = 20_000
"""Characters of an error's line."""


class Overtime(BaseException):
    """Raised by the timer; no reader catches it."""


@dataclass(frozen=True)
class Outcome:
    """What became of a case: "ok", "refused" with the error's line, or "bug" with what went wrong."""

    kind: str
    text: str = ""


def damage(kind: str, specimen: Path, folder: Path, random: Random) -> str:
    """Copies the whole input `specimen` to `folder`, which must not exist, and damages one file; returns its name.

    Half of the datasets and runs get a seal that fits the damaged file, so that the damage passes the hashes.
    """
    shutil.copytree(specimen, folder)
    names = sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())
    names = [name for name in names if name.startswith(FILES.get(kind, ("",)))]
    name = random.choice(names)
    (folder / name).write_bytes(mutate((folder / name).read_bytes(), random))
    if kind in SEALS and random.random() < 0.5:
        _seal_again(folder / SEALS[kind])
    return name


def _seal_again(path: Path) -> None:
    from sim import hashing
    from sim.io.files.tables import json_document
    from sim.io.store.seal import with_hash

    try:
        document = json.loads(path.read_bytes())
        for name, facts in document["files"].items():
            body = (path.parent / name).read_bytes()
            facts.update(sha256=hashing.file_hash(body), bytes=len(body))
        path.write_bytes(json_document(with_hash(document)))
    except (ValueError, KeyError, TypeError, AttributeError, OSError, RecursionError):
        return


def outcome(kind: str, folder: Path) -> Outcome:
    """Reads the input of a kind in `folder` and says what became of it.

    Only success and an error for users of one line, within the bounds, are right. Numpy's warnings count as bugs;
    warnings for users do not.
    """
    try:
        with warnings.catch_warnings(), bounded():
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", RuntimeWarning)
            READERS[kind](folder)
    except FlockscopeError as error:
        line = str(error)
        wrong = "\n" in line or len(line) > LINE or not (error.got and error.expected and error.remedy)
        return Outcome("bug" if wrong else "refused", line[:LINE])
    except (Exception, Overtime) as error:
        frames = traceback.extract_tb(error.__traceback__)
        ours = [f for f in frames if "benchmarks/fuzz" not in f.filename]
        at = next((f for f in reversed(ours) if "site-packages" not in f.filename), frames[-1])
        where = f"{Path(at.filename).name}:{at.lineno} {at.name}"
        return Outcome("bug", f"{type(error).__name__} in {where}: {str(error)[:200]}")
    return Outcome("ok")


@contextmanager
def bounded(seconds: float = SECONDS, memory: int = MEMORY) -> Iterator[None]:
    """Raises Overtime after `seconds` of CPU time, MemoryError beyond `memory` more bytes, for the length of the block.

    Only in the main thread of a POSIX system.
    """

    def ring(*_: object) -> None:
        raise Overtime(f"more than {seconds:g} s")

    limits = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0]) if Path("/proc/self/statm").exists() else None
    before = signal.signal(signal.SIGPROF, ring)
    if pages is not None:
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + memory, limits[1]))
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
        resource.setrlimit(resource.RLIMIT_AS, limits)


def case(kind: str, specimen: Path, folder: Path, random: Random) -> tuple[str, Outcome]:
    """Makes one case in `folder`, reads it, deletes it, and returns the damaged file's name and the outcome."""
    try:
        return damage(kind, specimen, folder, random), outcome(kind, folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
