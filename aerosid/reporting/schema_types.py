"""Types of the schemas: numbers that JSON can represent, texts that UTF-8 can encode, frozen rows."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict


def finite_or_none(number: Any) -> Any:
    """The number as a float; None where it is None, NaN or infinite, none of which JSON can represent."""
    if number is None or not math.isfinite(number):
        return None
    return float(number)


Number = Annotated[float | None, BeforeValidator(finite_or_none)]


def encodable(text: Any) -> Any:
    """The text with characters that UTF-8 cannot encode written out: a path on disk may be any bytes."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8") if isinstance(text, str) else text


Text = Annotated[str, BeforeValidator(encodable)]


class Row(BaseModel):
    """A frozen row, read from the attributes of a result; NaN and infinity are refused."""

    model_config = ConfigDict(frozen=True, from_attributes=True, allow_inf_nan=False)
