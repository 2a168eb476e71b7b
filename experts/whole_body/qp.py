"""From ground forces and swing accelerations to joint torques, as a small quadratic program that knows the limits.

`experts.whole_body.inverse_dynamics` answers the same question in closed form and clips. Here what cannot be had is
given up where it matters least. With M, h, J of `Dynamics` the equations of motion

    (1)  M vdot + h = S' tau + J' f

hold for every choice of torques tau and ground forces f, so the accelerations vdot are no free variables but
vdot = M^-1 (S' tau + J' f - h), and the dynamics of the base (the upper six rows of (1)) are met exactly. The program

    minimize    |vdot_base - vdot_base*|^2_base + |J vdot + Jdot v - a_foot*|^2_feet + |f - f*|^2_force
    subject to  |tau| <= tau_max,  |f_x| <= mu f_z,  |f_y| <= mu f_z,  f_z >= 0 on the ground,  f = 0 in the air

(the weighted form of A. Herzog et al., Autonomous Robots 40, 2016; D. Kim et al., arXiv 1909.06586, take the MPC's
forces f* as their target too) asks for the foot accelerations a_foot* that the closed form asks for and for the base
acceleration vdot_base* that it would have without limits. At the closed form all three terms are zero: where it is
within the limits it is the optimum, and no program is solved.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import osqp
from scipy import sparse

from experts.friction import ROWS_PER_FOOT, friction_pyramid
from experts.plausibility import plausible
from experts.robot_model import Dynamics
from experts.whole_body.inverse_dynamics import equations, joint_torques, required_torque
from experts.whole_body.request import Request, within_limits
from go1_mtl_gym import robot
from go1_mtl_gym.validation import number_in

_TORQUE_UNIT, _FORCE_UNIT = 10.0, 40.0
_UNIT = np.repeat([_TORQUE_UNIT, _FORCE_UNIT], 12)  # of the program's variables [tau, f]: N m and N
_N = 24  # variables
_NV = 18  # generalized velocities
_LIMITS = 12 + 4 * ROWS_PER_FOOT  # rows: the torques, then each foot's pyramid


@dataclass(frozen=True)
class WholeBodyConfig:
    """Weights, limits and solver settings.

    Attributes:
        linear_weight: per squared [m/s^2] of the base.
        angular_weight: per squared [rad/s^2] of the base.
        stance_weight: per squared [m/s^2] of a foot on the ground.
        swing_weight: per squared [m/s^2] of a foot in the air.
        force_weight: per squared [N] of a foot's force.
        friction: mu of the pyramid.
        slack: by which the pyramid is widened [N]; the MPC's forces are no more exact than that.
        tolerance: eps_abs of OSQP.
        rho: ADMM step of OSQP; fixed, so that a solution depends on its problem alone.
        max_iterations: of OSQP; a program that needs more is answered in closed form.

    Raises:
        InvalidInputError: if a number is outside its range.
    """

    linear_weight: float = 1.0
    angular_weight: float = 0.1
    stance_weight: float = 10.0
    swing_weight: float = 1e-3
    force_weight: float = 1e-3
    friction: float = 0.5
    slack: float = 0.1
    tolerance: float = 2e-4
    rho: float = 20.0
    max_iterations: int = 2000

    def __post_init__(self) -> None:
        for name in ("linear_weight", "angular_weight", "stance_weight", "swing_weight", "force_weight"):
            number_in(getattr(self, name), 1e-9, 1e6, name)
        number_in(self.friction, 0.05, 2.0, "friction")
        number_in(self.slack, 0.0, 10.0, "slack [N]")
        number_in(self.tolerance, 1e-9, 1e-1, "tolerance")
        number_in(self.rho, 1e-6, 1e6, "rho")
        number_in(self.max_iterations, 10, 1e6, "max_iterations")


@dataclass(frozen=True)
class WholeBodyProgram:
    """One problem in y = [tau / 10 N m, f / 40 N]: minimize y' P y / 2 + q' y subject to l <= A y <= u, A constant.

    Attributes:
        P: Hessian, shape (24, 24).
        q: gradient, shape (24,).
        l, u: bounds of tau, then of five rows per foot, shape (32,).
        start: torques and forces of the closed form without limits, shape (24,).
        response: vdot = response y + free, shape (18, 24).
        free: vdot without torques and ground forces, shape (18,).
    """

    P: np.ndarray
    q: np.ndarray
    l: np.ndarray
    u: np.ndarray
    start: np.ndarray
    response: np.ndarray
    free: np.ndarray


class WholeBodyQP:
    """Solves `WholeBodyProgram`s in one OSQP workspace that is set up once and only updated afterwards.

    Each solve starts from the closed form with zero multipliers, so an answer depends on the arguments alone. A copy,
    deep or pickled, gets a new workspace and keeps the counts.

    Args:
        config: weights, limits and solver settings.

    Attributes:
        A: constraint matrix, shape (32, 24).
        solves: programs solved so far; the other calls were answered in closed form because that was within limits.
        failures: programs not solved; the closed form, clipped, was answered.
    """

    def __init__(self, config: WholeBodyConfig | None = None) -> None:
        self.config = config or WholeBodyConfig()
        self.solves = self.failures = 0
        self.A = np.zeros((_LIMITS, _N))
        self.A[:12, :12] = np.eye(12)
        self.A[12:, 12:] = np.kron(np.eye(4), friction_pyramid(self.config.friction))
        self._torque_limit = robot.TORQUE_LIMIT / _TORQUE_UNIT
        self._no_multipliers = np.zeros(_LIMITS)
        self._upper = np.tril_indices(_N)  # of the transpose: the upper triangle column by column, as CSC wants it
        self._solver = self._set_up()

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_solver"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._solver = self._set_up()

    def torques(
        self, dynamics: Dynamics, forces_w: np.ndarray, stance: np.ndarray, swing_acceleration_w: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Torques within the limits that come closest to what is asked for.

        The arguments are those of `Request.of`.

        Returns:
            Joint torques [N m], shape (12,), and the joint accelerations [rad/s^2], shape (12,), that they give.
        """
        closed = joint_torques(dynamics, forces_w, stance, swing_acceleration_w)
        if (np.abs(closed[0]) < robot.TORQUE_LIMIT).all() and self._pushes(forces_w[stance]):
            return closed
        self.solves += 1
        try:
            program = self.program(dynamics, forces_w, stance, swing_acceleration_w)
        except np.linalg.LinAlgError:
            self.failures += 1
            return closed
        y = self._solve(program)
        if y is None:
            self.failures += 1
            return closed
        torque = within_limits(y[:12] * _TORQUE_UNIT)
        y[:12] = torque / _TORQUE_UNIT
        return torque, program.response[6:] @ y + program.free[6:]

    def program(
        self, dynamics: Dynamics, forces_w: np.ndarray, stance: np.ndarray, swing_acceleration_w: np.ndarray
    ) -> WholeBodyProgram:
        """The program of a call of `torques`, as data.

        Raises:
            numpy.linalg.LinAlgError: if the closed form is singular: a leg stretched to the end.
        """
        config = self.config
        request = Request.of(dynamics, forces_w, stance, swing_acceleration_w)
        closed = np.linalg.solve(*equations(request))
        start = np.concatenate([required_torque(request, closed), request.force_w]) / _UNIT
        motion = _motion(request)

        # The least-squares terms of base and feet: what each variable does to them, and what is left to be done.
        effect = np.concatenate([motion[:6], dynamics.jacobian @ motion])
        target = np.concatenate([closed[:6], request.foot_target.ravel()]) - effect[:, _N]
        weighted = self._weight(stance)[:, None] * effect[:, :_N]
        P = effect[:, :_N].T @ weighted
        q = -target @ weighted
        # The forces are variables themselves, so their term is diagonal.
        P.flat[12 * (_N + 1) :: _N + 1] += config.force_weight * _FORCE_UNIT**2
        q[12:] -= config.force_weight * _FORCE_UNIT * request.force_w
        return WholeBodyProgram(P, q, *self._bounds(stance), start, motion[:, :_N], motion[:, _N])

    def _weight(self, stance: np.ndarray) -> np.ndarray:
        """Weights of the base's accelerations, then of the feet's, shape (18,)."""
        config, weight = self.config, np.empty(_NV)
        weight[:3], weight[3:6] = config.linear_weight, config.angular_weight
        weight[6:] = np.repeat(np.where(stance, config.stance_weight, config.swing_weight), 3)
        return weight

    def _bounds(self, stance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The bounds l and u, shape (32,); none for a foot in the air: its force does nothing but cost."""
        l, u = np.empty(_LIMITS), np.full(_LIMITS, np.inf)
        l[:12], u[:12] = -self._torque_limit, self._torque_limit
        l[12:] = np.where(np.repeat(stance, ROWS_PER_FOOT), -self.config.slack / _FORCE_UNIT, -np.inf)
        return l, u

    def _solve(self, program: WholeBodyProgram) -> np.ndarray | None:
        """The solution y, shape (24,), or None."""
        if not plausible(program.P, program.q, program.start):
            return None
        start = program.start.copy()
        start[:12] = np.clip(start[:12], -self._torque_limit, self._torque_limit)
        self._solver.update(q=program.q, l=program.l, u=program.u, Px=program.P[self._upper])
        self._solver.warm_start(x=start, y=self._no_multipliers)
        result = self._solver.solve(raise_error=False)
        solved = result.info.status_val == osqp.SolverStatus.OSQP_SOLVED and np.isfinite(result.x).all()
        return result.x.copy() if solved else None

    def _set_up(self) -> osqp.OSQP:
        """A workspace of the program's pattern; its numbers come with each update."""
        solver = osqp.OSQP()
        solver.setup(
            sparse.csc_matrix(np.triu(np.ones((_N, _N)))),
            np.zeros(_N),
            sparse.csc_matrix(self.A),
            np.full(_LIMITS, -1.0),
            np.full(_LIMITS, np.inf),
            verbose=False,
            scaling=0,
            adaptive_rho=0,
            rho=self.config.rho,
            eps_abs=self.config.tolerance,
            eps_rel=0.0,
            max_iter=self.config.max_iterations,
            check_termination=10,
            polishing=False,
            warm_starting=True,
        )
        return solver

    def _pushes(self, forces_w: np.ndarray) -> bool:
        """Whether forces (..., 3) lie in the pyramid."""
        room = self.config.friction * forces_w[:, 2:] - np.abs(forces_w[:, :2])
        return bool((room >= -self.config.slack).all() and (forces_w[:, 2] >= -self.config.slack).all())


def _motion(request: Request) -> np.ndarray:
    """Equation (1) solved for vdot: one column per variable of the program and a last one at zero, shape (18, 25)."""
    dynamics = request.dynamics
    sides = np.zeros((_NV, _N + 1))
    sides[6:, :12] = np.eye(12) * _TORQUE_UNIT
    sides[:, 12:_N] = dynamics.jacobian.T * (np.repeat(request.stance, 3) * _FORCE_UNIT)
    sides[:, _N] = -dynamics.bias
    return np.linalg.solve(dynamics.mass_matrix, sides)
