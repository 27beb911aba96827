"""What all tables of a scenario file share: a frozen, strict form, and the kinds of their numbers and names."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*$")]
Pattern = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*\*?$")]
Fixed = tuple[float, float]


class Model(BaseModel):
    """Frozen, strict about keys, no infinities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True)
