"""Which phase of its gait a robot is in, told from its motion alone.

A gait's nominal cycle says what everything should look like at each phase. With lambda the phase of a leg in its own
cycle, T the period, beta the duty, w = (1 - early)(1 - beta) the share of the cycle in which the foot is under way, v
the velocity of the body at the leg (heading frame) and x the foot's place relative to the point under its hip,

    (1)  x = v T (beta/2 - k(lambda)),    xdot_world = v (1 - k'(lambda)),
         k = lambda                  in stance: the body passes over the foot, half a stride before it to half behind,
         k = left(s) - (1 - lambda)  in swing, s = min((lambda - beta)/w, 1), left = 1 - 10 s^3 + 15 s^4 - 6 s^5,
    (2)  z = radius + h 16 s^2 (1 - s)^2 - press s^2,

as `experts.footholds` and `experts.swing` plan it; the body's vertical velocity and its roll and pitch rates are those
of `experts.nominal`, and a foot touches the ground in stance and while it waits for it (the share `early` of a swing).
`fit_phase` compares a state with the cycle at a grid of phases. It never looks at `RobotState.phase`, and the answer
does not depend on where the robot is or which way it faces. A robot that stands on all feet at rest has no phase: where
a gait has such moments (a trot or walk on the spot) the answer there may be half a cycle off.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from experts.model import RobotModel
from experts.nominal import SAMPLES, nominal_motion
from experts.planar import carried, turned
from experts.swing import SwingRule
from go1_mtl_gym import robot
from go1_mtl_gym.gaits import Gait
from go1_mtl_gym.state import RobotState

COM_HEIGHT = 0.27
"""Mean height of the centre of mass in good walking [m]."""
_BLUR = 0.03  # half the width of the ramps between "in the air" and "on the ground" [cycles]


@dataclass(frozen=True)
class PhaseScales:
    """How far each quantity is from the nominal cycle in good walking; a residual is divided by its scale.

    Attributes:
        contact: of a foot, 0 or 1.
        height: of a foot [m].
        climb: vertical velocity of a foot [m/s].
        place: horizontal position of a foot relative to its hip [m].
        speed: horizontal velocity of a foot [m/s].
        level: height of the centre of mass [m].
        heave: its vertical velocity [m/s].
        tilt: roll and pitch [rad].
        rate: their rates [rad/s].
    """

    contact: float = 0.75
    height: float = 0.01
    climb: float = 0.2
    place: float = 0.03
    speed: float = 0.2
    level: float = 0.03
    heave: float = 0.1
    tilt: float = 0.3
    rate: float = 1.5

    @property
    def body(self) -> np.ndarray:
        """Scales of the columns of the nominal body motion, shape (6,)."""
        return np.array([self.level, self.tilt, self.tilt, self.heave, self.rate, self.rate])


@dataclass(frozen=True)
class PhaseFit:
    """The best phase.

    Attributes:
        phase: of the gait clock [cycles], in [0, 1).
        error: root mean square of the scaled residuals there: 0.1 to 0.6 in steady walking (1.5 far beyond the
            command range), 1 to 2 when pushed about, more if the robot does something else.
    """

    phase: float
    error: float


@dataclass(frozen=True)
class _Cycle:
    """The nominal cycle at phases i / SAMPLES; each of shape (SAMPLES, 4) but for `body`.

    Attributes:
        ground: share of contact.
        height: of the feet's centres [m].
        climb: [m/s].
        place: beta/2 - k of equation (1), times the period [s].
        speed: 1 - k' of equation (1).
        body: deviation of the height [m], roll and pitch [rad], and their time derivatives, shape (SAMPLES, 6).
    """

    ground: np.ndarray
    height: np.ndarray
    climb: np.ndarray
    place: np.ndarray
    speed: np.ndarray
    body: np.ndarray


def fit_phase(
    state: RobotState,
    model: RobotModel | None = None,
    scales: PhaseScales | None = None,
    swing: SwingRule | None = None,
    com_height: float = COM_HEIGHT,
) -> PhaseFit:
    """The phase of `state.gait` whose nominal motion fits a state best; `state.phase` is ignored.

    The sum of squared scaled residuals is evaluated at 96 phases; a parabola through the best and its two neighbours
    gives the answer.

    Args:
        state: the robot now.
        model: to save building one.
        scales: what counts as far.
        swing: the expert's; its `press` and `early` shape the cycle.
        com_height: mean height of the centre of mass [m].
    """
    scales = scales or PhaseScales()
    swing = swing or SwingRule()
    model = model or _shared_model()
    cycle = _cycle(state.gait, swing.early, swing.press, _standing_inertia())
    cost, count = _cost(state, model, cycle, scales, com_height)
    best = int(np.argmin(cost))
    before, here, after = cost[best - 1], cost[best], cost[(best + 1) % SAMPLES]
    bend = before + after - 2 * here
    shift = 0.5 * (before - after) / bend if bend > 0 else 0.0
    least = here - 0.25 * (before - after) * shift
    return PhaseFit(float((best + shift) / SAMPLES % 1.0), float(np.sqrt(max(least, 0.0) / count)))


def _cost(
    state: RobotState, model: RobotModel, cycle: _Cycle, scales: PhaseScales, com_height: float
) -> tuple[np.ndarray, int]:
    """Sum of squared scaled residuals at each phase of the grid, shape (SAMPLES,), and their number."""
    dynamics = model.dynamics(state)
    yaw = state.rpy[2]
    arm = robot.NOMINAL_FOOT_B[:, :2]
    place = turned(dynamics.feet_w[:, :2] - dynamics.com_w[:2], -yaw) - arm
    speed = turned(dynamics.feet_velocity_w[:, :2], -yaw)
    omega_w = state.rotation @ state.angular_velocity_b
    level, heave = dynamics.com_w[2] - com_height, dynamics.com_velocity_w[2]
    body = np.concatenate([[level], state.rpy[:2], [heave], turned(omega_w[:2], -yaw)])
    velocity = turned(dynamics.com_velocity_w[:2], -yaw) + carried(arm, state.command[2])

    per_foot = (
        np.square((cycle.ground - state.contacts) / scales.contact)
        + np.square((cycle.height - dynamics.feet_w[:, 2]) / scales.height)
        + np.square((cycle.climb - dynamics.feet_velocity_w[:, 2]) / scales.climb)
    )
    planar = np.square((cycle.place[..., None] * velocity - place) / scales.place) + np.square(
        (cycle.speed[..., None] * velocity - speed) / scales.speed
    )
    whole = np.square((cycle.body - body) / scales.body)
    return per_foot.sum(axis=1) + planar.sum(axis=(1, 2)) + whole.sum(axis=1), 4 * 3 + 4 * 2 * 2 + 6


@lru_cache(maxsize=64)
def _cycle(gait: Gait, early: float, press: float, inertia: tuple[float, float]) -> _Cycle:
    """The nominal cycle of a gait, equations (1) and (2)."""
    duty, period = gait.duty, gait.period
    leg = gait.leg_phase(np.arange(SAMPLES) / SAMPLES)
    stance = leg < duty
    under_way = (1 - early) * (1 - duty)
    s = np.clip((leg - duty) / under_way, 0.0, 1.0)
    moving = (s > 0) & (s < 1)
    left = 1 - s**3 * (10 - 15 * s + 6 * s**2)
    k = np.where(stance, leg, left - (1 - leg))
    slope = -30 * s**2 * (1 - s) ** 2 / under_way
    hump, rise = 16 * s**2 * (1 - s) ** 2, 32 * s * (1 - s) * (1 - 2 * s)
    sink = np.where(moving, press * s, 0.0)  # on the ground a foot cannot sink
    motion = nominal_motion(gait, *inertia)
    return _Cycle(
        ground=_contact_share(leg, duty, early * (1 - duty)),
        height=robot.FOOT_RADIUS + gait.swing_height * hump - sink * s,
        climb=(gait.swing_height * rise - 2 * sink) / (under_way * period),
        place=period * (duty / 2 - k),
        speed=-slope,
        body=np.hstack([motion.position[:, [2, 0, 1]], motion.velocity[:, [2, 0, 1]]]),
    )


def _contact_share(leg: np.ndarray, duty: float, waiting: float) -> np.ndarray:
    """1 on the ground, 0 in the air, with ramps; the foot is down a share `waiting` of the cycle before its stance."""
    since = np.mod(leg + waiting, 1.0)
    length = duty + waiting
    centred = np.abs(since - length / 2)
    centred = np.minimum(centred, 1.0 - centred)
    return np.clip(0.5 + (length / 2 - centred) / (2 * _BLUR), 0.0, 1.0)


@lru_cache(maxsize=1)
def _shared_model() -> RobotModel:
    return RobotModel()


@lru_cache(maxsize=1)
def _standing_inertia() -> tuple[float, float]:
    inertia = _shared_model().standing_inertia()
    return float(inertia[0, 0]), float(inertia[1, 1])
