"""A student on gaits that it never saw."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.agents import EXPERT, Agent
from experiments.any_gait.episodes import MovedSliders, block_of, blocks, episode, figures, held_out_gaits, record
from experiments.results import Group, Record, Results, group
from experiments.study import EVALUATION_CODE, Cell, Study, option
from experiments.tables import count, markdown, number
from go1_mtl_gym import NAMED_GAITS, GaitSpace, InvalidInputError
from go1_mtl_gym.tasks import ANY_GAIT
from trainers.data.environments import derive_seed
from trainers.data.operator import OperatorConfig
from trainers.evaluation.metrics import lower_bound

RANDOM, CHANGING, SLIDERS = "random gaits", "changes of gait", "sliders"


@dataclass(frozen=True)
class StudentOptions:
    """Episodes in an operator's hands."""

    gaits: int = option(1000, "that are drawn at random, an episode each")
    named: int = option(50, "episodes of each named gait")
    changing: int = option(200, "episodes in which the operator changes the gait at any moment")
    sliders: int = option(100, "episodes in which the gait's sliders are moved all the time")
    seconds: float = option(30.0, "of an episode")
    sliders_s: float = option(60.0, "of an episode with moved sliders")
    block: int = option(25, "episodes that are measured in one go")


class Student(Study):
    """A policy for any gait beside the expert: random gaits, named ones, changes at any moment, moved sliders."""

    name = "any_gait_student"
    title = "Gaits that the student never saw"
    note = (
        "Gaits are drawn by seeds that no training has. Every episode is in an operator's hands, pushes included. "
        '"Bound" is the exact one-sided lower bound, at 95 %, of the share of successes among those episodes in which '
        "the expert succeeds."
    )
    full = StudentOptions()
    quick = StudentOptions(2, 1, 1, 1, 3.0, 3.0, 2)
    keys = ("agent", "task", "condition", "seed", "number")
    code = (*EVALUATION_CODE, "experiments.any_gait.episodes")
    takes_policies = True

    def agents(self) -> list[Agent]:
        """The policies, and the expert last.

        Raises:
            InvalidInputError: if a policy is for something else, or none was given.
        """
        for agent in self.policies:
            if agent.load().tasks != (ANY_GAIT,):
                raise InvalidInputError(
                    f"a policy for {ANY_GAIT!r} was expected, {agent.name} is for {agent.load().tasks}"
                )
        if not self.policies:
            raise InvalidInputError("a policy for any gait was expected: --policy FILE")
        return [*self.policies, Agent(EXPERT)]

    def cells(self, agent: Agent) -> list[Cell]:
        counts = {
            RANDOM: self.options.gaits,
            **dict.fromkeys(NAMED_GAITS, self.options.named),
            CHANGING: self.options.changing,
            SLIDERS: self.options.sliders,
        }
        return blocks(counts, self.options.block)

    def measure(self, agent: Agent, cell: Cell, seed: int) -> list[dict[str, Any]]:
        (name, begin), options = block_of(cell), self.options
        policy, found = agent.load(), []
        many = {RANDOM: options.gaits, CHANGING: options.changing, SLIDERS: options.sliders}.get(name, options.named)
        for number_, drawn in held_out_gaits(GaitSpace(), begin, min(options.block, many - begin), seed):
            hands = OperatorConfig() if name == CHANGING else OperatorConfig().of_one_gait()
            gait = NAMED_GAITS.get(name, drawn)
            watch = MovedSliders(GaitSpace(), derive_seed("sliders", seed, number_)) if name == SLIDERS else None
            seconds = options.sliders_s if name == SLIDERS else options.seconds
            done = episode(policy, gait, seconds, name, seed, number_, operator=hands, watch=watch)
            found.append(record(done, condition=name, number=number_, **figures(gait)))
        return found

    def table(self, results: Results) -> str:
        by_agent = group(results.records, "agent")
        expert = {_key(each): each for each in by_agent.get(EXPERT, ())}
        rows = []
        for name, records in by_agent.items():
            for condition, members in group(records, "condition").items():
                row = [condition.replace("_", " "), name, count(members.rate("survived")), count(members.rate())]
                rows.append([*row, *_beside(members, expert if name != EXPERT else {}), _error(members)])
        order = [RANDOM, *NAMED_GAITS, CHANGING, SLIDERS]
        rows.sort(key=lambda row: order.index(row[0].replace(" ", "_") if row[0] not in order else row[0]))
        header = ["gaits", "who", "survived", "succeeded", "of the expert's successes", "bound", "velocity error [m/s]"]
        return markdown(header, rows, text_columns=2)


def _key(of: Record) -> tuple[Any, ...]:
    return of["condition"], of["number"]


def _beside(members: Iterable[Record], expert: dict[tuple[Any, ...], Record]) -> list[str]:
    """Successes among those of the expert, and the lower bound of their share."""
    shared = [each for each in members if expert.get(_key(each), {}).get("succeeded")]
    if not shared:
        return ["-", "-"]
    good = sum(each["succeeded"] for each in shared)
    return [f"{good}/{len(shared)}", f"{lower_bound(good, len(shared)):.3f}"]


def _error(members: Group) -> str:
    errors = members.values("velocity_error")
    return number(float(np.median(errors)) if errors else None, ".3f")
