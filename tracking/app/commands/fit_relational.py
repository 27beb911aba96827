"""`flockscope fit relational`: learns the speed table and the relations of `relational` from simulated truth."""

from __future__ import annotations

from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.fit_options import FitRelationalOptions


def fit_relational(options: FitRelationalOptions) -> CommandResult:
    """Writes the fitted parameters of `relational` as a TOML file."""
    from scenarios.loading.resolve import resolve
    from sim.io.files.atomic import write_file
    from tracking.fitting.grouping_scenes import simulated
    from tracking.fitting.relational import fit_relational as fit
    from tracking.papers.relational.config import RelationalConfig

    out = option_parsing.output_file(options.out, ".toml")
    entries = [entry for name in options.names for entry in resolve(name)]
    seeds = option_parsing.seeds(options.seeds)
    params = fit((simulated(entry, seed) for entry in entries for seed in seeds), RelationalConfig().speed_ends)
    config = RelationalConfig.from_dict(dict(params), out)
    write_file(out, config.to_toml().encode())
    width = max(map(len, params))
    lines = [f"{name:<{width}}  {value:9.4f}  {RelationalConfig.known(name).unit}" for name, value in params.items()]
    lines += ["", f"→ {out}: use it as --params {out}"]
    return CommandResult({"file": out, "params": params}, "\n".join(lines))
