"""Golden hashes of truth and simulated detections, one per scenario, in tests/sim/golden.json; they guard ENGINE.

    python -m benchmarks.golden            compare; exit code 1 if a hash differs from the file's, or is missing
    python -m benchmarks.golden --write    write the present hashes into the file
    python -m benchmarks.golden --matrix   compare under each of the settings of SETTINGS, suites included

The hashes are the same on every x86-64 processor: SETTINGS make numpy, BLAS and the C library of this machine take
other code paths, as other processors do. The hash of the scenario stands beside that of the truth, so that an edited
scenario can be told from a changed engine. --write refuses a different truth of the same scenario under the same
ENGINE: raise the number (sim/hashing.py) first.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks.support.options import new_parser
from scenarios.loading.resolve import dump, load, names, resolve, suite_names
from sim.crowd.world import run
from sim.hashing import ENGINE, canonical_hash, scenario_hash, truth_hash
from sim.sequence import observe, simulate

ROOT = Path(__file__).resolve().parents[1]
FILE = ROOT / "tests" / "sim" / "golden.json"
SEED = 40_000
WRITE = "python -m benchmarks.golden --write"
AVX512 = "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR X86_V4"
OLDEST = "AVX2 FMA3 X86_V3"
SETTINGS: dict[str, dict[str, str]] = {
    "as it is": {},
    "BLAS of Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "BLAS of Nehalem": {"OPENBLAS_CORETYPE": "Nehalem"},
    "numpy without AVX-512": {"NPY_DISABLE_CPU_FEATURES": AVX512},
    "numpy without AVX-512 and AVX2": {"NPY_DISABLE_CPU_FEATURES": f"{AVX512} {OLDEST}"},
    "C library without AVX2 and FMA": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F,-AVX512VL,-AVX2_Usable"},
    "all of these": {
        "OPENBLAS_CORETYPE": "Nehalem",
        "NPY_DISABLE_CPU_FEATURES": f"{AVX512} {OLDEST}",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F,-AVX512VL,-AVX2_Usable",
    },
}
KERNELS = {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": "+sse2"}  # compiles all kernels anew
Hashes = dict[str, str]


def golden_file() -> dict[str, Any]:
    """Returns the content of the file; without a file, the same keys without hashes."""
    empty = {"engine": ENGINE, "seed": SEED, "scenarios": {}}
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.is_file() else empty


def present_hashes(name: str) -> Hashes:
    """Returns the hashes of a scenario of the catalogue, its truth and its detections, by name."""
    scenario = load(name)
    text = dump(scenario)
    sequence = simulate(scenario, SEED, streams=())
    detections = [frame.detections for frame in sequence.without_pictures()]
    return {
        "scenario": scenario_hash(text),
        "truth": truth_hash(text, SEED, 0, sequence.truth),
        "detections": canonical_hash(("detections", detections)),
    }


def suite_hashes() -> Hashes:
    """Returns a hash of motion, labels and detections of all entries of each suite, by its name."""
    found = {}
    for suite in suite_names():
        every = []
        for entry in resolve(f"suite:{suite}"):
            sequence = observe(entry.scenario, run(entry.scenario, SEED, entry.repeat), check=False)
            every.append((sequence.truth, [f.detections for f in sequence.without_pictures()]))
        found[suite] = canonical_hash(every)
    return found


def under(settings: dict[str, str], what: str, *names: str) -> dict[str, Any]:
    """Returns what a new process with these environment variables computes: "scenarios" or "suites" as JSON."""
    line = [sys.executable, "-m", "benchmarks.golden", "--print", what, *names]
    env = {k: v for k, v in os.environ.items() if not k.startswith(("OPENBLAS_CORETYPE", "NPY_", "GLIBC_TUNABLES"))}
    run = subprocess.run(line, env={**env, **settings}, cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1])


def difference(name: str, golden: Hashes | None, now: Hashes) -> str:
    """Returns how the present hashes of a scenario differ from the golden ones and what to do; "" if they are equal."""
    if golden is None:
        return f"{name}: no golden hash yet; {WRITE}"
    if golden["scenario"] != now["scenario"]:
        return f"{name}: the scenario has changed; {WRITE}"
    if golden != now:
        return f"{name}: the same scenario gives another truth or detections; raise ENGINE ({ENGINE}), then {WRITE}"
    return ""


def matrix(kernels: bool) -> int:
    """Prints which scenarios and suites differ from the first setting; returns the number of differences."""
    first: dict[str, Any] = {}
    count = 0
    for label, settings in {**SETTINGS, **({"kernels for any x86-64": KERNELS} if kernels else {})}.items():
        now = under(settings, "scenarios", *names()) | under(settings, "suites")
        first = first or now
        off = [name for name in now if now[name] != first[name]]
        count += len(off)
        print(f"| {label} | {len(now)} | {', '.join(off) or 'none'} |", flush=True)
    return count


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("--write", action="store_true", help="write the present hashes")
    parser.add_argument("--matrix", action="store_true", help="compare under each setting")
    parser.add_argument("--kernels", action="store_true", help="with --matrix: also with kernels for any x86-64")
    parser.add_argument("--print", nargs="+", help="print hashes as JSON: suites, or scenarios and names")
    args = parser.parse_args()
    if args.print:
        what, *some = args.print
        print(json.dumps(suite_hashes() if what == "suites" else {name: present_hashes(name) for name in some}))
        return 0
    if args.matrix:
        return 1 if matrix(args.kernels) else 0
    file = golden_file()
    if file["engine"] != ENGINE:
        file = {"engine": ENGINE, "seed": SEED, "scenarios": {}}
    now = {name: present_hashes(name) for name in names()}
    found = [text for name in now if (text := difference(name, file["scenarios"].get(name), now[name]))]
    print(*(found or ["all hashes equal the golden ones"]), sep="\n")
    if not args.write:
        return 1 if found else 0
    if any("ENGINE" in text for text in found):
        print("nothing written")
        return 1
    FILE.write_text(json.dumps(file | {"scenarios": now}, indent=1) + "\n", encoding="utf-8")
    print(f"{len(now)} scenarios written")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
