"""The expert: a model predictive controller that answers with joint targets.

One call runs once through the chain

    state -> Pinocchio -> reference and footholds -> rigid-body model, linearised -> QP -> ground forces
          -> whole-body torques -> joint targets of the PD actuators.

What is nonlinear in it. The model of `experts.dynamics` is: attitude kinematics, lever arms, gyroscopic moments, an
inertia that is computed anew from the configuration at every call. By default each call linearises it along the
reference and solves one QP: linear time-varying MPC, whose answer depends on the state alone. Two options go further.
``sqp_iterations=n`` linearises again along the QP's own solution, up to n times or until the forces settle: the
nonlinear program solved by sequential quadratic programming, still without memory. ``linearisation="shifted"`` begins
at the last call's solution instead, moved on by the time that has passed: a real-time iteration (M. Diehl et al., 2005),
one QP per call that converges from call to call, at the price of a memory.

The actuators hold a joint target for a whole control period, during which the joints move on. The target is therefore
the one whose torque is right in the middle of the period, at q + v h/2 + vdot h^2/8 and v + vdot h/2 for a period h; as
h goes to zero this becomes a = q + (tau + kd v)/kp.

By default nothing is remembered from call to call but counters, so the action is a function of the `RobotState`.
"""

from dataclasses import dataclass, field

import numpy as np

from experts.dynamics import FORCE_UNIT, linearise
from experts.footholds import FootholdRule
from experts.model import Dynamics, RobotModel
from experts.mpc import LARGEST, MPC, MPCConfig, Solution
from experts.nominal import NominalMotion, nominal_motion, standing_motion
from experts.planar import to_complex, turn
from experts.reference import body_reference
from experts.swing import SwingRule
from experts.trajectory import Recall, Trajectory
from experts.whole_body import WHOLE_BODY
from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.state import RobotState
from go1_mtl_gym.validation import number_in, one_of

SETTLED = 0.1
"""Sequential quadratic programming ends when no force of the first interval moves by more than this [N]."""


