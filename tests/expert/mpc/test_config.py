"""Settings of the MPC that are refused."""

import pytest

from experts.mpc.config import SOLVER_NAMES, MPCConfig
from experts.mpc.solvers import SOLVERS
from go1_mtl_gym.errors import InvalidInputError


def test_each_solver_that_may_be_asked_for_is_there():
    assert tuple(SOLVERS) == SOLVER_NAMES


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ({"steps": 3}, "steps"), ({"input_weight": 0.0}, "input_weight"), ({"friction": -0.5}, "friction"),
        ({"max_force": float("nan")}, "max_force"), ({"min_force": -1.0}, "min_force"), ({"rho": 0.0}, "rho"),
        ({"tolerance": 1.0}, "tolerance"), ({"max_iterations": 1}, "max_iterations"),
        ({"relaxation": 2.0}, "relaxation"), ({"solver": "gurobi"}, "solver"),
        ({"state_weight": (1.0,) * 11}, "number of state weights.*11"),
        ({"state_weight": (-1.0,) + (1.0,) * 11}, "smallest state weight.*-1"),
    ],
)  # fmt: skip
def test_impossible_settings_are_refused(setting, words):
    with pytest.raises(InvalidInputError, match=words):
        MPCConfig(**setting)
