"""Local/global iteration against Newton's method on the same backward Euler step."""

import pytest

from simcore.errors import DesignError
from simcore.sheet import LiuSolver
from simcore.validation.newton import FABRIC, PAPER, hanging_sheet, step_errors


@pytest.mark.parametrize("material", [PAPER, FABRIC])
@pytest.mark.parametrize("window", [0, 6])
def test_local_global_step_is_newtons(material, window):
    errors, floor_error = step_errors(hanging_sheet(material), window)
    assert max(errors) < 1e-4
    assert floor_error < 1e-3


def test_steps_and_tolerances_are_checked():
    sheet = hanging_sheet(PAPER)
    with pytest.raises(DesignError, match=r"method\.sheet\.step_s: is 0"):
        LiuSolver(sheet, step=0.0)
    with pytest.raises(DesignError, match=r"method\.sheet\.solver\.tolerance: is -1"):
        LiuSolver(sheet, tolerance=-1.0)
