"""Which phase of its gait a robot is in, told from its motion alone.

A gait's nominal cycle says what everything should look like at each phase. With lambda the phase of a leg in its own
cycle, T the period, beta the duty, w = (1 - early)(1 - beta) the fraction of the cycle in which the foot is under way,
v the mean velocity of the body at the leg (heading frame; measured, less the nominal sway at the phase in question) and
x the foot's place relative to the point under its hip,

    (1)  x = v T (beta/2 - k(lambda)) - d,    xdot_world = v (1 - k'(lambda)),
         k = lambda                  in stance: the body passes over the foot, half a stride before it to half behind,
         k = left(s) - (1 - lambda)  in swing, s = min((lambda - beta)/w, 1), left = 1 - 3 s^2 + 2 s^3,
         d = the body's sway since the touchdown in stance, 0 in swing,
    (2)  z = radius + max(h 16 s^2 (1 - s)^2 - press s^2, 0),

as `footholds` and `swing` of `experts.planning` plan it. Height, sway, attitude and angular velocity of the whole robot
are those of its `nominal_motion` about the commanded motion, and a foot touches the ground in stance and in the swing's
end, where its arc is below the ground. `fit_phase` compares a state with the cycle at a grid of phases. It never looks
at `RobotState.phase`, and the answer does not depend on where the robot is or which way it faces. A robot that stands
on all feet at rest has no phase: where a gait has such moments (a trot or walk on the spot, a slow walk) the answer
there may be up to half a cycle off.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from experts.planning.body_reference import COM_HEIGHT
from experts.planning.nominal_motion import SAMPLES, nominal_motion
from experts.planning.plane import carried, to_complex, to_complex_array, turn
from experts.planning.swing import SwingRule, cubic, hump
from experts.robot_model import RobotModel, whole_body_attitude
from go1_mtl_gym import robot
from go1_mtl_gym.gaits import Gait
from go1_mtl_gym.sensing.state import RobotState

LAG_S, TRAIL_S = 0.005, 0.02
"""By how much feet follow their plan late [s], and what they tread behind it, per speed of the body [m per m/s]."""
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
        sway: its horizontal velocity [m/s].
        tilt: roll and pitch of the whole robot [rad].
        rate: its angular velocity [rad/s].
    """

    contact: float = 0.5
    height: float = 0.015
    climb: float = 0.4
    place: float = 0.016
    speed: float = 0.22
    level: float = 0.04
    heave: float = 0.06
    sway: float = 0.03
    tilt: float = 0.03
    rate: float = 0.5


@dataclass(frozen=True)
class PhaseFit:
    """The best phase.

    Attributes:
        phase: of the gait clock [cycles], in [0, 1).
        error: root mean square of the scaled residuals there: 0.3 to 0.8 in a steady gait (a walk: 0.8 to 1.8), up to 2
            when pushed about or if the robot does something else.
    """

    phase: float
    error: float


@dataclass(frozen=True)
class _Cycle:
    """The nominal cycle at phases i / SAMPLES; of shape (SAMPLES, 4) unless said otherwise.

    Attributes:
        ground: fraction of contact.
        height: of the feet's centres [m].
        climb: [m/s].
        place: beta/2 - k of equation (1), times the period [s].
        speed: 1 - k' of equation (1).
        drawn: d of equation (1), heading frame, complex [m].
        sway: velocity of the body, heading frame, complex [m/s], shape (SAMPLES,).
        tilt: roll and pitch [rad], shape (SAMPLES, 2).
        rate: angular velocity, heading frame [rad/s], shape (SAMPLES, 3).
        level: deviation of the height [m], shape (SAMPLES,).
        heave: its rate [m/s], shape (SAMPLES,).
    """

    ground: np.ndarray
    height: np.ndarray
    climb: np.ndarray
    place: np.ndarray
    speed: np.ndarray
    drawn: np.ndarray
    sway: np.ndarray
    tilt: np.ndarray
    rate: np.ndarray
    level: np.ndarray
    heave: np.ndarray


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
    cycle = _cycle(state.gait, swing or SwingRule(), com_height)
    residuals = _residuals(state, model or _shared_model(), cycle, scales or PhaseScales(), com_height)
    cost = np.square(residuals).sum(axis=1)
    best = int(np.argmin(cost))
    before, here, after = cost[best - 1], cost[best], cost[(best + 1) % SAMPLES]
    # The lowest point of the parabola through three costs; where they lie on a line, the grid's best.
    bend = before + after - 2 * here
    shift = 0.5 * (before - after) / bend if bend > 0 else 0.0
    least = here - 0.25 * (before - after) * shift
    return PhaseFit(float((best + shift) / SAMPLES % 1.0), float(np.sqrt(max(least, 0.0) / residuals.shape[1])))


