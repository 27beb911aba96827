"""What the judgement has played, kept in the study: killed after its last trial, a search need not begin that anew.

Sets of scenes are kept whole, by what was played on what; of an episode the scores that are compared.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Generator, Sequence
from dataclasses import astuple, replace
from typing import Any

from scenarios.errors import FlockscopeError
from tracking.environment.episodes import Episode, Source
from tracking.tuning.judge import SHOWN
from tracking.tuning.parallel_episodes import Answer, Play
from tracking.tuning.study import Study

JUDGED = "judged "
"""Begins the attributes of a study in which this is kept."""


def remembering(study: Study, play: Play) -> Play:
    """play, but for what the study remembers."""
    kept = {*SHOWN, *(goal.key for goal in study.plan.goals)}

    def remembered(sources: Sequence[Source], values: dict[str, Any], every: bool) -> Generator[Answer, None, None]:
        key = JUDGED + _digest([source.key for source in sources], values, every)
        known = study.optuna.user_attrs.get(key)
        if known is not None:
            yield from (Episode(*fields) for fields in known)
            return
        played = []
        for answer in play(sources, values, every):
            if isinstance(answer, FlockscopeError):
                yield answer
                return
            played.append(replace(answer, scores={k: v for k, v in answer.scores.items() if k in kept}))
            yield played[-1]
        study.optuna.set_user_attr(key, [astuple(episode) for episode in played])

    return remembered


def _digest(*parts: object) -> str:
    return hashlib.sha256(json.dumps(parts, default=str).encode()).hexdigest()[:16]
