"""One episode: how it begins, what it carries from step to step, and when it is over."""

import copy
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PHYSICS_HZ
from go1_mtl_gym.env_config import EnvConfig
from go1_mtl_gym.gait_change import GaitChange
from go1_mtl_gym.gait_slew import GaitSlew, fitting_phase
from go1_mtl_gym.gaits import Gait, is_standing, next_phase
from go1_mtl_gym.rewards import no_reward, reward_terms
from go1_mtl_gym.sensing.observation import SensorNoise
from go1_mtl_gym.sensing.sensor_faults import SensorFaults
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.sensing.state_estimator import StateEstimator
from go1_mtl_gym.sensing.state_noise import EstimatorError
from go1_mtl_gym.sensing.state_source import StateSource, TrueState
from go1_mtl_gym.sim.domain_randomization import EpisodeConditions
from go1_mtl_gym.sim.simulation import Simulation
from go1_mtl_gym.tasks import ANY_GAIT, TASKS, Task, any_gait_task

COMMAND_FILTER_S = 0.2
"""Time constant of the low-pass between a command and what expert and student see of it [s]."""
COMMAND_SLEW = (3.0, 3.0, 6.0)
"""Largest change of the filtered command per second: vx, vy [m/s^2], yaw rate [rad/s^2]."""
RESET_JOINT_NOISE = 0.03
"""Largest deviation of a joint from the home pose after a reset [rad]."""
FALLEN_HEIGHT = 0.14
"""A trunk lower than this has fallen [m]."""
FALLEN_COSINE = 0.5
"""A trunk tilted by more than arccos of this has fallen."""


# -- Its course --------------------------------------------------------------------------------------------------------


def filtered(command: np.ndarray, before: np.ndarray, seconds: float) -> np.ndarray:
    """The filtered command after some time: first-order low-pass, then a limit on its slope.

    c' = c + clip((1 - exp(-t / 0.2 s)) (command - c), -COMMAND_SLEW t, COMMAND_SLEW t), each component by itself.

    Args:
        command: as asked for (vx [m/s], vy [m/s], yaw rate [rad/s]), shape (3,).
        before: c, the filtered command so far, shape (3,).
        seconds: t [s].
    """
    limit = np.array(COMMAND_SLEW) * seconds
    fraction = 1.0 - np.exp(-seconds / COMMAND_FILTER_S)
    return before + np.clip(fraction * (command - before), -limit, limit)