def _residuals(
    state: RobotState, model: RobotModel, cycle: _Cycle, scales: PhaseScales, com_height: float
) -> np.ndarray:
    """Scaled residuals at each phase of the grid, shape (SAMPLES, 37)."""
    dynamics = model.dynamics(state)
    vx, vy, yaw_rate = state.command.tolist()
    back = turn(-state.rpy[2])  # from the world to the heading frame
    arm = to_complex_array(state.gait.nominal_feet_b)
    # The sway is that of the phase in question, so there is one mean velocity per phase of the grid.
    com_velocity = to_complex(dynamics.com_velocity_w) * back
    mean = com_velocity - cycle.sway
    velocity = mean[:, None] + carried(arm, yaw_rate)
    place = to_complex_array(dynamics.feet_w - dynamics.com_w) * back - arm
    speed = to_complex_array(dynamics.feet_velocity_w) * back
    turning = to_complex(dynamics.mean_omega_w) * back
    rate = np.array([turning.real, turning.imag, dynamics.mean_omega_w[2] - yaw_rate])
    columns = (
        (cycle.ground - state.contacts) / scales.contact,
        (cycle.height - dynamics.feet_w[:, 2]) / scales.height,
        (cycle.climb - dynamics.feet_velocity_w[:, 2]) / scales.climb,
        _parts(cycle.place * velocity - cycle.drawn - place) / scales.place,
        _parts(cycle.speed * velocity - speed) / scales.speed,
        _parts(mean[:, None] - complex(vx, vy)) / scales.sway,
        (cycle.tilt - whole_body_attitude(state, dynamics)[:2]) / scales.tilt,
        (cycle.rate - rate) / scales.rate,
        (cycle.level - (dynamics.com_w[2] - com_height * state.gait.body_height))[:, None] / scales.level,
        (cycle.heave - dynamics.com_velocity_w[2])[:, None] / scales.heave,
    )
    return np.hstack(columns)


def _parts(values: np.ndarray) -> np.ndarray:
    """Real and imaginary parts side by side: (N, M) complex to (N, 2 M)."""
    return np.hstack([values.real, values.imag])


@lru_cache(maxsize=64)
def _cycle(gait: Gait, swing: SwingRule, com_height: float) -> _Cycle:
    """The nominal cycle of a gait, equations (1) and (2)."""
    duty, period = gait.duties, gait.period
    phase = np.arange(SAMPLES) / SAMPLES
    leg = gait.leg_phase(phase - LAG_S / period)
    stance = leg < duty
    under_way = (1 - swing.early) * (1 - duty)
    s = np.clip((leg - duty) / under_way, 0.0, 1.0)
    left, slope, _ = cubic(s)
    arc, rise, _ = hump(s)
    arc, rise = gait.swing_height * arc - swing.press * s**2, gait.swing_height * rise - 2 * swing.press * s
    above = arc > 0.0
    landed = 1.0 - min(np.sqrt(swing.press / gait.swing_height) / 4, 1.0)  # s at which the arc meets the ground
    motion = nominal_motion(gait, _standing_inertia(), com_height * gait.body_height - robot.FOOT_RADIUS)
    # The body's deviation when each foot came down: its stance began `leg` cycles ago.
    touchdown = motion.at((phase[:, None] - leg).ravel())[:, 3:5].reshape(SAMPLES, 4, 2)
    return _Cycle(
        ground=_contact_fraction(leg, duty, 1 - duty - landed * under_way),
        height=robot.FOOT_RADIUS + np.where(above, arc, 0.0),
        climb=np.where(above, rise / (under_way * period), 0.0),
        place=period * (duty / 2 - np.where(stance, leg, left - (1 - leg))) - TRAIL_S,
        speed=-slope / under_way,
        drawn=np.where(stance, to_complex_array(motion.position[:, None, 3:5]) - to_complex_array(touchdown), 0.0),
        sway=to_complex_array(motion.velocity[:, 3:5]),
        tilt=motion.position[:, :2],
        rate=motion.velocity[:, :3],
        level=motion.position[:, 5],
        heave=motion.velocity[:, 5],
    )


def _contact_fraction(leg: np.ndarray, duty: np.ndarray, waiting: np.ndarray) -> np.ndarray:
    """1 on the ground, 0 in the air, with ramps; the foot is down for `waiting` cycles before its stance begins."""
    since = np.mod(leg + waiting, 1.0)
    length = duty + waiting
    # Distance from the middle of the contact, the short way round the cycle.
    centered = np.abs(since - length / 2)
    centered = np.minimum(centered, 1.0 - centered)
    return np.clip(0.5 + (length / 2 - centered) / (2 * _BLUR), 0.0, 1.0)


@lru_cache(maxsize=1)
def _shared_model() -> RobotModel:
    return RobotModel()


@lru_cache(maxsize=1)
def _standing_inertia() -> tuple[float, float, float]:
    return tuple(np.diag(_shared_model().standing_inertia()).tolist())
