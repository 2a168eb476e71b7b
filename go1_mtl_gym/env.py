"""The Gymnasium environment of the Go1."""

import copy
from numbers import Integral
from typing import Any

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from numpy.typing import ArrayLike

from go1_mtl_gym.actuation import PHYSICS_HZ, ActionMap
from go1_mtl_gym.contract import PolicyContract
from go1_mtl_gym.deprecation import renamed_attribute
from go1_mtl_gym.env_config import RENDER_MODES, EnvConfig
from go1_mtl_gym.episode import Episode, begin_episode, how_it_ended
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.expert import Expert, make_expert
from go1_mtl_gym.gaits import Gait, check_phase
from go1_mtl_gym.privileged import privileged_state
from go1_mtl_gym.registration import register_task
from go1_mtl_gym.rewards import no_reward
from go1_mtl_gym.sensing.sensor_faults import Reading
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.sensors import frame, measure, robot_state
from go1_mtl_gym.sim.physics_params import PhysicsParams
from go1_mtl_gym.sim.simulation import Simulation
from go1_mtl_gym.tasks import ANY_GAIT, TASKS, Task, check_gait, check_reset_options
from go1_mtl_gym.validation import finite_vector, number_in, one_of

MAX_SLEW_S = 60.0
"""For which a gait may be on its way to another one [s]."""