@dataclass
class Episode:
    """Task, command, gait clock and memory. Others read it; it is changed by its methods alone.

    Attributes:
        task: what is asked for.
        command: (vx [m/s], vy [m/s], yaw rate [rad/s]) as asked for, shape (3,).
        frames: the latest proprioceptive frames, newest first, each of shape (34,); its `maxlen` is their number.
        last_action: the action applied during the last step, in [-1, 1], shape (12,); 0, a stand, before the first.
        sensor_noise: what is added to the sensors' readings, or None.
        sensor_faults: what else is wrong with them.
        state_source: where the expert's state comes from.
        filtered_command: what expert and student see of the command, shape (3,).
        phase: the gait clock [cycles], in [0, 1).
        steps: control periods since the reset.
        time_s: since the reset [s].
        gait_change: that waits until the present gait can be left, or None.
        task_since_s: since when the present task goes on [s], if it was begun as soon as the one before could be left.
        gait_slew: by which the gait of the task "any_gait" becomes another one, or None.
    """

    task: Task
    command: np.ndarray
    frames: deque[np.ndarray]
    last_action: np.ndarray = field(default_factory=lambda: np.zeros(len(robot.JOINTS)))
    sensor_noise: SensorNoise | None = None
    sensor_faults: SensorFaults = field(default_factory=SensorFaults)
    state_source: StateSource = field(default_factory=TrueState)
    filtered_command: np.ndarray = field(default_factory=lambda: np.zeros(3))
    phase: float = 0.0
    steps: int = 0
    time_s: float = 0.0
    gait_change: GaitChange | None = None
    task_since_s: float = -np.inf
    gait_slew: GaitSlew | None = None

    @property
    def requested_task(self) -> Task:
        """What was asked for last: the present task, or the one that waits until the present gait can be left."""
        return self.task if self.gait_change is None else self.gait_change.wanted

    @property
    def older_frames(self) -> list[np.ndarray]:
        """The frames before the newest one, newest first."""
        return list(self.frames)[1:]

    def advance(self, action: np.ndarray, control_s: float) -> None:
        """Let a control period pass: clock and command filter move on.

        The clock obeys the filtered command that expert and student saw at the beginning of the period.

        Args:
            action: that was applied meanwhile, in [-1, 1], shape (12,).
            control_s: the period [s].
        """
        self._pass(control_s)
        self.last_action = action
        self.steps += 1
        self.time_s = self.steps * control_s

    def _pass(self, seconds: float) -> None:
        """Clock, task and command filter after some time, at most a control period."""
        before, change, time_s = self.phase, self.gait_change, self.time_s + seconds
        self.phase = next_phase(self.task.gait, before, self.filtered_command, seconds)
        if change is not None and change.begins_after(before, self.phase, self.filtered_command, time_s):
            self._begin(change.wanted, 0.0, time_s)
        if self.gait_slew is not None:
            self.task = any_gait_task(self.gait_slew.at(time_s))
            if self.gait_slew.is_over(time_s):
                self.phase, self.gait_slew = (self.phase + self.gait_slew.shift) % 1.0, None
        followed = self.command if self.gait_change is None else self.gait_change.slowed(self.command)
        self.filtered_command = filtered(followed, self.filtered_command, seconds)

    def ahead(self, physics_steps: int, period: int) -> "Episode":
        """The episode some time later, if nobody asks for anything else; this one stays as it is.

        Args:
            physics_steps: how much later.
            period: physics steps per control period.
        """
        later = copy.copy(self)  # whatever changes is replaced, not written to
        whole, rest = divmod(physics_steps, period)
        for steps in [period] * whole + [rest] * bool(rest):
            later._pass(steps / PHYSICS_HZ)
        later.time_s = self.time_s + physics_steps / PHYSICS_HZ
        return later

    def remember(self, frame: np.ndarray) -> None:
        """Take in the newest frame, shape (34,); the first one of an episode also stands for those before it."""
        missing = (self.frames.maxlen or 0) - len(self.frames)
        self.frames.extend([frame] * missing)
        self.frames.appendleft(frame)

    def inform(self, state: RobotState, readings: Mapping[str, np.ndarray], control_s: float) -> None:
        """Tell the state's source what a reset or step has led to.

        Args:
            state: the true one.
            readings: the proprioceptive parts of the observation by name.
            control_s: the control period [s].
        """
        if self.steps == 0:
            self.state_source.begin(state, readings)
        else:
            self.state_source.advance(readings, control_s)

    def change_command(self, command: np.ndarray) -> None:
        """Ask for another (vx [m/s], vy [m/s], yaw rate [rad/s]), shape (3,)."""
        self.command = command

    def change_task(self, task: Task, phase: float | None) -> None:
        """Change the task: at once to a phase, or with None to phase 0 as soon as the present gait can be left.

        With None, a task that is present already goes on as it is, a robot that is too fast for a change slows down in
        the present one first, and one that has changed just now finds its feet first.
        """
        if phase is not None:
            self._begin(task, phase, -np.inf)
            return
        self.gait_change = None if task == self.task else GaitChange(self.task, task, self.task_since_s)
        if self.gait_change is not None and self.gait_change.begins_at_once(self.filtered_command, self.time_s):
            self._begin(task, 0.0, self.time_s)

    def change_gait(self, gait: Gait, slew_s: float) -> None:
        """Change the gait of the task "any_gait".

        Args:
            gait: the new one.
            slew_s: how long the old one takes to become it [s]; with 0 it begins at once, at the phase that fits best,
                or at rest if it can rest where the old one does.
        """
        resting = is_standing(self.task.gait, self.phase, self.filtered_command) and gait.can_stand
        phase = 0.0 if resting else fitting_phase(self.task.gait, self.phase, gait)
        if slew_s > 0:
            self.gait_slew = GaitSlew(self.task.gait, gait, self.time_s, slew_s, phase - self.phase)
        else:
            self._begin(any_gait_task(gait), phase, -np.inf)

    def _begin(self, task: Task, phase: float, since_s: float) -> None:
        self.task, self.phase, self.gait_change, self.task_since_s = task, phase, None, since_s
        self.gait_slew = None

    # -- Its reports ---------------------------------------------------------------------------------------------------

    def rewards(self, state: RobotState, torque: np.ndarray, ended: str) -> dict[str, float]:
        """The reward terms of the step that led to a state.

        Args:
            state: the true one, now.
            torque: of the joints [N m], shape (12,).
            ended: why the episode is over; after "unstable" nothing measured means anything and all terms are 0.
        """
        if ended == "unstable":
            return no_reward()
        weights, height = self.task.reward, float(state.position_w[2])
        return reward_terms(weights, self.filtered_command, state.base_velocity, state.gravity_b, height, torque)

    def info(self, state: RobotState, terms: dict[str, float], ended: str) -> dict[str, Any]:
        """What `reset` and `step` report; nothing in it is shared with the episode.

        Args:
            state: the true one, now.
            terms: of the reward.
            ended: why the episode is over; "" while it goes on.
        """
        return {
            "task": self.task.name,
            "command": self.command.copy(),
            "filtered_command": self.filtered_command.copy(),
            "base_velocity": np.nan_to_num(state.base_velocity),
            "contacts": state.contacts.copy(),
            "phase": self.phase,
            "gait": self.task.gait.numbers,
            "standing": state.standing,
            "reward_terms": terms,
            "fallen": ended in ("fall", "unstable"),
            "ended": ended,
        }


