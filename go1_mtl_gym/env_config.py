"""Everything that an environment can be asked for, as one immutable, validated value."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any

from go1_mtl_gym.actuation import PHYSICS_HZ, PDGains
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.expert import DEFAULT_EXPERT, check_expert
from go1_mtl_gym.gait_space import GaitSpace
from go1_mtl_gym.sensing.observation import ObservationLayout, SensorNoise
from go1_mtl_gym.sensing.sensor_faults import SensorParams
from go1_mtl_gym.sensing.state_estimator import StateEstimatorConfig
from go1_mtl_gym.sensing.state_noise import EstimatorNoise
from go1_mtl_gym.sim.domain_randomization import SETTLE_S, DomainRandomization
from go1_mtl_gym.sim.physics_params import PhysicsParams
from go1_mtl_gym.tasks import ANY_GAIT, BUILT_IN_TASKS, check_task_names
from go1_mtl_gym.validation import integer_in, number_in, one_of, parameters_of, switch, yes_or_no

DEFAULT_TASKS = BUILT_IN_TASKS
"""What an environment knows unless told otherwise, besides its own task: the tasks of the policy in the package."""
DEFAULT_CHANNELS = ("command", "phase", "last_action", "leg_kinematics")
"""What an environment shows unless told otherwise: the channels that the policy in the package sees."""
ANY_GAIT_CHANNELS = ("command", "last_action", "leg_kinematics", "gait")
"""The same where the gait can be any."""
DEFAULT_HISTORY = 3
"""Frames that an environment shows unless told otherwise."""
RENDER_MODES = ("human", "rgb_array")
PIXELS = (16, 4096)
"""Smallest and largest width and height of a picture [pixels]."""
EXPERT_ONLY = ("estimator_noise", "state_estimator", "privileged")
"""Arguments of `go1_mtl_gym.Go1Env` that only its expert notices."""
_SWITCHES: Mapping[str, type] = {
    "noise": SensorNoise,
    "estimator_noise": EstimatorNoise,
    "state_estimator": StateEstimatorConfig,
    "randomization": DomainRandomization,
    "gaits": GaitSpace,
}


@dataclass(frozen=True, kw_only=True)
class EnvConfig:
    """What an environment is made from: ``Go1Env(EnvConfig(...))``.

    Equal environments have equal configurations: whatever was given is brought into one form, of Python's own numbers,
    tuples and strings, so that a configuration can be compared, hashed, pickled and written to JSON.

    Attributes:
        task: name of the task, or None to draw one per episode.
        tasks: names of the tasks in the one-hot id, in order; None means `DEFAULT_TASKS` and, if it is none of them,
            `task` at the end.
        channels: optional parts of the observation, from `go1_mtl_gym.sensing.observation.CHANNELS`, in that order;
            None means `DEFAULT_CHANNELS`, and for the task "any_gait" `ANY_GAIT_CHANNELS`.
        history: number of proprioceptive frames in the observation, 1 ... 50.
        control_hz: rate of `step` [Hz]; a divisor of 1000 from 50 to 1000.
        kp: stiffness of the actuators [N m/rad].
        kd: their damping [N m s/rad].
        noise: of the sensors; True is the default one, None and False are exact sensors, a dictionary holds its fields.
        estimator_noise: on the state that the expert sees; likewise.
        state_estimator: that tells the expert the state from the sensors; likewise, and not with `estimator_noise`.
        randomization: of physics and sensors at every reset; likewise.
        privileged: whether the expert is told how the robot differs from its model, `physics` and `randomization`
            included, and answers for the time at which its action takes effect; not with `state_estimator`.
        episode_s: length of an episode [s].
        expert: ``"module:name"`` or a callable; a class or function that can be imported becomes a string.
        render_mode: None, "human" or "rgb_array".
        width, height: of the picture [pixels].
        physics: differences from the expert's model.
        sensors: faults of the readings that are observed; the expert's state has none.
        settle_s: time for which the robot stands before the episode begins [s], rounded to milliseconds: under
            action 0, until joints and feet have given way.
        gaits: the `GaitSpace` that the task "any_gait" draws from; likewise, and the default one where that task is
            known.
        robot: path of an MJCF file of another Go1, or None for ours; the experts go on thinking of ours.

    Raises:
        InvalidInputError: if something is not as described.
    """

    task: str | None = "trot"
    tasks: tuple[str, ...] = None  # type: ignore[assignment]  # None never stays
    channels: tuple[str, ...] = None  # type: ignore[assignment]  # likewise
    history: int = DEFAULT_HISTORY
    control_hz: int = 50
    kp: float = 50.0
    kd: float = 2.0
    noise: SensorNoise | None = None
    estimator_noise: EstimatorNoise | None = None
    state_estimator: StateEstimatorConfig | None = None
    randomization: DomainRandomization | None = None
    episode_s: float = 30.0
    expert: str | Callable[..., Any] = DEFAULT_EXPERT
    render_mode: str | None = None
    width: int = 640
    height: int = 480
    physics: PhysicsParams = field(default_factory=PhysicsParams)
    sensors: SensorParams = field(default_factory=SensorParams)
    settle_s: float = 0.0
    privileged: bool = False
    gaits: GaitSpace | None = None
    robot: str | None = None

    def __post_init__(self) -> None:
        """Check everything, and bring it into its one form."""
        tasks = check_task_names(default_tasks(self.task) if self.tasks is None else self.tasks)
        channels = ANY_GAIT_CHANNELS if self.task == ANY_GAIT else DEFAULT_CHANNELS
        layout = ObservationLayout(tasks, channels if self.channels is None else self.channels, self.history)
        control_hz = check_control_hz(self.control_hz)
        gains = PDGains(self.kp, self.kd)
        self._set(
            task=None if self.task is None else one_of(self.task, tasks, "task"),
            tasks=tasks,
            channels=layout.channels,
            history=layout.history,
            control_hz=control_hz,
            kp=gains.kp,
            kd=gains.kd,
            **{name: switch(getattr(self, name), kind, name) for name, kind in _SWITCHES.items()},
            episode_s=number_in(self.episode_s, 1.0 / control_hz, 1e6, "episode_s"),
            expert=check_expert(self.expert),
            render_mode=None if self.render_mode is None else one_of(self.render_mode, RENDER_MODES, "render_mode"),
            width=integer_in(self.width, *PIXELS, "width [pixels]"),
            height=integer_in(self.height, *PIXELS, "height [pixels]"),
            physics=parameters_of(self.physics, PhysicsParams, "physics"),
            sensors=parameters_of(self.sensors, SensorParams, "sensors"),
            settle_s=number_in(self.settle_s, *SETTLE_S, "settle_s [s]"),
            privileged=yes_or_no(self.privileged, "privileged"),
            robot=_path(self.robot),
        )
        if ANY_GAIT in tasks and self.gaits is None:
            self._set(gaits=GaitSpace())
        self._check_together()

    def _set(self, **values: object) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _check_together(self) -> None:
        if self.estimator_noise is not None and self.state_estimator is not None:
            raise InvalidInputError(
                "estimator_noise stands for the errors of an estimator and state_estimator has its own: give one of "
                f"them, got {self.estimator_noise} and {self.state_estimator}"
            )
        if self.privileged and self.state_estimator is not None:
            raise InvalidInputError(
                "a privileged expert is told what a state_estimator has to find out: give one of them, got "
                f"{self.state_estimator}"
            )
        if self.gaits is not None and ANY_GAIT not in self.tasks:
            raise InvalidInputError(f"gaits are drawn for the task {ANY_GAIT!r}, which is not among {self.tasks}")
        if self.randomization is not None and self.randomization.noise is not None:
            self.scaled_noise(self.randomization.noise[1])  # refuses what could be drawn

    # -- What follows from it ------------------------------------------------------------------------------------------

    @property
    def control_s(self) -> float:
        """The control period [s]."""
        return 1.0 / self.control_hz

    @property
    def episode_steps(self) -> int:
        """Control periods until an episode is truncated."""
        return round(self.episode_s * self.control_hz)

    @property
    def gains(self) -> PDGains:
        """Of the actuators."""
        return PDGains(self.kp, self.kd)

    @property
    def layout(self) -> ObservationLayout:
        """Of the observation."""
        return ObservationLayout(self.tasks, self.channels, self.history)

    def scaled_noise(self, factor: float) -> SensorNoise:
        """The sensor noise, or the default one where there is none, times a factor.

        Raises:
            InvalidInputError: if a deviation then exceeds what `SensorNoise` allows.
        """
        return (self.noise or SensorNoise()).scaled(factor)

    # -- Its other forms -----------------------------------------------------------------------------------------------

    @classmethod
    def from_arguments(cls, **arguments: object) -> "EnvConfig":
        """The configuration that belongs to keyword arguments of `go1_mtl_gym.Go1Env`.

        Args:
            arguments: attributes of this class, and fields of `PhysicsParams`.

        Raises:
            InvalidInputError: for an unknown name, or a value that is not as described.
        """
        names, figures = _names(cls), _names(PhysicsParams)
        for name in arguments:
            one_of(name, (*names, *figures), "argument of Go1Env")
        given: dict[str, Any] = {name: value for name, value in arguments.items() if name in names}
        changed: dict[str, Any] = {name: value for name, value in arguments.items() if name in figures}
        if changed:
            base = parameters_of(given.get("physics", PhysicsParams()), PhysicsParams, "physics")
            given["physics"] = replace(base, **changed)
        return cls(**given)

    def as_arguments(self) -> dict[str, Any]:
        """Keyword arguments of `go1_mtl_gym.Go1Env` and `gymnasium.make` that give an equal configuration."""
        return {name: getattr(self, name) for name in _names(type(self))}

    def as_dict(self) -> dict[str, Any]:
        """JSON values, nested as this is.

        Raises:
            InvalidInputError: if the expert is a callable that a file cannot name.
        """
        if not isinstance(self.expert, str):
            raise InvalidInputError(
                f"the expert {self.expert!r} cannot be written to a file: give a class or function at the top level of "
                'a module that can be imported, or its name as "module:name"'
            )
        return {name: _plain(getattr(self, name)) for name in _names(type(self))}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "EnvConfig":
        """The inverse of `as_dict`; what is missing has its default.

        Raises:
            InvalidInputError: if something in it is unknown or not as described.
        """
        for name in values:
            one_of(name, _names(cls), "field of an environment's configuration")
        return cls(**values)


def default_tasks(task: object) -> tuple[str, ...]:
    """Names of the tasks that an environment knows unless told otherwise.

    Args:
        task: its own, or None.
    """
    if task == ANY_GAIT:
        return (ANY_GAIT,)
    return DEFAULT_TASKS if task is None or task in DEFAULT_TASKS else (*DEFAULT_TASKS, str(task))


def check_control_hz(control_hz: object) -> int:
    """Return a control rate that the physics can be divided by [Hz].

    Raises:
        InvalidInputError: if it is none.
    """
    rate = number_in(control_hz, 50, PHYSICS_HZ, "control_hz")
    if rate % 1 or PHYSICS_HZ % rate:
        raise InvalidInputError(f"control_hz must be an integer that divides {PHYSICS_HZ}, got {control_hz}")
    return int(rate)


def _path(value: object) -> str | None:
    """Return the path of a robot's file; None stays None.

    Raises:
        InvalidInputError: if there is no such file.
    """
    if value is None:
        return None
    if not isinstance(value, (str, os.PathLike)) or not os.path.isfile(value):
        raise InvalidInputError(f"robot must be the path of an MJCF file or None, got {value!r}")
    return os.fspath(value)


def _names(kind: type) -> tuple[str, ...]:
    return tuple(each.name for each in fields(kind))


def _plain(value: object) -> object:
    """A value of a configuration as JSON has it."""
    if is_dataclass(value) and not isinstance(value, type):
        return {each.name: _plain(getattr(value, each.name)) for each in fields(value)}
    return list(value) if isinstance(value, tuple) else value