class Go1Env(gymnasium.Env[np.ndarray, np.ndarray]):
    """A Unitree Go1 that moves in the gait of a task, as told by a command.

    Without arguments it is what the policy in the package drives, and what reinforcement learning can learn. With
    ``channels=(), history=1`` it shows the 34 + K numbers of arXiv 2505.08574, which hold neither command nor phase.

    ## Action space

    ``Box(-1, 1, (12,), float32)``: joint targets, center + half_range * action (`action_map`); 0 is the standing pose.
    The actuators apply tau = kp (target - q) - kd v at 1 kHz, clipped at 23.7, 23.7 and 35.55 N m.

    | num         | joint of FL, FR, RL, RR | center [rad] | half range at kp 50, kd 2 [rad] |
    |-------------|-------------------------|--------------|---------------------------------|
    | 0, 3, 6, 9  | hip                     | 0.0          | 2.541                           |
    | 1, 4, 7, 10 | thigh                   | 0.9          | 5.279                           |
    | 2, 5, 8, 11 | calf                    | -1.8         | 2.531                           |

    ## Observation space

    A flat float32 ``Box``, by default of 149 numbers; `layout` names the slices, whatever the arguments.

    | num     | part           | unit            | bounds +-    | there                                          |
    |---------|----------------|-----------------|--------------|------------------------------------------------|
    | 0 - 2   | accelerometer  | m/s^2           | 160          | always; specific force, trunk frame            |
    | 3 - 5   | gyroscope      | rad/s           | 35           | always; trunk frame                            |
    | 6 - 17  | q              | rad             | 2 pi         | always                                         |
    | 18 - 29 | dq             | rad/s           | 90.3, 60.2   | always                                         |
    | 30 - 33 | contacts       | 0 or 1          | 0 ... 1      | always; FL FR RL RR                            |
    | 34 - 36 | command        | m/s, m/s, rad/s | 5            | channel, by default; filtered                  |
    |         | gravity        | -               | 1            | channel; unit vector, trunk frame              |
    | 37 - 38 | phase          | -               | 1            | channel, by default; sine and cosine           |
    | 39 - 50 | last_action    | -               | 1            | channel, by default                            |
    | 51 - 74 | leg_kinematics | m, m/s          | 1, 40        | channel, by default; of the readings above     |
    |         | gait           | mixed           |              | channel; clocks of the legs, figures of a gait |
    |         | history        | as above        | as above     | if `history` > 1: 34 numbers per older frame   |
    | 75 - 80 | task           | 0 or 1          | 0 ... 1      | always; one-hot, K = len(tasks)                |

    `leg_kinematics` is where the feet are and what each says of the trunk's velocity if it stands still, in the trunk
    frame (`go1_mtl_gym.kinematics.leg_kinematics`).

    ## Rewards

    Tracking of velocity and yaw rate, posture, effort, alive (`go1_mtl_gym.rewards.reward_terms`), weighted by the
    task; itemised in ``info["reward_terms"]``.

    ## Episodes

    Start standing at phase 0 of the gait clock, joints within 0.03 rad of the home pose, settled for `settle_s`.
    Terminate on a fall (trunk below 0.14 m, or tilted by more than 60 degrees) or when the physics diverges. Truncate
    after `episode_s`.

    ``info``: task, command, filtered_command, base_velocity (vx, vy, yaw rate in the heading frame), contacts, phase,
    gait (`Gait.numbers`), standing, reward_terms, fallen, ended ("", "fall", "unstable" or "time"). Keys, types and
    shapes are the same at reset, where all reward terms are 0, as at step; so recorders and vector environments can
    stack them.

    ## Arguments

    An `EnvConfig`, or its attributes as keyword arguments; and the fields of `PhysicsParams`, such as ``friction=0.5``.
    With ``privileged=True`` its expert is told of them, and looks as far ahead as the actions are delayed.
    Faults of the readings are given together, ``sensors={"encoder_offset": 0.03, "delay_s": 0.01}``.

    ## Version history

    * v0: first. Since package 0.2, action 0 stands and the defaults are the policy's; 0.1 had ``channels=()``, all
      registered tasks, and a crouch at action 0.

    Raises:
        InvalidInputError: if an argument is not as described.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 50}

    def __init__(self, task: EnvConfig | str | None = "trot", **arguments: object) -> None:
        """Make the environment; see the class."""
        if isinstance(task, EnvConfig) and arguments:
            raise InvalidInputError(f"an EnvConfig says everything; beside it came {', '.join(arguments)}")
        self._build(task if isinstance(task, EnvConfig) else EnvConfig.from_arguments(task=task, **arguments))

    def _build(self, config: EnvConfig) -> None:
        self.config = config
        self.metadata = type(self).metadata | {"render_fps": config.control_hz}  # whoever records reads it here
        self.tasks = config.tasks
        self.control_hz, self.control_s = config.control_hz, config.control_s
        self.gains = config.gains
        self.action_map = ActionMap.for_gains(self.gains)
        self.layout = config.layout
        self.observation_space = Box(self.layout.low, self.layout.high, dtype=np.float32)
        self.action_space = Box(-1.0, 1.0, (12,), dtype=np.float32)
        self.render_mode = config.render_mode
        self._spec: EnvSpec | None = None
        self._simulation = Simulation(self.gains, config.physics, config.robot)
        self._episode: Episode | None = None
        self._expert: Expert | None = None
        self._renderer: Any = None

    # -- Gymnasium ---------------------------------------------------------------------------------------------------

    @property
    def spec(self) -> EnvSpec | None:
        """What `gymnasium.make` made the environment from, and as its `max_episode_steps` the steps of an episode.

        The environment truncates its episodes itself, after `episode_s`; so the registered ids bring no time limit.
        """
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = copy.copy(spec)
        if self._spec is not None:
            self._spec.max_episode_steps = self.config.episode_steps

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode from a stand.

        Args:
            seed: of everything random in this environment.
            options: any of ``command`` (vx, vy, yaw rate; otherwise drawn from the task's range), ``task`` (a name;
                otherwise the environment's own, or a drawn one) and, for the task "any_gait", ``gait`` (a `Gait`;
                otherwise drawn).

        Raises:
            InvalidInputError: for an unknown option, task, gait or impossible command; the running episode is left as
                it is.
        """
        name, command, gait = check_reset_options(options, self.tasks, self.config.task)
        super().reset(seed=int(seed) if isinstance(seed, Integral) else seed)
        self._episode = begin_episode(self.config, self._simulation, self.np_random, name, command, gait)
        state = self.state
        observation = self._observe(self._episode, state, self._simulation.read())
        if self._expert is not None:
            self._expert.reset(self.estimated_state)
        if self.render_mode == "human":
            self.render()
        return observation, self._episode.info(state, no_reward(), "")

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold one action for a control period.

        Args:
            action: shape (12,); entries beyond [-1, 1] are clipped.

        Raises:
            InvalidInputError: if the action is not 12 finite numbers; nothing is stepped.
            gymnasium.error.ResetNeeded: before the first `reset`.
        """
        episode = self._running("step")
        applied = np.clip(finite_vector(action, 12, "action"), -1.0, 1.0)
        target, early = self.action_map.to_radians(applied), episode.sensor_faults.early
        reading = self._simulation.step_and_read(target, PHYSICS_HZ // self.control_hz, early)
        episode.advance(applied, self.control_s)
        state = self.state
        ended = how_it_ended(state, self._simulation.stable, episode.steps >= self.config.episode_steps)
        terms = episode.rewards(state, self._simulation.torque, ended)
        observation = self._observe(episode, state, reading)
        if self.render_mode == "human":
            self.render()
        terminated = ended in ("fall", "unstable")
        return observation, sum(terms.values()), terminated, ended == "time", episode.info(state, terms, ended)

    def _observe(self, episode: Episode, state: RobotState, reading: Reading) -> np.ndarray:
        """The observation that a reset or step has led to, once the episode has taken it in."""
        arriving = episode.sensor_faults.observe(reading)
        parts = measure(
            arriving,
            state,
            episode.last_action,
            episode.sensor_noise,
            self.np_random,
            self.layout.channels,
            self.control_s,
        )
        episode.remember(frame(parts))
        observation = self.layout.flatten(parts, episode.older_frames, self.tasks.index(episode.task.name))
        if self._simulation.stable:
            episode.inform(state, self.layout.proprioception(observation), self.control_s)
        return observation

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """Draw the robot, its feet's contacts and its command; an RGB array (height, width, 3) in "rgb_array" mode."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() does nothing: the environment was made without a render_mode")
            return None
        self._running("render")
        if self._renderer is None:
            from go1_mtl_gym import rendering

            kind = rendering.Viewer if self.render_mode == "human" else rendering.Camera
            self._renderer = kind(self._simulation, self.config.width, self.config.height, self.control_hz)
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
        gaits = [None if name == ANY_GAIT else TASKS[name].gait for name in self.tasks]
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

    realism = renamed_attribute("Go1Env.realism", "physics_params")

    @property
    def simulation(self) -> Simulation:
        """The robot in MuJoCo, for experiments with its model."""
        return self._simulation

    @property
    def state(self) -> RobotState:
        """The robot, its clock and its command, now, as they truly are; a copy, to be read."""
        now = self._running("state")
        return robot_state(self._simulation, now.task.gait, now.phase, now.filtered_command, now.time_s)

    @property
    def estimated_state(self) -> RobotState:
        """All that an expert may read, now: `state`, with `estimator_noise` or as the `state_estimator` has it.

        In a privileged environment it tells how the robot differs from the model, and is the state in which an action
        chosen now will take effect.
        """
        episode = self._running("estimated_state")
        if not self.config.privileged:
            return episode.state_source.estimate(self.state)
        told = privileged_state(self._simulation, episode, PHYSICS_HZ // self.control_hz)
        return episode.state_source.estimate(told)

    def expert_action(self) -> np.ndarray:
        """The expert's action for the `estimated_state`, float32, shape (12,). Changes nothing, here or later.

        Raises:
            InvalidInputError: if the expert is made for other gains or another control period.
        """
        state = self.estimated_state
        if self._expert is None:
            expert = make_expert(self.config.expert, self.gains, self.control_s)
            expert.reset(state)
            self._expert = expert
        target = finite_vector(self._expert.action(state), 12, "the expert's action [rad]")
        return self.action_map.from_radians(target).astype(np.float32)

    def set_task(self, task: str, phase: float | None = None, command: ArrayLike | None = None) -> None:
        """Change the task while running.

        Args:
            task: name of the new one.
            phase: of its gait [cycles], in [0, 1), at once; None lets it begin at phase 0, at once but for three cases:
                gaits that leave the ground with all feet go on until the middle of their stance
                (`Gait.change_phase`), a robot that is faster than half of either task's `command_range` slows down
                first, and a task that was changed to goes on for a second.
            command: that is asked for from now on, as in `set_command`; None: the present one goes on.

        Raises:
            InvalidInputError: if the task is unknown here or does not allow the command, or the phase is none; nothing
                is changed then.
        """
        episode = self._running("set_task")
        new, asked = TASKS[one_of(task, self.tasks, "task")], episode.requested_task
        if new.name == asked.name == ANY_GAIT:  # which goes on with the gait that it has
            new = asked
        command = new.check_command(episode.command if command is None else command)
        episode.change_task(new, None if phase is None else check_phase(phase))
        episode.change_command(command)

    def set_gait(self, gait: Gait, slew_s: float = 0.0, command: ArrayLike | None = None) -> None:
        """Change the gait while the task is "any_gait".

        Args:
            gait: the new one, whether or not it lies in the space that gaits are drawn from.
            slew_s: how long the present gait takes to become it, figure by figure [s]; with 0 it begins at once, at the
                phase that is nearest to where the feet are.
            command: that is asked for from now on, as in `set_command`; None: the present one goes on.

        Raises:
            InvalidInputError: if it is no gait, another task is asked for, or the command is impossible; nothing is
                changed then.
        """
        episode = self._running("set_gait")
        check_gait(gait, episode.requested_task.name)
        slew_s = number_in(slew_s, 0.0, MAX_SLEW_S, "slew_s [s]")
        command = episode.requested_task.check_command(episode.command if command is None else command)
        episode.change_gait(gait, slew_s)
        episode.change_command(command)

    def set_command(self, command: ArrayLike) -> None:
        """Ask for another (vx [m/s], vy [m/s], yaw rate [rad/s]); it is low-passed before expert and student see it.

        Raises:
            InvalidInputError: if it is not three finite numbers within the task's `command_limit`.
        """
        episode = self._running("set_command")
        episode.change_command(episode.requested_task.check_command(command))

    def push(self, delta_velocity_w: ArrayLike) -> None:
        """Push the trunk: add to its linear velocity [m/s], world frame, shape (3,).

        Raises:
            InvalidInputError: if it is not three finite numbers.
        """
        self._running("push")
        self._simulation.push(finite_vector(delta_velocity_w, 3, "push (change of velocity)"))

    def _running(self, use: str) -> Episode:
        if self._episode is None:
            raise ResetNeeded(f"call reset() before {use}")
        return self._episode

    # -- Copies ------------------------------------------------------------------------------------------------------

    def __getstate__(self) -> dict[str, Any]:
        """Configuration and running state; a copy continues to the bit, without the original's window or expert."""
        return {
            "registered": tuple(TASKS[name] for name in self.tasks),
            "config": self.config,
            "episode": copy.deepcopy(self._episode),
            "snapshot": self._simulation.snapshot(),
            "spec": self.spec,
            "spaces": copy.deepcopy((self.observation_space, self.action_space)),  # with their generators
            "np_random": copy.deepcopy(self._np_random),
            "np_random_seed": getattr(self, "_np_random_seed", None),
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Build the environment anew, and bring it where the original was."""
        for task in state["registered"]:  # another process may not know them yet
            register_task(task)
        self._build(state["config"])
        self._simulation.restore(state["snapshot"])
        self.spec = state["spec"]
        self.observation_space, self.action_space = state["spaces"]
        self._np_random = state["np_random"]
        self._np_random_seed = state["np_random_seed"]
        self._episode = state["episode"]
