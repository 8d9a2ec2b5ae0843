"""What all sections of parameters share: kinds of values, and that unknown names are refused."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Weight = Annotated[float, Field(ge=0, le=1e6)]
Noise = Annotated[float, Field(ge=1e-6, le=1e6, allow_inf_nan=False)]
Height = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False)]
Cell = Annotated[float, Field(gt=0, le=1.0, allow_inf_nan=False)]
Probability = Annotated[float, Field(gt=0, lt=1)]
FreeProbability = Annotated[float, Field(gt=0, le=0.5)]
OccupiedProbability = Annotated[float, Field(ge=0.5, lt=1)]
Solver = Literal["lm", "casadi"]
Count = Annotated[int, Field(ge=1)]
Small = Annotated[float, Field(ge=-0.2, le=0.2)]


class Section(BaseModel):
    """One frozen group of parameters; unknown names are refused."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", validate_default=True, ser_json_inf_nan="constants"
    )
