"""The cells of a certificate, what they have in common, and the episodes that failed in them."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from go1_mtl_gym.validation import integer_in
from trainers.data.environments import derive_seed
from trainers.evaluation.causes import Cause
from trainers.evaluation.conditions import Condition
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.metrics import exact_interval, lower_bound, mcnemar
from trainers.evaluation.stopping import Plan
from trainers.utils.files import json_form, json_ready
from trainers.utils.validation import checked_seed, positive

ALL_GAITS = "all gaits"
"""Stands for the task of a cell whose episodes are tours."""
SUCCEEDED, SURVIVED, FELL = "s", "u", "f"
"""How an episode ended, one letter each: with success; up, but without success; with a fall."""


@dataclasses.dataclass(frozen=True)
class Settings:
    """What all cells of a certificate have in common; see `trainers.certify` for what is not said here.

    Attributes:
        gaits: all that the environment knows, in the order of its task id; what tours lead through.
        env_kwargs: of the environment, as JSON has them, on top of the policy's own.

    Raises:
        InvalidInputError: if something is outside its range.
    """

    claim: float
    confidence: float
    allowed_failures: int
    episodes: int | None
    seconds: float
    tours: int
    tour_seconds: float
    seed: int
    stop_early: bool
    gaits: tuple[str, ...]
    env_kwargs: Mapping[str, Any]

    def __post_init__(self) -> None:
        """Check the numbers, and bring everything into the form that comes back from a file."""
        for name in ("seconds", "tour_seconds"):
            object.__setattr__(self, name, positive(getattr(self, name), name))
        integer_in(self.tours, 1, 10**6, "tours")
        checked_seed(self.seed)
        if self.episodes is not None:
            integer_in(self.episodes, 1, 10**6, "episodes")
        object.__setattr__(self, "gaits", tuple(self.gaits))
        object.__setattr__(self, "env_kwargs", json_form(dict(self.env_kwargs), "env_kwargs"))

    def plan(self, condition: Condition) -> Plan:
        """When the episodes of a condition may end."""
        claim = self.claim if condition.claim is None else condition.claim
        largest = self.tours if condition.is_tour else self.episodes
        plan = Plan.sequential(claim, self.confidence, self.allowed_failures, largest)
        return plan if self.stop_early else Plan.fixed(claim, self.confidence, plan.largest)

    def setup(self, condition: Condition, task: str, number: int) -> EpisodeSetup:
        """An episode, which depends on the seed, the task (of a tour: none) and its number alone.

        Args:
            condition: that drives.
            task: of the cell.
            number: of the episode, from 0.
        """
        start = self.gaits[number % len(self.gaits)] if condition.is_tour else task
        seed = derive_seed("certify", task, self.seed, number)
        seconds = self.tour_seconds if condition.is_tour else self.seconds
        interval = None if condition.operator is not None else condition.command_interval
        return EpisodeSetup(start, seed, seconds, command_interval=interval, operator=condition.operator)

    def arguments(self, agent: Any, condition: Condition) -> dict[str, Any]:
        """Arguments of the environment that an agent is driven in under a condition."""
        own = getattr(agent, "env_kwargs", {})
        return {"tasks": self.gaits, **own, **self.env_kwargs, **condition.env_kwargs}


@dataclasses.dataclass(frozen=True)
class FailedEpisode:
    """An episode without the success, or the survival, that its condition asks for.

    Attributes:
        number: of the episode in its cell, from 0.
        seed: that it was reset with.
        task: that it began in.
        survival_s: time until the fall or the end [s].
        velocity_error: `EpisodeRecord.velocity_error` [m/s]; None if it fell too early to tell.
        cause: why.
    """

    number: int
    seed: int
    task: str
    survival_s: float
    velocity_error: float | None
    cause: Cause


@dataclasses.dataclass(frozen=True)
class Cell:
    """One gait under one condition.

    Attributes:
        condition: that drives.
        task: the gait, or `ALL_GAITS`.
        plan: how many episodes there were to be.
        verdict: "met", "refuted" or "open".
        outcomes: a letter per episode, in order: "s" success, "u" up but without success, "f" fell.
        failures: the episodes that count against the claim, in order.
        velocity_error: mean of those episodes that have one [m/s], or None.
        reference: outcomes of the reference in the same episodes, or None.
    """

    condition: Condition
    task: str
    plan: Plan
    verdict: str
    outcomes: str
    failures: tuple[FailedEpisode, ...]
    velocity_error: float | None = None
    reference: str | None = None

    @property
    def name(self) -> str:
        """Of the cell: "condition/task"."""
        return f"{self.condition.name}/{self.task}"

    @property
    def trials(self) -> int:
        """Number of episodes."""
        return len(self.outcomes)

    @property
    def survived(self) -> int:
        """Episodes without a fall."""
        return self.trials - self.outcomes.count(FELL)

    @property
    def succeeded(self) -> int:
        """Episodes that survived, tracked and stepped."""
        return self.outcomes.count(SUCCEEDED)

    @property
    def passed(self) -> int:
        """Episodes that count for the claim."""
        return self.trials - len(self.failures)

    @property
    def interval(self) -> tuple[float, float]:
        """The exact two-sided interval of the rate that is claimed, as of a number of episodes decided beforehand."""
        return exact_interval(self.passed, self.trials, self.plan.confidence)

    @property
    def lower_bound(self) -> float:
        """The exact one-sided lower bound, likewise."""
        return lower_bound(self.passed, self.trials, self.plan.confidence)

    @property
    def paired(self) -> dict[str, Any] | None:
        """Episodes in which "both", "only_policy", "only_reference" and "neither" passed, and McNemar's "p_value"."""
        if self.reference is None:
            return None
        good = SUCCEEDED if self.condition.judged_by == "success" else SUCCEEDED + SURVIVED
        pairs = [(mine in good, other in good) for mine, other in zip(self.outcomes, self.reference)]
        first, second = pairs.count((True, False)), pairs.count((False, True))
        return {
            "both": pairs.count((True, True)),
            "only_policy": first,
            "only_reference": second,
            "neither": pairs.count((False, False)),
            "p_value": mcnemar(first, second),
        }

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready values: the attributes, and what follows from them."""
        derived = ("trials", "survived", "succeeded", "passed", "interval", "lower_bound", "paired")
        found = {name: getattr(self, name) for name in derived}
        plan = dataclasses.asdict(self.plan) | {"error": self.plan.error}
        rest = {name: getattr(self, name) for name in ("task", "verdict", "velocity_error", "outcomes", "reference")}
        failures = [dataclasses.asdict(each) for each in self.failures]
        return json_ready({"condition": self.condition.as_dict(), **rest, **found, "plan": plan, "failures": failures})

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "Cell":
        """The inverse of `as_dict`."""
        plan = {name: value for name, value in values["plan"].items() if name != "error"}
        plan["looks"] = tuple((episodes, failures) for episodes, failures in plan["looks"])
        kept = {each.name: values[each.name] for each in dataclasses.fields(cls)}
        kept |= {"condition": Condition(**values["condition"]), "plan": Plan(**plan)}
        return cls(**kept | {"failures": tuple(map(_failed, values["failures"]))})


def _failed(values: Mapping[str, Any]) -> FailedEpisode:
    events = tuple((str(name), float(ago)) for name, ago in values["cause"]["events"])
    return FailedEpisode(**{**values, "cause": Cause(**{**values["cause"], "events": events})})
