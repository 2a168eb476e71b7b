"""What rows, policies, files and environments must agree on before they are joined."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from go1_mtl_gym import robot
from go1_mtl_gym.actuation import ActionMap, PDGains
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.gaits import Gait
from go1_mtl_gym.sensing.observation import CHANNELS, FRAME_SIZE, UNITS, ObservationLayout
from go1_mtl_gym.validation import integer_in, number_in

CONTRACT_VERSION = 1
"""Raised whenever equal fields come to mean something else."""
_TOLERANCE = 1e-9
"""Numbers that differ by less are the same number after a way through a file."""


@dataclass(frozen=True)
class ObservationTerm:
    """A named part of the flat observation.

    Attributes:
        name: of the part.
        size: how many entries it has.
        unit: of the entries; "" for none.
    """

    name: str
    size: int
    unit: str = ""

    def __post_init__(self) -> None:
        integer_in(self.size, 1, 10**6, f"size of the observation's term {self.name!r}")


@dataclass(frozen=True)
class PolicyContract:
    """Everything that gives the numbers of an observation and of an action their meaning.

    An environment makes it (`go1_mtl_gym.Go1Env.contract`); demonstrations, policies and files carry it. Whoever joins
    two things calls `check`: numbers of equal size and another meaning are refused instead of mixed.

    Attributes:
        tasks: names in the order of the one-hot task id, and of a policy's heads.
        gaits: of the tasks, in the same order; the gait clock and the expert's answers follow from them. None where one
            is not known; empty stands for none of them.
        terms: the parts of the observation in their order, without the task id, which ends it.
        control_hz: observations and actions per second.
        kp, kd: gains of the actuators, tau = kp (target - q) - kd v [N m/rad], [N m s/rad].
        default_q: joint positions that action 0 asks for [rad], one per joint.
        action_scale: radians per unit of action, one per joint: target = default_q + action_scale * action.
        joints: names of the joints in the order of the action.
        version: `CONTRACT_VERSION` when it was made.

    Raises:
        InvalidInputError: if sizes disagree, or a field is not as described.
    """

    tasks: tuple[str, ...]
    gaits: tuple[Gait | None, ...]
    terms: tuple[ObservationTerm, ...]
    control_hz: float
    kp: float
    kd: float
    default_q: tuple[float, ...]
    action_scale: tuple[float, ...]
    joints: tuple[str, ...] = robot.JOINTS
    version: int = CONTRACT_VERSION

    def __post_init__(self) -> None:
        """Check the sizes, and bring everything into one form."""
        for name in ("tasks", "gaits", "terms", "joints"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for name in ("default_q", "action_scale"):
            object.__setattr__(self, name, tuple(float(value) for value in getattr(self, name)))
        if not self.tasks or len(set(self.tasks)) != len(self.tasks):
            raise InvalidInputError(f"a contract needs tasks that differ from each other, got {self.tasks}")
        if not self.gaits:
            object.__setattr__(self, "gaits", (None,) * len(self.tasks))
        if len(self.gaits) != len(self.tasks):
            raise InvalidInputError(f"a contract of {len(self.tasks)} tasks needs as many gaits, got {len(self.gaits)}")
        self._check_parts()
        sizes = {name: len(getattr(self, name)) for name in ("default_q", "action_scale", "joints")}
        if len(set(sizes.values())) != 1:
            raise InvalidInputError(f"joints, default_q and action_scale must be of equal length, got {sizes}")

    def _check_parts(self) -> None:
        """Refuse fields that mean nothing."""
        terms = [term for term in self.terms if isinstance(term, ObservationTerm)]
        names = [term.name for term in terms]
        if len(terms) != len(self.terms) or len(set(names)) != len(names):
            raise InvalidInputError(f"terms must be ObservationTerms of different names, got {self.terms}")
        if not all(isinstance(name, str) for name in self.tasks) or not all(
            isinstance(gait, (Gait, type(None))) for gait in self.gaits
        ):
            raise InvalidInputError(f"tasks must be names and gaits Gaits or None, got {self.tasks} and {self.gaits}")
        number_in(self.control_hz, 1e-3, 1e6, "control_hz of a contract")
        number_in(self.kp, 0.0, 1e6, "kp of a contract"), number_in(self.kd, 0.0, 1e6, "kd of a contract")
        integer_in(self.version, 1, CONTRACT_VERSION, "version of a contract")
        numbers = np.array([*self.default_q, *self.action_scale])
        if not np.isfinite(numbers).all() or min(self.action_scale, default=1.0) <= 0:
            raise InvalidInputError(
                f"default_q must be finite and action_scale positive, got {self.default_q} and {self.action_scale}"
            )

    @classmethod
    def of_environment(
        cls,
        layout: ObservationLayout,
        gaits: Sequence[Gait | None],
        control_hz: float,
        gains: PDGains,
        action_map: ActionMap,
    ) -> "PolicyContract":
        """The contract of an environment of the Go1.

        Args:
            layout: of its observations.
            gaits: of the layout's tasks, in their order; None where it can be any.
            control_hz: steps per second.
            gains: of the actuators.
            action_map: from actions to joint targets.
        """
        return cls(
            tasks=layout.tasks,
            gaits=tuple(gaits),
            terms=terms_of(layout),
            control_hz=control_hz,
            kp=gains.kp,
            kd=gains.kd,
            default_q=tuple(action_map.center),
            action_scale=tuple(action_map.half_range),
        )

    # -- Reading -------------------------------------------------------------------------------------------------------

    @property
    def n_tasks(self) -> int:
        """Number of tasks K."""
        return len(self.tasks)

    @property
    def observation_size(self) -> int:
        """Length of the observation, task id included."""
        return sum(term.size for term in self.terms) + self.n_tasks

    @property
    def slices(self) -> Mapping[str, slice]:
        """Where each term and the task id stand in the observation."""
        sizes = {term.name: term.size for term in self.terms} | {"task": self.n_tasks}
        ends = np.cumsum(list(sizes.values())).tolist()
        return MappingProxyType({name: slice(end - sizes[name], end) for name, end in zip(sizes, ends, strict=True)})

    @property
    def channels(self) -> tuple[str, ...]:
        """The optional terms that are there."""
        return tuple(term.name for term in self.terms if term.name in CHANNELS)

    @property
    def history(self) -> int:
        """Number of proprioceptive frames in the observation."""
        return 1 + next((term.size for term in self.terms if term.name == "history"), 0) // FRAME_SIZE

    @property
    def layout(self) -> ObservationLayout:
        """The layout of a Go1's observation that has these terms.

        Raises:
            InvalidInputError: if the observation is something else's.
        """
        layout = ObservationLayout(self.tasks, self.channels, self.history)
        if layout.size != self.observation_size:
            raise InvalidInputError(f"the observations are not a Go1's: they hold {self.describe()}")
        return layout

    @property
    def env_kwargs(self) -> dict[str, Any]:
        """Keyword arguments of `go1_mtl_gym.Go1Env` that give an environment with this contract."""
        return {
            "tasks": self.tasks,
            "channels": self.channels,
            "history": self.history,
            "control_hz": self.control_hz,
            "kp": self.kp,
            "kd": self.kd,
        }

    def describe(self) -> str:
        """The terms and their sizes, and the tasks, for messages."""
        return f"{_short(self.terms)} and the task id of {', '.join(self.tasks)}"

    def to_radians(self, actions: np.ndarray) -> np.ndarray:
        """Joint targets [rad] of actions, shape (..., joints)."""
        return np.array(self.default_q) + np.array(self.action_scale) * actions

    # -- Other contracts -----------------------------------------------------------------------------------------------

    def with_tasks(self, tasks: Sequence[str], gaits: Mapping[str, Gait] | None = None) -> "PolicyContract":
        """The same with another task id.

        Args:
            tasks: names in one-hot order.
            gaits: of the tasks that are new here, by their names.
        """
        known = dict(zip(self.tasks, self.gaits)) | dict(gaits or {})
        return replace(self, tasks=tuple(tasks), gaits=tuple(known.get(name) for name in tasks))

    def with_terms(self, terms: Sequence[ObservationTerm]) -> "PolicyContract":
        """The same with other parts of the observation."""
        return replace(self, terms=tuple(terms))

    # -- Comparing -----------------------------------------------------------------------------------------------------

    def differences(self, other: "PolicyContract", ignore: Sequence[str] = ()) -> dict[str, tuple[Any, Any]]:
        """The fields in which two contracts differ, with both values.

        Args:
            other: what is compared with.
            ignore: names of fields that may differ.
        """
        pairs = {each.name: (getattr(self, each.name), getattr(other, each.name)) for each in fields(self)}
        pairs["gaits"] = _shared_gaits(self, other)
        return {name: pair for name, pair in pairs.items() if name not in ignore and not _same(*pair)}

    def check(self, other: "PolicyContract", self_name: str, other_name: str, ignore: Sequence[str] = ()) -> None:
        """Refuse to join what does not belong together.

        Args:
            other: the contract of the other side.
            self_name: what this one is called in the message, such as "the policy".
            other_name: what the other one is called, such as "the rows".
            ignore: names of fields that may differ.

        Raises:
            InvalidInputError: if they differ; names both sides, and every difference.
        """
        differences = self.differences(other, ignore)
        if differences:
            listed = "; ".join(f"{name}: {_short(a)} against {_short(b)}" for name, (a, b) in differences.items())
            raise InvalidInputError(f"{self_name} and {other_name} do not belong together: {listed}")

    # -- Files ---------------------------------------------------------------------------------------------------------

    def as_dict(self) -> dict[str, Any]:
        """JSON values; the slices of the terms stand beside them for readers of other languages."""
        slices = self.slices
        values = asdict(self)
        for term in values["terms"]:
            term["start"], term["stop"] = slices[term["name"]].start, slices[term["name"]].stop
        return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "PolicyContract":
        """The inverse of `as_dict`.

        Raises:
            InvalidInputError: if something is missing or of another kind, or it was made by a later version.
        """
        try:
            if values["version"] > CONTRACT_VERSION:
                raise InvalidInputError(
                    f"the contract has version {values['version']}, this package reads up to {CONTRACT_VERSION}"
                )
            known = {each.name: values[each.name] for each in fields(cls)}
            known["terms"] = tuple(ObservationTerm(term["name"], term["size"], term["unit"]) for term in known["terms"])
            known["gaits"] = tuple(None if gait is None else Gait(**gait) for gait in known["gaits"])
            return cls(**known)
        except (KeyError, TypeError, AttributeError) as error:
            raise InvalidInputError(f"not a policy contract: {type(error).__name__} {error}") from error


def terms_of(layout: ObservationLayout) -> tuple[ObservationTerm, ...]:
    """The terms of a layout, in their order, without the task id."""
    return tuple(
        ObservationTerm(name, where.stop - where.start, UNITS.get(name, ""))
        for name, where in layout.slices.items()
        if name != "task"
    )


def _shared_gaits(first: PolicyContract, second: PolicyContract) -> tuple[dict[str, Gait], dict[str, Gait]]:
    """The gaits that both know, by the task's name."""
    known = [{name: gait for name, gait in zip(each.tasks, each.gaits) if gait} for each in (first, second)]
    both = [name for name in known[0] if name in known[1]]
    return {name: known[0][name] for name in both}, {name: known[1][name] for name in both}


def _same(first: object, second: object) -> bool:
    both = isinstance(first, tuple) and isinstance(second, tuple) and len(first) == len(second)
    if both and all(isinstance(value, float) for value in (*first, *second)):  # type: ignore[misc]
        return bool(np.allclose(first, second, rtol=0.0, atol=_TOLERANCE))  # type: ignore[arg-type]
    return bool(first == second)


def _short(value: object) -> str:
    """A value as a message can show it."""
    if isinstance(value, tuple) and value and isinstance(value[0], ObservationTerm):
        return "[" + ", ".join(f"{term.name} {term.size}" for term in value) + "]"
    if isinstance(value, tuple) and value and isinstance(value[0], float):
        legs = {value[i : i + 3] for i in range(0, len(value), 3)}
        shown, times = (value, "") if len(legs) > 1 else (value[:3], f" x {len(value) // 3}")
        return "[" + ", ".join(f"{number:.4g}" for number in shown) + "]" + times
    return str(value)
