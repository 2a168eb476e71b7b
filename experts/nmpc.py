"""The expert: a model predictive controller that answers with joint targets.

One call runs once through the chain

    state -> Pinocchio -> reference and footholds -> model linearised along the reference -> QP -> ground forces
          -> whole-body torques -> joint targets of the PD actuators.

The model of `experts.dynamics` is nonlinear in attitude and position; it is linearised anew along the predicted
reference at every call and solved once (one real-time iteration), not iterated to convergence.

The actuators hold a joint target for a whole control period, during which the joints move on. The target is therefore
the one whose torque is right in the middle of the period, at q + v h/2 + vdot h^2/8 and v + vdot h/2 for a period h; as
h goes to zero this becomes a = q + (tau + kd v)/kp.

Nothing is remembered from call to call but counters and the last good forces for the case that a solve fails, so the
action is a function of the `RobotState`.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from experts.dynamics import FORCE_UNIT, linearise
from experts.footholds import FootholdRule
from experts.model import Dynamics, RobotModel
from experts.mpc import LARGEST, MPC, MPCConfig
from experts.nominal import NominalMotion, nominal_motion
from experts.reference import body_reference
from experts.swing import SwingRule
from experts.whole_body import joint_torques
from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.state import RobotState
from go1_mtl_gym.validation import number_in


@dataclass(frozen=True)
class NMPCConfig:
    """Everything that can be tuned about the expert.

    Attributes:
        com_height: mean height of the centre of mass [m].
        mpc: weights, limits and solver settings.
        footholds: where feet land.
        swing: how feet get there.

    Raises:
        InvalidInputError: if com_height is outside [0.15, 0.34].
    """

    com_height: float = 0.28
    mpc: MPCConfig = field(default_factory=MPCConfig)
    footholds: FootholdRule = field(default_factory=FootholdRule)
    swing: SwingRule = field(default_factory=SwingRule)

    def __post_init__(self) -> None:
        number_in(self.com_height, 0.15, 0.34, "com_height [m]")


@dataclass
class Counters:
    """What happened since the last `reset`.

    Attributes:
        calls: of `action`.
        inexact_solves: solves that ran out of iterations close to the optimum and were used.
        solver_failures: solves that gave no usable forces; the last good ones were used.
        bad_states: states with a number that is not finite or beyond any robot's; the home pose was answered.
        iterations: of the QP solver in all.
    """

    calls: int = 0
    inexact_solves: int = 0
    solver_failures: int = 0
    bad_states: int = 0
    iterations: int = 0


class NMPCExpert:
    """Model predictive expert for every `Gait`; needs no environment.

    Args:
        gains: of the PD actuators that will track the targets.
        hold_s: for how long each target is held [s]; the environment's control period.
        config: see `NMPCConfig`.

    Attributes:
        counters: what happened since the last `reset`.
    """

    def __init__(self, gains: PDGains | None = None, hold_s: float = 0.02, config: NMPCConfig | None = None) -> None:
        self.gains = gains or PDGains()
        self.hold_s = number_in(hold_s, 0.0, 0.1, "hold_s [s]")
        self.config = config or NMPCConfig()
        self.counters = Counters()
        self._model = RobotModel()
        self._mpc = MPC(self.config.mpc)
        self._last_good_forces = _standing_forces()
        self._standing_inertia = np.diag(self._model.standing_inertia())

    def reset(self, state: RobotState) -> None:
        """Begin an episode: clear the counters and share the weight evenly for the case that the first solve fails."""
        self.counters = Counters()
        self._last_good_forces = _standing_forces()

    def action(self, state: RobotState) -> np.ndarray:
        """Joint targets for the PD actuators [rad], shape (12,), legs FL FR RL RR; never NaN, never an exception."""
        self.counters.calls += 1
        if not _plausible(state):
            self.counters.bad_states += 1
            return robot.HOME_POSE.copy()
        torque, acceleration = self.torque(state)
        half = self.hold_s / 2
        q = state.q + half * state.v + half**2 / 2 * acceleration
        v = state.v + half * acceleration
        return self.gains.target(torque, q, v)

    def torque(self, state: RobotState) -> tuple[np.ndarray, np.ndarray]:
        """Joint torques [N m] within the limits and joint accelerations [rad/s^2], each of shape (12,)."""
        dynamics = self._model.dynamics(state)
        forces = self.forces(state, dynamics)
        middle = replace(state, phase=state.phase + self.hold_s / 2 / state.gait.period)
        stance = middle.gait.stance(middle.phase)
        swing = self.config.swing.acceleration(middle, dynamics, self.config.footholds)
        return joint_torques(dynamics, forces, stance, swing)

    def forces(self, state: RobotState, dynamics: Dynamics) -> np.ndarray:
        """Ground forces of the present interval, world [N], shape (4, 3)."""
        config, gait = self.config, state.gait
        steps = config.mpc.steps
        dt = gait.period / steps
        motion = self.motion(state)
        reference = body_reference(state, dynamics.com_w, motion, config.com_height, dt, steps)
        contact = gait.contact_schedule(state.phase, dt, steps)
        feet = config.footholds.over_horizon(state, dynamics.com_w, dynamics.com_velocity_w, dynamics.feet_w, dt, steps)
        middle = state.phase + (np.arange(steps) + 0.5) / steps
        load = motion.load_at(middle) * (robot.MASS * robot.GRAVITY)
        model = linearise(reference, feet, load, dynamics.inertia_w, dt)

        rpy = state.rpy
        x0 = np.concatenate([rpy, dynamics.com_w, state.rotation @ state.angular_velocity_b, dynamics.com_velocity_w])
        u_ref = np.zeros((steps, 4, 3))
        u_ref[:, :, 2] = load / FORCE_UNIT
        solution = self._mpc.solve(model, x0, reference.states[1:], u_ref.reshape(steps, 12), contact)
        self.counters.iterations += solution.iterations
        self.counters.inexact_solves += solution.usable and not solution.solved
        if not solution.usable:
            self.counters.solver_failures += 1
            return self._last_good_forces
        self._last_good_forces = solution.forces_w
        return solution.forces_w

    def motion(self, state: RobotState) -> NominalMotion:
        """The nominal motion of the state's gait."""
        return nominal_motion(state.gait, *self._standing_inertia[:2])


def _standing_forces() -> np.ndarray:
    forces = np.zeros((4, 3))
    forces[:, 2] = robot.MASS * robot.GRAVITY / 4
    return forces


def _plausible(state: RobotState) -> bool:
    parts = (
        state.position_w,
        state.quat_wxyz,
        state.linear_velocity_w,
        state.angular_velocity_b,
        state.q,
        state.v,
        state.command,
        [state.phase],
    )
    return all((np.abs(part) < LARGEST).all() for part in parts)
