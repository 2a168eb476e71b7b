"""The Gymnasium environment of the Go1."""

import copy
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box

from go1_mtl_gym import arguments, robot
from go1_mtl_gym.actuation import ActionMap, PDGains
from go1_mtl_gym.contract import PolicyContract
from go1_mtl_gym.episode import Episode
from go1_mtl_gym.expert import DEFAULT_EXPERT, check_expert, check_expert_fits, load_expert
from go1_mtl_gym.registration import register_task
from go1_mtl_gym.sensing.observation import ObservationLayout, SensorNoise
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.sensing.state_estimator import StateEstimatorConfig
from go1_mtl_gym.sensing.state_noise import EstimatorNoise
from go1_mtl_gym.sensors import Observer
from go1_mtl_gym.sim.domain_randomization import DomainRandomization
from go1_mtl_gym.sim.physics_params import PhysicsParams
from go1_mtl_gym.sim.simulation import PHYSICS_HZ, Simulation
from go1_mtl_gym.tasks import TASKS, Task, check_task_names
from go1_mtl_gym.termination import how_it_ended
from go1_mtl_gym.validation import finite_vector, number_in, one_of

RESET_JOINT_NOISE = 0.03
"""Largest deviation of a joint from the home pose after a reset [rad]."""


class Go1Env(gymnasium.Env):
    """A Unitree Go1 that moves in the gait of a task, as told by a command.

    Observation: a flat float32 Box of 34 raw proprioceptive numbers, the channels asked for, and the one-hot task id;
    the table is in `go1_mtl_gym.sensing.observation`.

    Action: Box(-1, 1, (12,)), an affine map (`action_map`) of 12 desired joint positions, legs FL FR RL RR, joints hip
    thigh calf. Actuators apply tau = kp (a - q) - kd v at 1 kHz, clipped at 23.7, 23.7, 35.55 N m.

    Reward: velocity and yaw rate tracking, posture, effort, alive; itemised in ``info["reward_terms"]``.

    Episode: starts standing at phase 0 of the gait clock; terminates on a fall (trunk below 0.14 m or tilted by more
    than 60 degrees) or when the physics diverges; truncates after `episode_s`.

    Info: task, command, filtered_command (seen by expert and student), base_velocity (vx, vy, yaw rate in the heading
    frame), contacts, phase, standing, reward_terms, fallen, ended ("", "fall", "unstable" or "time").

    Version history: v0, first.

    Args:
        task: name of the task, or None to draw one per episode.
        tasks: names of the tasks in the one-hot id, in order; None means all that are registered now.
        channels: optional parts of the observation: "command", "gravity", "phase", "last_action".
        history: number of proprioceptive frames in the observation.
        control_hz: rate of `step` [Hz]; a divisor of 1000 from 50 to 1000.
        kp, kd: stiffness [N m/rad] and damping [N m s/rad] of the actuators.
        noise: True for the default `SensorNoise`, or one of your own; None for exact sensors.
        estimator_noise: True for the default `EstimatorNoise`, or one of your own: the expert then sees
            `estimated_state`; None shows it the true state.
        state_estimator: True for the default `StateEstimatorConfig`, or one of your own: the expert then sees what a
            filter makes of the observation's own readings; for a `control_hz` of some hundreds, no `estimator_noise`.
        randomization: True for the default `DomainRandomization` of physics and sensor noise, drawn at every reset, or
            one of your own.
        episode_s: length of an episode [s].
        expert: ``"module:Class"`` or a callable; called with ``gains=PDGains, hold_s=control period`` on first use,
            must give an object with ``reset(state)`` and ``action(state)``, which returns 12 joint targets [rad] for a
            `RobotState`.
        render_mode, width, height: None, "human" or "rgb_array", and the size of the picture [pixels].
        physics_params: differences from the expert's model: ``friction=``, ``payload_kg=`` and the other fields of
            `PhysicsParams`.

    Raises:
        InvalidInputError: if an argument is not as described.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["human", "rgb_array"], "render_fps": 50}

    def __init__(
        self,
        task: str | None = "trot",
        *,
        tasks: Sequence[str] | None = None,
        channels: Sequence[str] = (),
        history: int = 1,
        control_hz: int = 50,
        kp: float = 50.0,
        kd: float = 2.0,
        noise: SensorNoise | bool | None = None,
        estimator_noise: EstimatorNoise | bool | None = None,
        state_estimator: StateEstimatorConfig | bool | None = None,
        randomization: DomainRandomization | bool | None = None,
        episode_s: float = 30.0,
        expert: str | Callable[..., Any] = DEFAULT_EXPERT,
        render_mode: str | None = None,
        width: int = 640,
        height: int = 480,
        **physics_params: float | None,
    ) -> None:
        given = {name: value for name, value in locals().items() if name not in ("self", "__class__", "physics_params")}
        self._arguments = given | physics_params
        self.tasks = self._arguments["tasks"] = check_task_names(tuple(TASKS) if tasks is None else tasks)
        if task is not None:
            one_of(task, self.tasks, "task")
        self.control_hz = arguments.check_control_hz(control_hz)
        arguments.check_rendering(render_mode, self.metadata["render_modes"], width, height)
        self.control_s = 1.0 / self.control_hz
        self.gains = PDGains(kp, kd)
        self.action_map = ActionMap.for_gains(self.gains)
        self.layout = ObservationLayout(self.tasks, channels, history)
        self.observation_space = Box(self.layout.low, self.layout.high, dtype=np.float32)
        self.action_space = Box(-1.0, 1.0, (12,), dtype=np.float32)
        self.render_mode = render_mode
        self._observer = Observer(self.layout, self.tasks, self.control_s)
        self._episode_steps = round(number_in(episode_s, self.control_s, 1e6, "episode_s") * self.control_hz)
        self._conditions = arguments.check_conditions(given, physics_params)
        self._simulation = Simulation(self.gains, self._conditions.physics_params)
        self._make_expert = check_expert(expert)
        self._expert: Any = None
        self._renderer: Any = None
        self._episode: Episode | None = None

    # -- Gymnasium ---------------------------------------------------------------------------------------------------

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict]:
        """Begin an episode from a stand.

        Args:
            seed: of everything random in this environment.
            options: any of ``command`` (vx, vy, yaw rate; otherwise drawn from the task's range) and ``task`` (a name;
                otherwise the environment's own, or a drawn one).

        Raises:
            InvalidInputError: for an unknown option, task or impossible command; the running episode is left as it is.
        """
        name, command = arguments.check_reset_options(options, self.tasks, self._arguments["task"])
        super().reset(seed=seed)
        task = TASKS[name or str(self.np_random.choice(self.tasks))]
        drawn = task.draw_command(self.np_random)
        command = drawn if command is None else command
        home = self.action_map.from_radians(robot.HOME_POSE)
        self._episode = Episode(task, command, home, deque(maxlen=self.layout.history - 1))
        joint_noise = self.np_random.uniform(-RESET_JOINT_NOISE, RESET_JOINT_NOISE, 12)
        self._conditions.begin(self._episode, self._simulation, self.np_random)
        self._simulation.reset(robot.HOME_POSE + joint_noise)
        observation = self._observer.observe(self._simulation, self.state, self._episode, self.np_random)
        if self._expert is not None:
            self._expert.reset(self.estimated_state)
        if self.render_mode == "human":
            self.render()
        return observation, self._episode.info(self.state, {}, "")

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Hold one action for a control period.

        Args:
            action: shape (12,); entries beyond [-1, 1] are clipped.

        Raises:
            InvalidInputError: if the action is not 12 finite numbers; nothing is stepped.
            gymnasium.error.ResetNeeded: before the first `reset`.
        """
        episode = self._running("step")
        episode.last_action = np.clip(finite_vector(action, 12, "action"), -1.0, 1.0)
        self._simulation.step(self.action_map.to_radians(episode.last_action), PHYSICS_HZ // self.control_hz)
        episode.advance(self.control_s)
        state = self.state
        ended = how_it_ended(state, self._simulation.stable, episode.steps >= self._episode_steps)
        terms = episode.rewards(state, self._simulation.torque, ended)
        observation = self._observer.observe(self._simulation, state, episode, self.np_random)
        if self.render_mode == "human":
            self.render()
        terminated = ended in ("fall", "unstable")
        return observation, sum(terms.values()), terminated, ended == "time", episode.info(state, terms, ended)

    def render(self) -> np.ndarray | None:
        """Draw the robot, its feet's contacts and its command; an RGB array (height, width, 3) in "rgb_array" mode."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() does nothing: the environment was made without a render_mode")
            return None
        self._running("render")
        if self._renderer is None:
            from go1_mtl_gym import rendering

            kind = rendering.Viewer if self.render_mode == "human" else rendering.Camera
            self._renderer = kind(self._simulation, self._arguments["width"], self._arguments["height"])
        return self._renderer.draw(self.state)

    def close(self) -> None:
        """Free the renderer; may be called twice."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    # -- What is particular to the Go1 -------------------------------------------------------------------------------

    @property
    def contract(self) -> PolicyContract:
        """What gives the numbers of observations and actions here their meaning."""
        gaits = [TASKS[name].gait for name in self.tasks]
        return PolicyContract.of_environment(self.layout, gaits, self.control_hz, self.gains, self.action_map)

    @property
    def task(self) -> Task:
        """The present task."""
        return self._running("task").task

    @property
    def requested_task(self) -> Task:
        """The task that was asked for last; the present one unless `set_task` waits for the end of a flight."""
        return self._running("requested_task").requested_task

    @property
    def command(self) -> np.ndarray:
        """The command as asked for (vx [m/s], vy [m/s], yaw rate [rad/s]), shape (3,)."""
        return self._running("command").command.copy()

    @property
    def physics_params(self) -> PhysicsParams:
        """What is different about the physics now."""
        return self._simulation.physics_params

    @property
    def simulation(self) -> Simulation:
        """The robot in MuJoCo, for experiments with its model."""
        return self._simulation

    @property
    def state(self) -> RobotState:
        """The robot, its clock and its command, now, as they truly are."""
        return self._observer.state(self._simulation, self._running("state"))

    @property
    def estimated_state(self) -> RobotState:
        """All that an expert may read, now: `state`, with `estimator_noise` or as the `state_estimator` has it."""
        return self._running("estimated_state").estimated(self.state)

    def expert_action(self) -> np.ndarray:
        """The expert's action for the `estimated_state`, float32, shape (12,). Changes nothing, here or later."""
        state = self.estimated_state
        if self._expert is None:
            self._expert = load_expert(self._make_expert)(gains=self.gains, hold_s=self.control_s)
            check_expert_fits(self._expert, self.gains, self.control_s)
            self._expert.reset(state)
        return self.action_map.from_radians(self._expert.action(state)).astype(np.float32)

    def set_task(self, task: str, phase: float | None = None) -> None:
        """Change the task while running; the command goes on.

        Args:
            task: name of the new one.
            phase: of its gait [cycles], in [0, 1), at once; None lets it begin at phase 0, at once but for gaits that
                leave the ground with all feet: those go on until the middle of their stance (`Gait.change_phase`).

        Raises:
            InvalidInputError: if the task is unknown here, does not allow the present command, or the phase is none.
        """
        episode = self._running("set_task")
        new = TASKS[one_of(task, self.tasks, "task")]
        new.check_command(episode.command)
        episode.change_task(new, None if phase is None else arguments.check_phase(phase))

    def set_command(self, command: Sequence[float]) -> None:
        """Ask for another (vx [m/s], vy [m/s], yaw rate [rad/s]); it is low-passed before expert and student see it.

        Raises:
            InvalidInputError: if it is not three finite numbers within the task's `command_limit`.
        """
        episode = self._running("set_command")
        episode.command = episode.requested_task.check_command(command)

    def push(self, delta_velocity_w: Sequence[float]) -> None:
        """Kick the trunk: add to its linear velocity [m/s], world frame, shape (3,).

        Raises:
            InvalidInputError: if it is not three finite numbers.
        """
        self._running("push")
        self._simulation.push(finite_vector(delta_velocity_w, 3, "push (change of velocity)"))

    def _running(self, what: str) -> Episode:
        if self._episode is None:
            raise ResetNeeded(f"call reset() before {what}")
        return self._episode

    # -- Copies ------------------------------------------------------------------------------------------------------

    def __getstate__(self) -> dict[str, Any]:
        """Arguments and running state; a copy continues to the bit, without the original's window or expert."""
        return {
            "registered": tuple(TASKS[name] for name in self.tasks),
            "arguments": self._arguments,
            "episode": copy.deepcopy(self._episode),
            "snapshot": self._simulation.snapshot(),
            "np_random": copy.deepcopy(self._np_random),
            "np_random_seed": getattr(self, "_np_random_seed", None),
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        for task in state["registered"]:  # another process may not know them yet
            register_task(task)
        self.__init__(**state["arguments"])
        self._simulation.restore(state["snapshot"])
        self._np_random = state["np_random"]
        self._np_random_seed = state["np_random_seed"]
        self._episode = state["episode"]
