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

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from experts.mpc.config import MPCConfig
from experts.mpc.controller import MPC, Solution
from experts.mpc.srbd import COM, FORCE_UNIT, RPY, linearize
from experts.mpc.warm_start import Frame, Recall, Trajectory
from experts.planning.body_reference import body_reference
from experts.planning.footholds import FootholdRule
from experts.planning.nominal_motion import NominalMotion, nominal_motion, standing_motion
from experts.planning.plane import to_complex, turn
from experts.planning.swing import SwingRule
from experts.plausibility import LARGEST
from experts.robot_model import Dynamics, RobotModel
from experts.whole_body.inverse_dynamics import joint_torques
from experts.whole_body.jacobian_transpose import jacobian_transpose_torques
from experts.whole_body.qp import WholeBodyQP
from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.validation import number_in, one_of

WHOLE_BODY = {
    "closed_form": lambda: joint_torques,
    "qp": lambda: WholeBodyQP().torques,
    "jacobian_transpose": lambda: jacobian_transpose_torques,
}
"""Ways from forces to torques by name; the first, the default, tracks best for its time (docs/results)."""
SHORTEST_PIECE_S = 1e-3
"""Contact changes closer than this to each other or to the ends of a hold are taken as one [s]."""


@dataclass(frozen=True)
class NMPCConfig:
    """Everything that can be tuned about the expert.

    Attributes:
        com_height: mean height of the centre of mass [m].
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
        InvalidInputError: if a figure is outside its range or a name is unknown.
    """

    com_height: float = 0.28
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
        velocity_w = self.mean_velocity(state, dynamics)
        ahead_s = swing_middle(state, self.hold_s)
        swing = self.config.swing.acceleration(state, ahead_s, dynamics, velocity_w, self.config.footholds)
        torque, acceleration = np.zeros(12), np.zeros(12)
        for middle_s, share in contact_pieces(state, self.hold_s):
            stance = state.gait.stance(state.phase + middle_s / state.gait.period)
            part = self._whole_body(dynamics, forces, stance, swing)
            torque += share * part[0]
            acceleration += share * part[1]
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

        The program is posed in the frame below the centre of mass that faces where the robot does, so that it is the
        same wherever the robot is.
        """
        config, gait = self.config, state.gait
        steps = config.mpc.steps
        dt = gait.period / steps
        motion = self.motion(state)
        roll, pitch, yaw = whole_body_attitude(state, dynamics)
        frame = Frame(dynamics.com_w, yaw)
        com = np.array([0.0, 0.0, dynamics.com_w[2]])
        reference = body_reference(state, 0.0, com, motion, config.com_height, dt, steps)
        middle = state.phase + (np.arange(steps) + 0.5) / steps
        contact = np.ones((steps, 4)) if state.standing else gait.contact_schedule(state.phase, dt, steps)
        velocity_w = self.mean_velocity(state, dynamics)
        feet_w = config.footholds.over_horizon(state, dynamics.com_w, velocity_w, dynamics.feet_w, middle)
        nominal = motion.force_at(middle) * (robot.MASS * robot.GRAVITY / FORCE_UNIT)
        sideways = to_complex(nominal) * turn(reference[:-1, 2:3])
        nominal[..., 0], nominal[..., 1] = sideways.real, sideways.imag
        nominal = nominal.reshape(steps, 12)
        feet = frame.points(feet_w)
        turning, moving = frame.vectors(np.stack([dynamics.mean_omega_w, dynamics.com_velocity_w]))
        x0 = np.concatenate([(roll, pitch, 0.0), com, turning, moving])
        inertia_b = state.rotation.T @ dynamics.inertia_w @ state.rotation

        states, inputs = reference, nominal
        earlier = self._recall.before(state) if config.linearization == "shifted" else None
        if earlier is not None:
            states, inputs = earlier.shifted(state.time_s, frame, reference, nominal)
        for _ in range(config.sqp_iterations):
            model = linearize(states, inputs, feet, inertia_b, dt)
            solution = self._mpc.solve(model, x0, reference[1:], nominal, contact)
            self.counters.count(solution)
            if not solution.usable:
                return Trajectory(state.time_s, gait, dt, reference, nominal, frame)
            before, states, inputs = states, np.vstack([x0, solution.states]), solution.inputs
            moved = np.abs(states - before)
            if max(moved[:, RPY].max(), moved[:, COM].max() / config.com_height) < config.sqp_tolerance:
                break
        return Trajectory(state.time_s, gait, dt, states, inputs, frame)

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


def whole_body_attitude(state: RobotState, dynamics: Dynamics) -> np.ndarray:
    """Roll, pitch, yaw [rad] of trunk and legs together, for small angles between the two, shape (3,)."""
    lean = to_complex(dynamics.lean_w) * turn(-state.rpy[2])
    return state.rpy + np.array([lean.real, lean.imag, dynamics.lean_w[2]])


def swing_middle(state: RobotState, hold_s: float) -> np.ndarray:
    """Time until the middle of what a hold contains of each leg's swing [s], shape (4,); its end if it has none."""
    gait = state.gait
    leg = gait.leg_phase(state.phase)
    lift_off, touchdown = (gait.duty - leg) * gait.period, (1.0 - leg) * gait.period
    return (np.clip(lift_off, 0.0, hold_s) + np.minimum(touchdown, hold_s)) / 2


def contact_pieces(state: RobotState, hold_s: float) -> list[tuple[float, float]]:
    """The parts of a hold between which feet touch down or lift off: middle [s] and share of the hold of each."""
    gait = state.gait
    leg = gait.leg_phase(state.phase)
    edges = np.concatenate([(gait.duty - leg) % 1.0, 1.0 - leg]) * gait.period
    cuts = [0.0]
    for edge in sorted(edges[edges < hold_s - SHORTEST_PIECE_S].tolist()):
        if edge > cuts[-1] + SHORTEST_PIECE_S:
            cuts.append(edge)
    cuts.append(hold_s)
    return [((a + b) / 2, (b - a) / hold_s if hold_s else 1.0) for a, b in pairwise(cuts)]


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
