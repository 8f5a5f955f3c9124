"""What the models of all design files are made of: numbers in their ranges, and strictness."""

from typing import Annotated

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError


def _not_bool_or_text(value: object) -> object:
    if isinstance(value, bool | str):
        raise PydanticCustomError("whole_number_type", "not a whole number")
    return value


def _not_zero(vector: tuple) -> tuple:
    if not any(vector):
        raise ValueError("is [0, 0, 0]; accepted: a direction")
    return vector


# A quoted number, `yes` and `true` are mistakes, not numbers; 5.0, as in a range, is a whole one.
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Finite, Field(gt=0)]
NotNegative = Annotated[Finite, Field(ge=0)]
Whole = BeforeValidator(_not_bool_or_text)
Vector = tuple[Finite, Finite, Finite]
Direction = Annotated[Vector, AfterValidator(_not_zero)]


class Strict(BaseModel):
    """A model that knows all of its keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)
