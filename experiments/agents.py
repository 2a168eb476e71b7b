"""Who is measured: the expert, the policies that come with the package, policy files, and methods that train theirs."""

import hashlib
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import trainers
from go1_mtl_gym import BUILT_IN_TASKS
from go1_mtl_gym.env_config import EXPERT_ONLY
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sim.physics_params import PhysicsParams
from trainers.policies.pretrained import FOLDER

EXPERT, STUDENT, PHASE_FREE = "expert", "student", "phase-free student"
SHARED = ("tasks", "control_hz", "kp", "kd")
"""Arguments of the policies' environments that the expert's has as well; the others shape what only policies see."""
TRAINING_WORLD = (
    "randomization",
    "noise",
    "sensors",
    "settle_s",
    *EXPERT_ONLY,
    *(each.name for each in fields(PhysicsParams)),
)
"""Arguments in which the environment that a policy was trained in may differ; all are measured in the model's world."""


@dataclass(frozen=True)
class Agent:
    """A name alone: the environment's expert, or a method, whose study trains and measures its policies in one cell.

    Attributes:
        name: in records and tables.
        seed: of its training; None if the study does not train it.
        env_kwargs: arguments of the environment that it does not bring along.
        conditions: of a study that it is measured in; empty: all.
    """

    name: str
    seed: int | None = None
    env_kwargs: Mapping[str, Any] = field(default_factory=dict)
    conditions: tuple[str, ...] = ()

    @property
    def identity(self) -> str:
        """A text that changes whenever another agent is meant."""
        return repr((self.name, self.seed, sorted(self.env_kwargs.items())))

    @property
    def label(self) -> str:
        """Its name, and the seed of its training if it has one."""
        return self.name if self.seed is None else f"{self.name}, seed {self.seed}"

    @property
    def origin(self) -> Hashable | None:
        """What `prepare` makes, equal for agents that are made together; None if there is nothing to be made."""
        return None

    def prepare(self) -> float:
        return 0.0

    def load(self) -> Any:
        """What is measured; a name alone is the expert's, as `trainers.evaluate` takes it."""
        return self.name


@dataclass(frozen=True)
class PolicyFile(Agent):
    """A policy on disk, measured in the model's world whatever it was trained in.

    Attributes:
        path: of the file.
    """

    path: Path = Path()

    @property
    def sha256(self) -> str:
        """Of the file."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest()

    @property
    def identity(self) -> str:
        """The file, whatever its name."""
        return repr((self.sha256, self.seed))

    def load(self) -> Any:
        policy = trainers.load(self.path)
        extra = policy.extra_env_kwargs
        policy.extra_env_kwargs = {name: value for name, value in extra.items() if name not in TRAINING_WORLD}
        return policy


def shipped(name: str, pretrained: str) -> PolicyFile:
    """A policy that comes with the package, see `trainers.load_pretrained`, under a name for tables."""
    return PolicyFile(name, path=Path(str(FOLDER / f"{pretrained}.zip")))


def policy_files(words: Sequence[str]) -> tuple[PolicyFile, ...]:
    """The agents that "name=path" name, or a path alone, which is called "student".

    Raises:
        InvalidInputError: if a name is empty, taken or the expert's.
        CheckpointError: if a file is no policy.
    """
    agents: list[PolicyFile] = []
    for word in words:
        name, path = word.split("=", 1) if "=" in word else (STUDENT, word)
        if not name or name in (EXPERT, *(agent.name for agent in agents)):
            raise InvalidInputError(f"expected another name than {EXPERT!r} for every policy, got {list(words)}")
        trainers.load(path)
        agents.append(PolicyFile(name, path=Path(path)))
    return tuple(agents)


def with_expert(policies: Sequence[Agent]) -> list[Agent]:
    """The policies (none: the shipped one) and, last, the expert in an environment of equal tasks, rate and gains.

    Raises:
        InvalidInputError: if the policies' environments differ in these.
    """
    shared, policies = [], policies or [shipped(STUDENT, "clocked")]
    for agent in policies:
        kwargs = {"tasks": BUILT_IN_TASKS} | agent.load().env_kwargs
        shared.append({key: kwargs[key] for key in SHARED if key in kwargs})
    if any(kwargs != shared[0] for kwargs in shared):
        raise InvalidInputError(f"expected policies for the same {', '.join(SHARED)}, got {shared}")
    return [*policies, Agent(EXPERT, env_kwargs=shared[0])]


def tasks_of(agent: Agent) -> tuple[str, ...]:
    """The gaits that an agent knows, in the order of its environment."""
    kwargs = agent.env_kwargs if agent.name == EXPERT else agent.load().env_kwargs
    return tuple(kwargs.get("tasks") or BUILT_IN_TASKS)