# -- Its beginning -----------------------------------------------------------------------------------------------------


def begin_episode(
    config: EnvConfig,
    simulation: Simulation,
    rng: np.random.Generator,
    task: str | None = None,
    command: np.ndarray | None = None,
    gait: Gait | None = None,
) -> Episode:
    """Stand the robot up, let it settle, and begin an episode there.

    Args:
        config: the environment's.
        simulation: is reset; gets its physics if there is a randomization, and keeps them otherwise.
        rng: of everything that is drawn. It gives as many numbers whatever was asked for, one of them for the estimator
            noise, one for encoder offsets and one for the randomization, if there are any.
        task: name of the task; None draws one.
        command: (vx [m/s], vy [m/s], yaw rate [rad/s]), shape (3,); None takes the one that is drawn.
        gait: of the task "any_gait"; None draws one, from a generator of its own.
    """
    chosen = TASKS[task or str(rng.choice(config.tasks))]
    if chosen.name == ANY_GAIT and config.gaits is not None:
        drawn_gait = config.gaits.draw(_stream(rng))
        chosen = any_gait_task(drawn_gait if gait is None else gait)
    drawn = chosen.draw_command(rng)
    joint_noise = rng.uniform(-RESET_JOINT_NOISE, RESET_JOINT_NOISE, len(robot.JOINTS))
    source, conditions = _state_source(config, rng), _conditions(config, rng)
    if config.randomization is not None:
        simulation.set_physics_params(conditions.physics)
    simulation.reset(robot.HOME_POSE + joint_noise)
    simulation.settle(robot.HOME_POSE, round(conditions.settle_s * PHYSICS_HZ))
    return Episode(
        chosen,
        drawn if command is None else command,
        deque(maxlen=config.history),
        sensor_noise=config.noise if conditions.noise is None else config.scaled_noise(conditions.noise),
        sensor_faults=SensorFaults.of(conditions.sensors, config.control_hz),
        state_source=source,
    )


def _conditions(config: EnvConfig, rng: np.random.Generator) -> EpisodeConditions:
    sensors = config.sensors.drawn(_stream(rng)) if config.sensors.is_drawn else config.sensors
    own = EpisodeConditions(config.physics, sensors, settle_s=config.settle_s)
    return own if config.randomization is None else config.randomization.draw(_stream(rng), own)


def _stream(rng: np.random.Generator) -> np.random.Generator:
    """A generator of its own for what takes many numbers, so that the given one gives a single number."""
    return np.random.default_rng(int(rng.integers(2**63)))


def _state_source(config: EnvConfig, rng: np.random.Generator) -> StateSource:
    if config.estimator_noise is not None:
        return EstimatorError(config.estimator_noise, int(rng.integers(2**63)))
    if config.state_estimator is not None:
        return StateEstimator(config.state_estimator)
    return TrueState()


# -- Its end -----------------------------------------------------------------------------------------------------------


def how_it_ended(state: RobotState, stable: bool, time_is_up: bool) -> str:
    """Why an episode is over: "unstable", "fall" or "time"; "" while it goes on.

    Args:
        state: the robot now.
        stable: False once the physics has diverged.
        time_is_up: whether the episode has had its length.
    """
    if not stable:
        return "unstable"
    if state.position_w[2] < FALLEN_HEIGHT or -state.gravity_b[2] < FALLEN_COSINE:
        return "fall"
    return "time" if time_is_up else ""