@dataclass(frozen=True)
class NMPCConfig:
    """Everything that can be tuned about the expert.

    Attributes:
        com_height: mean height of the centre of mass [m].
        linearisation: "reference", or "shifted" for real-time iterations, which remember the last solution.
        sqp_iterations: most QPs per call.
        whole_body: how forces become torques: a name from `experts.whole_body.WHOLE_BODY`.
        mpc_hz: rate at which forces are planned anew [Hz], the whole body being solved at every call; None plans at
            every call. With a rate the expert remembers its plan.
        mpc: weights, limits and solver settings.
        footholds: where feet land.
        swing: how feet get there.

    Raises:
        InvalidInputError: if a figure is outside its range or a name is unknown.
    """

    com_height: float = 0.28
    linearisation: str = "reference"
    sqp_iterations: int = 1
    whole_body: str = "closed_form"
    mpc_hz: float | None = None
    mpc: MPCConfig = field(default_factory=MPCConfig)
    footholds: FootholdRule = field(default_factory=FootholdRule)
    swing: SwingRule = field(default_factory=SwingRule)

    def __post_init__(self) -> None:
        number_in(self.com_height, 0.15, 0.34, "com_height [m]")
        one_of(self.linearisation, ("reference", "shifted"), "linearisation")
        number_in(self.sqp_iterations, 1, 100, "sqp_iterations")
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
        self._whole_body = WHOLE_BODY[self.config.whole_body]()
        self._recall = Recall()
        self._standing_inertia = tuple(np.diag(self._model.standing_inertia()).tolist())

    def reset(self, state: RobotState) -> None:
        """Begin an episode: clear the counters and, with the options that have one, the memory."""
        self.counters = Counters()
        self._recall = Recall()

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
        if state.standing:
            return self._whole_body(dynamics, forces, np.ones(4, bool), np.zeros((4, 3)))
        half = self.hold_s / 2
        velocity_w = self.mean_velocity(state, dynamics)
        swing = self.config.swing.acceleration(state, half, dynamics, velocity_w, self.config.footholds)
        return self._whole_body(dynamics, forces, state.gait.stance(state.phase + half / state.gait.period), swing)

    def forces(self, state: RobotState, dynamics: Dynamics) -> np.ndarray:
        """Ground forces of the present interval, world [N], shape (4, 3)."""
        if self.config.mpc_hz is not None:
            held = self._recall.at(state, 1.0 / self.config.mpc_hz)
            if held is not None:
                return held.forces_w(state.time_s)
        trajectory = self.plan(state, dynamics)
        if self.config.mpc_hz is not None or self.config.linearisation == "shifted":
            self._recall.store(trajectory)
        return trajectory.forces_w(state.time_s)

    def plan(self, state: RobotState, dynamics: Dynamics) -> Trajectory:
        """Predict states and forces over one gait cycle; the nominal load along the reference if no solve is usable."""
        config, gait = self.config, state.gait
        steps = config.mpc.steps
        dt = gait.period / steps
        motion = self.motion(state)
        reference = body_reference(state, dynamics.com_w, motion, config.com_height, dt, steps)
        middle = state.phase + (np.arange(steps) + 0.5) / steps
        contact = np.ones((steps, 4)) if state.standing else gait.contact_schedule(state.phase, dt, steps)
        velocity_w = self.mean_velocity(state, dynamics)
        feet = config.footholds.over_horizon(state, dynamics.com_w, velocity_w, dynamics.feet_w, middle)
        nominal = motion.force_at(middle) * (robot.MASS * robot.GRAVITY / FORCE_UNIT)
        sideways = to_complex(nominal) * turn(reference[:-1, 2:3])
        nominal[..., 0], nominal[..., 1] = sideways.real, sideways.imag
        nominal = nominal.reshape(steps, 12)
        omega_w = state.rotation @ state.angular_velocity_b
        x0 = np.concatenate([state.rpy, dynamics.com_w, omega_w, dynamics.com_velocity_w])
        inertia_b = state.rotation.T @ dynamics.inertia_w @ state.rotation

        states, inputs = reference, nominal
        earlier = self._recall.before(state) if config.linearisation == "shifted" else None
        if earlier is not None:
            states, inputs = earlier.shifted(state.time_s, reference, nominal)
        for _ in range(config.sqp_iterations):
            model = linearise(states, inputs, feet, inertia_b, dt)
            solution = self._mpc.solve(model, x0, reference[1:], nominal, contact)
            self.counters.count(solution)
            if not solution.usable:
                return Trajectory(state.time_s, gait, dt, reference, nominal)
            moved = np.abs(solution.inputs[0] - inputs[0]).max() * FORCE_UNIT
            states, inputs = np.vstack([x0, solution.states]), solution.inputs
            if moved < SETTLED:
                break
        return Trajectory(state.time_s, gait, dt, states, inputs)

    def mean_velocity(self, state: RobotState, dynamics: Dynamics) -> np.ndarray:
        """Horizontal velocity of the centre of mass without the gait's own sway, world [m/s], shape (2,)."""
        swaying = self.motion(state).at(np.array([state.phase]))[0, 9:11]
        mean = to_complex(dynamics.com_velocity_w) - to_complex(swaying) * turn(state.rpy[2])
        return np.array([mean.real, mean.imag])

    def motion(self, state: RobotState) -> NominalMotion:
        """The nominal motion of the state's gait, or of standing."""
        if state.standing:
            return standing_motion(state.gait)
        return nominal_motion(state.gait, self._standing_inertia, self.config.com_height - robot.FOOT_RADIUS)


def _plausible(state: RobotState) -> bool:
    numbers = (
        state.position_w,
        state.quat_wxyz,
        state.linear_velocity_w,
        state.angular_velocity_b,
        state.q,
        state.v,
        state.command,
        (state.phase, state.time_s),
    )
    return bool(np.abs(np.concatenate(numbers)).max() < LARGEST)
