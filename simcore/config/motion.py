"""The motion program of a device."""

import itertools
from typing import Annotated

from pydantic import Field, model_validator

from simcore.config.values import Direction, Finite, NotNegative, Strict, Vector


class Keyframe(Strict):
    """Where a device stands at a time."""

    time_s: Annotated[NotNegative, Field(description="time after settling")]
    translation_m: Annotated[Finite, Field(description="along translation_axis")]
    rotation_deg: Annotated[Finite, Field(description="about rotation_axis")]


class MotionProgram(Strict):
    """Two degrees of freedom, a translation and a rotation, from keyframe to keyframe."""

    translation_axis: Annotated[Direction, Field(description="direction in the world")]
    rotation_axis: Annotated[Direction, Field(description="direction in the world")]
    rotation_point_m: Annotated[
        Vector, Field(description="a point of the axis, frame of what moves")
    ]
    keyframes: Annotated[
        tuple[Keyframe, ...],
        Field(min_length=2, description="places the device passes, at rest in each"),
    ]

    @model_validator(mode="after")
    def _in_order(self):
        times = [keyframe.time_s for keyframe in self.keyframes]
        if times[0] != 0 or any(b <= a for a, b in itertools.pairwise(times)):
            raise ValueError("keyframes must start at time_s 0 and rise in time")
        return self
