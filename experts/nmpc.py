"""The expert: a model predictive controller that answers with joint targets.

One call runs once through the chain

    state -> Pinocchio -> reference and footholds -> rigid-body model, linearized -> QP -> ground forces
          -> whole-body torques -> joint targets of the PD actuators.

What is nonlinear in it. The model of `experts.mpc.srbd` is: attitude kinematics, lever arms, gyroscopic moments, an
inertia that is computed anew from the configuration at every call. Each call linearizes it along the reference and
solves a QP, as convex MPC does. If the solution stays within `sqp_tolerance` of the trajectory that it was linearized
along, as it does in steady walking, that is all; if not, as after a push, the model is linearized again along the
solution, up to `sqp_iterations` QPs: sequential quadratic programming on the nonlinear program, cut short by default
and converged with a small tolerance and many iterations. Either way the answer depends on the state alone.
``linearization="shifted"`` begins at the last call's solution instead, moved on by the time that has passed: with
``sqp_iterations=1`` a real-time iteration (M. Diehl et al., 2005), which converges from call to call and remembers.

The actuators hold a joint target for a whole control period, during which the joints move on. The target is therefore
the one whose torque is right in the middle of the period, at q + v h/2 + vdot h^2/8 and v + vdot h/2 for a period h; as
h goes to zero this becomes a = q + (tau + kd v)/kp.

What the MPC turns and the reference tilts is the whole robot, trunk and legs (`Dynamics.lean_w`): four legs weigh more
than the trunk, and a jump that swings them all forward turns the trunk back.

By default nothing is remembered from call to call but counters, so the action is a function of the `RobotState`.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from experts.mpc.config import MPCConfig
from experts.mpc.controller import MPC, Solution
from experts.mpc.horizon import Horizon, pose_horizon
from experts.mpc.srbd import COM, RPY, linearize
from experts.mpc.warm_start import Recall, Trajectory
from experts.planning.body_reference import COM_HEIGHT
from experts.planning.contact_timing import contact_pieces, swing_middle
from experts.planning.footholds import FootholdRule
from experts.planning.nominal_motion import NominalMotion, nominal_motion, standing_motion
from experts.planning.plane import to_complex, turn
from experts.planning.swing import SwingRule
from experts.plausibility import plausible
from experts.robot_model import Dynamics, RobotModel
from experts.whole_body.inverse_dynamics import joint_torques
from experts.whole_body.jacobian_transpose import jacobian_transpose_torques
from experts.whole_body.joint_resistance import joint_resistance
from experts.whole_body.qp import WholeBodyQP
from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.deprecation import renamed_arguments
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.validation import number_in, one_of

WholeBody = Callable[[Dynamics, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Dynamics, forces, stance and swing accelerations to joint torques and accelerations."""

WHOLE_BODY: dict[str, Callable[[], WholeBody]] = {
    "closed_form": lambda: joint_torques,
    "qp": lambda: WholeBodyQP().torques,
    "jacobian_transpose": lambda: jacobian_transpose_torques,
}
"""Ways from forces to torques by name; the first, the default, tracks best for its time (docs/results)."""


@renamed_arguments(linearisation="linearization")
@dataclass(frozen=True)
class NMPCConfig:
    """Everything that can be tuned about the expert.

    Attributes:
        com_height: mean height of the centre of mass in gaits whose `body_height` is 1 [m].
        linearization: "reference", or "shifted" for real-time iterations, which remember the last solution.
        sqp_iterations: most QPs per call.
        sqp_tolerance: a QP whose solution is as near as this to the trajectory that it was linearized along is the
            last: attitude [rad], and position in units of `com_height`.
        whole_body: how forces become torques: a name from `WHOLE_BODY`.
        mpc_hz: rate at which forces are planned anew [Hz], the whole body being solved at every call; None plans at
            every call. With a rate the expert remembers its plan.
        mpc: weights, limits and solver settings.
        footholds: where feet land.
        swing: how feet get there.

    Raises:
        InvalidInputError: if a number is outside its range or a name is unknown.
    """

    com_height: float = COM_HEIGHT
    linearization: str = "reference"
    sqp_iterations: int = 3
    sqp_tolerance: float = 0.2
    whole_body: str = "closed_form"
    mpc_hz: float | None = None
    mpc: MPCConfig = field(default_factory=MPCConfig)
    footholds: FootholdRule = field(default_factory=FootholdRule)
    swing: SwingRule = field(default_factory=SwingRule)

    def __post_init__(self) -> None:
        number_in(self.com_height, 0.15, 0.34, "com_height [m]")
        one_of(self.linearization, ("reference", "shifted"), "linearization")
        number_in(self.sqp_iterations, 1, 100, "sqp_iterations")
        number_in(self.sqp_tolerance, 0.0, 10.0, "sqp_tolerance")
        one_of(self.whole_body, tuple(WHOLE_BODY), "whole_body")
        if self.mpc_hz is not None:
            number_in(self.mpc_hz, 10.0, 1000.0, "mpc_hz [Hz]")


