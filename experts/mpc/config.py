"""Weights, limits and solver settings of the MPC."""

from dataclasses import dataclass

from go1_mtl_gym.validation import number_in, one_of

NX = NU = 12
"""Numbers in a state and in an input."""
SOLVER_NAMES = ("osqp", "piqp", "daqp")
"""What `MPCConfig.solver` may be; `experts.mpc.solvers` holds one class for each."""


@dataclass(frozen=True)
class MPCConfig:
    """Weights, limits and solver settings of the MPC.

    Attributes:
        steps: N, intervals over one gait cycle.
        state_weight: diagonal of Q for [roll pitch yaw | x y z | omega | velocity].
        input_weight: R, per squared unit of `experts.mpc.srbd.FORCE_UNIT`.
        friction: mu of the pyramid.
        max_force: f_max of one foot [N].
        min_force: f_min of a foot that stays on the ground throughout an interval [N]; keeps contacts from chattering,
            and the lightly loaded third foot of a walk from bouncing.
        solver: "osqp", or one of the exact solvers "piqp" and "daqp" (extra ``solvers``).
        tolerance: eps_abs and eps_rel of OSQP, for its scaled problem.
        rho: ADMM step of OSQP; fixed, so that a solution depends on its problem alone.
        relaxation: alpha of OSQP.
        max_iterations: of OSQP.

    Raises:
        InvalidInputError: if a number is outside its range or the solver is unknown.
    """

    steps: int = 16
    state_weight: tuple[float, ...] = (20.0, 20.0, 10.0, 10.0, 10.0, 60.0, 0.4, 0.4, 0.4, 12.0, 12.0, 2.0)
    input_weight: float = 0.4
    friction: float = 0.5
    max_force: float = 160.0
    min_force: float = 15.0
    solver: str = "osqp"
    tolerance: float = 6e-4
    rho: float = 1.4
    relaxation: float = 1.3
    max_iterations: int = 300

    def __post_init__(self) -> None:
        number_in(self.steps, 4, 64, "steps")
        number_in(self.input_weight, 1e-6, 1e3, "input_weight")
        number_in(self.friction, 0.05, 2.0, "friction")
        number_in(self.max_force, 30.0, 1000.0, "max_force [N]")
        number_in(self.min_force, 0.0, 30.0, "min_force [N]")
        number_in(self.tolerance, 1e-9, 1e-1, "tolerance")
        number_in(self.rho, 1e-6, 1e6, "rho")
        number_in(self.relaxation, 0.5, 1.95, "relaxation")
        number_in(self.max_iterations, 10, 1e6, "max_iterations")
        number_in(len(self.state_weight), NX, NX, "number of state weights")
        number_in(min(self.state_weight), 1e-6, 1e6, "smallest state weight")
        one_of(self.solver, SOLVER_NAMES, "solver")