@dataclass
class Counters:
    """What happened since the last `reset`.

    Attributes:
        calls: of `action`.
        solves: quadratic programs.
        inexact_solves: solves that ran out of iterations close to the optimum and were used.
        solver_failures: solves that gave no usable forces; the nominal load was used instead.
        bad_states: states with a number that is not finite or beyond any robot's; the home pose was answered.
        iterations: of the QP solver in all.
    """

    calls: int = 0
    solves: int = 0
    inexact_solves: int = 0
    solver_failures: int = 0
    bad_states: int = 0
    iterations: int = 0

    def count(self, solution: Solution) -> None:
        """Add one solve."""
        self.solves += 1
        self.iterations += solution.iterations
        self.inexact_solves += solution.usable and not solution.solved
        self.solver_failures += not solution.usable


class NMPCExpert:
    """Model predictive expert for every `Gait`; needs no environment.

    An expert that was used can be copied and pickled: a copy answers as the original would. It is given what the
    original remembers, counters included; solvers and Pinocchio's data are made anew, and show in no answer.

    Args:
        gains: of the PD actuators that will track the targets.
        hold_s: for how long each target is held [s]; the environment's control period.
        config: see `NMPCConfig`.

    Attributes:
        gains: of the PD actuators that the targets are for. With other gains in the environment the same targets mean
            other torques, so whoever joins the two compares them.
        hold_s: for how long each target is meant to be held [s]; to be compared with the control period likewise.
        config: everything else.
        counters: what happened since the last `reset`.

    Raises:
        InvalidInputError: if `hold_s` lies outside [0, 0.1].
        ImportError: if the configured solver is not installed.
    """

    def __init__(self, gains: PDGains | None = None, hold_s: float = 0.02, config: NMPCConfig | None = None) -> None:
        self.gains = gains or PDGains()
        self.hold_s = number_in(hold_s, 0.0, 0.1, "hold_s [s]")
        self.config = config or NMPCConfig()
        self.counters = Counters()
        self._model = RobotModel()
        self._mpc = MPC(self.config.mpc)
        self._whole_body = WHOLE_BODY[self.config.whole_body]()
        self._recall = Recall()

    def reset(self, state: RobotState) -> None:
        """Begin an episode: clear the counters and, with the options that have one, the memory."""
        self.counters = Counters()
        self._recall = Recall()

    def action(self, state: RobotState) -> np.ndarray:
        """Joint targets for the PD actuators [rad], shape (12,), legs FL FR RL RR; never NaN, never an exception."""
        self.counters.calls += 1
        if not _is_plausible(state):
            self.counters.bad_states += 1
            return robot.HOME_POSE.copy()
        torque, acceleration = self.torque(state)
        # The torque is to be right in the middle of the hold: where the joints will be then, uniformly accelerated.
        half = self.hold_s / 2
        q = state.q + half * state.v + half**2 / 2 * acceleration
        v = state.v + half * acceleration
        torque = torque + joint_resistance(state, v)
        return self.gains.target(torque / state.motor_strength, q, v)

    def torque(self, state: RobotState) -> tuple[np.ndarray, np.ndarray]:
        """Joint torques [N m] within the limits and joint accelerations [rad/s^2], each of shape (12,)."""
        dynamics = self._model.dynamics(state)
        forces = self.forces(state, dynamics)
        if state.standing:
            return self._whole_body(dynamics, forces, np.ones(4, bool), np.zeros((4, 3)))
        velocity_w = mean_velocity(state, dynamics, self.motion(state))
        ahead_s = swing_middle(state, self.hold_s)
        swing = self.config.swing.acceleration(state, ahead_s, dynamics, velocity_w, self.config.footholds)
        # Where feet touch down or lift off during the hold, one target has to serve both: the mean over time.
        torque, acceleration = np.zeros(12), np.zeros(12)
        for middle_s, fraction in contact_pieces(state, self.hold_s):
            stance = state.gait.stance(state.phase + middle_s / state.gait.period)
            part = self._whole_body(dynamics, forces, stance, swing)
            torque += fraction * part[0]
            acceleration += fraction * part[1]
        return torque, acceleration

    def forces(self, state: RobotState, dynamics: Dynamics) -> np.ndarray:
        """Ground forces of the present interval, world [N], shape (4, 3)."""
        if self.config.mpc_hz is not None:
            held = self._recall.at(state, 1.0 / self.config.mpc_hz)
            if held is not None:
                return held.forces_w(state.time_s)
        trajectory = self.plan(state, dynamics)
        if self.config.mpc_hz is not None or self.config.linearization == "shifted":
            self._recall.store(trajectory)
        return trajectory.forces_w(state.time_s)

    def plan(self, state: RobotState, dynamics: Dynamics) -> Trajectory:
        """Predict states and forces over one gait cycle; the nominal load along the reference if no solve is usable.

        Args:
            state: the robot now.
            dynamics: at the state.
        """
        config = self.config
        motion = self.motion(state)
        velocity_w = mean_velocity(state, dynamics, motion)
        horizon = pose_horizon(
            state, dynamics, motion, velocity_w, config.footholds, self._com_height(state), config.mpc.steps
        )
        earlier = self._recall.before(state) if config.linearization == "shifted" else None
        if earlier is None:
            states, inputs = horizon.reference, horizon.nominal
        else:
            states, inputs = earlier.shifted(state.time_s, horizon.frame, horizon.reference, horizon.nominal)
        states, inputs, contact = self._solve_sequence(horizon, states, inputs)
        return Trajectory(state.time_s, state.gait, horizon.dt, states, inputs, contact, horizon.frame)

    def _solve_sequence(
        self, horizon: Horizon, states: np.ndarray, inputs: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sequential quadratic programming from a trajectory, shapes (N + 1, 12) and (N, 12), to the next one.

        Returns:
            That, and over which fractions of the intervals its forces are means; of the nominal ones, which are those
            of an instant, over all.
        """
        config = self.config
        for _ in range(config.sqp_iterations):
            model = linearize(states, inputs, horizon.feet, horizon.inertia_b, horizon.dt, horizon.mass)
            problem = model, horizon.x0, horizon.reference[1:], horizon.nominal, horizon.contact
            solution = self._mpc.solve(*problem, friction=horizon.friction)
            self.counters.count(solution)
            if not solution.usable:
                return horizon.reference, horizon.nominal, np.ones_like(horizon.contact)
            before, states, inputs = states, np.vstack([horizon.x0, solution.states]), solution.inputs
            # Attitude and lever arms are what the Jacobians depend on most: have they moved, these no longer hold.
            moved = np.abs(states - before)
            if max(moved[:, RPY].max(), moved[:, COM].max() / config.com_height) < config.sqp_tolerance:
                break
        return states, inputs, horizon.contact

    def motion(self, state: RobotState) -> NominalMotion:
        """The nominal motion of the state's gait, or of standing."""
        if state.standing:
            return standing_motion(state.gait)
        inertia = self._model.standing_moments(state.payload_kg)
        height = self._com_height(state) - robot.FOOT_RADIUS
        return nominal_motion(state.gait, inertia, height, robot.MASS + state.payload_kg)

    def _com_height(self, state: RobotState) -> float:
        """Mean height of the centre of mass in the state's gait [m]."""
        return self.config.com_height * state.gait.body_height


def mean_velocity(state: RobotState, dynamics: Dynamics, motion: NominalMotion) -> np.ndarray:
    """Horizontal velocity of the centre of mass without the gait's sway, world [m/s], shape (2,).

    Args:
        state: the robot now.
        dynamics: at the state.
        motion: nominal, of the state's gait or of standing.
    """
    mean = to_complex(dynamics.com_velocity_w) - motion.sway_velocity(state.phase) * turn(state.rpy[2])
    return np.array([mean.real, mean.imag])


def _is_plausible(state: RobotState) -> bool:
    """Whether every number of a state is finite and could be a robot's."""
    numbers = (
        state.position_w,
        state.quat_wxyz,
        state.linear_velocity_w,
        state.angular_velocity_b,
        state.q,
        state.v,
        state.command,
        (state.phase, state.time_s, state.payload_kg, state.joint_friction, state.joint_damping),
        () if state.friction is None else (state.friction,),
    )
    return plausible(np.concatenate(numbers))
