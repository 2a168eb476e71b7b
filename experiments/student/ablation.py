"""What every choice in the main job is worth: policies that differ from a reduced job's in one setting each."""

from dataclasses import dataclass, field
from typing import Any

from matplotlib.figure import Figure

from experiments import plots
from experiments.agents import Agent
from experiments.results import Group, Results, distinct, group
from experiments.student.commanded import DRAWN
from experiments.student.episodes import drawn, operated, other_gaits
from experiments.student.transitions import TransitionOptions, transition
from experiments.study import EVALUATION_CODE, Cell, Metrics, Study, option
from experiments.tables import count, mean, settings, share, table
from experiments.training_runs import TrainedPolicy, TrainingRun, changed
from go1_mtl_gym.env_config import DEFAULT_CHANNELS
from trainers.data.operator import OperatorConfig
from trainers.pipeline.config import JobConfig
from trainers.pipeline.presets import PRESETS

CHANGED, HANDS, HELD_OUT = "changed world", "in hands", "held out"
"""Drawn commands in another world than the model's, an operator's hands, and one-step errors on rows of the policy's
own demonstrations."""
CHANGED_WORLD = {"friction": 0.7, "payload_kg": 1.5, "action_delay_s": 0.01, "joint_friction": 0.5}
"""Arguments of `Go1Env`: the middles of the ranges of the study on robustness, together."""
DEFAULT = "default, reduced"


def _without(channel: str) -> tuple[str, ...]:
    """The default channels but for one."""
    return tuple(name for name in DEFAULT_CHANNELS if name != channel)


REDUCED = {
    "clean_s": 30.0,
    "perturbed_s": 75.0,
    "hard_push_s": 30.0,
    "randomized_s": 30.0,
    "held_out_s": 15.0,
    "rounds": 1,
    "dagger_s": 60.0,
    "clone_steps": 3000,
    "round_steps": 1500,
    "round_episodes": 1,
    "episode_s": 10.0,
}
"""Settings that all variants share but for their change."""
TOGETHER_S = sum(REDUCED[name] for name in ("clean_s", "perturbed_s", "hard_push_s", "randomized_s"))
"""Demonstrations per gait of every variant [s], whatever is in them."""
WITHOUT_HARD = {"hard_push_s": 0.0, "perturbed_s": REDUCED["perturbed_s"] + REDUCED["hard_push_s"]}
WITHOUT_RANDOM = {"randomized_s": 0.0, "perturbed_s": REDUCED["perturbed_s"] + REDUCED["randomized_s"]}
VARIANTS: dict[str, dict[str, Any]] = {
    DEFAULT: {},
    "control rate 100 Hz": {"control_hz": 100},
    "kp 20": {"kp": 20.0},
    "kp 80": {"kp": 80.0},
    "one frame": {"history": 1},
    "six frames": {"history": 6},
    "without command": {"channels": _without("command")},
    "without phase": {"channels": _without("phase")},
    "without last action": {"channels": _without("last_action")},
    "without leg kinematics": {"channels": _without("leg_kinematics")},
    "with gravity": {"channels": (*DEFAULT_CHANNELS, "gravity")},
    "without mirror": {"mirror": False},
    "no perturbed demonstrations": {
        "clean_s": TOGETHER_S,
        "perturbed_s": 0.0,
        "hard_push_s": 0.0,
        "randomized_s": 0.0,
    },
    "no randomization": {"randomized": 0.0, **WITHOUT_RANDOM},
    "drawn commands only": {"operator": None, **WITHOUT_HARD},
    "no gait transitions": {"operator": OperatorConfig(task_interval=None)},
    "without standing": {"operator": OperatorConfig(release=0.0, stand=0.0, starts_released=0.0)},
    "without jerks": {"operator": OperatorConfig(jerk=0.0, full_and_back=0.0)},
    "without hard pushes": {"hard_push_interval": None, **WITHOUT_HARD},
    "width 64": {"width": 64},
    "width 128": {"width": 128},
    "width 512": {"width": 512},
    "no round": {"rounds": 0},
    "two rounds": {"rounds": 2},
    "three rounds": {"rounds": 3},
    "takeover at 0.1 rad": {"takeover_rad": 0.1},
}
"""Name -> what differs from the reduced job; as many demonstrations as in that."""


@dataclass(frozen=True)
class AblationOptions:
    """Drawn commands that change, in two worlds, an operator's hands, and changes of gait."""

    training_seed: int = option(0, "of every variant")
    variants: tuple[str, ...] = option(tuple(VARIANTS), "which of VARIANTS")
    episodes: int = option(20, "per gait, in the model's world and in the changed one")
    changed_episodes: int = option(5, "per gait, in the model's world and in the changed one")
    hands_episodes: int = option(20, "per gait, in an operator's hands that change no gait")
    seconds: float = option(20.0, "duration of each [s]")
    command_interval: float = option(5.0, "time between commands [s]")
    transitions: TransitionOptions = option(TransitionOptions(trials=3), "the changes of gait")
    reduced: dict[str, Any] = field(default_factory=lambda: dict(REDUCED))

    def job(self, variant: str) -> JobConfig:
        """The main job of a variant."""
        return JobConfig(**self.reduced | VARIANTS[variant], seed=self.training_seed)


class Ablation(Study):
    """One change each: policies of a reduced main job that differ in one setting."""

    name = "student_ablation"
    title = "One change each"
    note = (
        "Students of a reduced main job that differ in one setting: successful episodes with drawn commands per gait, "
        "mean velocity error, successful gait transitions of all pairs, successful episodes in a changed world "
        f"({settings(CHANGED_WORLD)}) and, where measured, in an operator's hands, and one-step R2 on held-out rows of "
        "each one's own demonstrations. One training seed: differences of a few episodes say nothing."
    )
    caption = "Success, velocity error, gait transitions and changed world per variant"
    full = AblationOptions()
    quick = AblationOptions(
        variants=(DEFAULT, "no round"),
        episodes=1,
        changed_episodes=1,
        hands_episodes=1,
        seconds=3.0,
        command_interval=2.0,
        transitions=TransitionOptions(1, 0.5, 2.5),
        reduced=PRESETS["smoke"] | {"tasks": ("trot", "bound"), "round_episodes": 1},
    )
    code = (*EVALUATION_CODE, "experiments.student.transitions", "experiments.training_runs")

    def agents(self) -> list[Agent]:
        runs = {name: TrainingRun(self.options.job(name), self.cache / "training") for name in self.options.variants}
        return [TrainedPolicy(name, path=run.policy, run=run) for name, run in runs.items()]

    def cells(self, agent: Agent) -> list[Cell]:
        tasks = self.options.job(agent.name).tasks
        return [
            Cell(task, condition)
            for task in tasks
            for condition in (DRAWN, CHANGED, HANDS, *(f"to {second}" for second in other_gaits(task, tasks)), HELD_OUT)
        ]

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        options = self.options
        if cell.condition == HELD_OUT:
            return dict(agent.origin.held_out[cell.task])
        if cell.condition not in (DRAWN, CHANGED, HANDS):
            return transition(agent, cell, options.transitions, seed)
        if cell.condition == HANDS:
            return operated(agent.load(), cell.task, options.hands_episodes, options, seed)
        if cell.condition == CHANGED:
            return drawn(agent.load(), cell.task, options.changed_episodes, options, seed, **CHANGED_WORLD)
        return drawn(agent.load(), cell.task, options.episodes, options, seed)

    def more(self) -> dict[str, Any]:
        return {"training": {name: changed(self.options.job(name)) for name in self.options.variants}}

    def table(self, results: Results) -> str:
        columns = {gait: share(task=gait, condition=DRAWN) for gait in distinct(results.records, "task")}
        columns |= {
            "velocity error [m/s]": mean("velocity_error", ".3f", condition=DRAWN),
            "gait transitions": lambda members: count(aggregate_variant(members)["transitions"]),
            "changed world": share(condition=CHANGED),
            **({"in hands": share(condition=HANDS)} if results.of(condition=HANDS) else {}),
            "R2": mean("r2", ".4f", condition=HELD_OUT),
        }
        return table(group(results.records, "agent"), [""], columns)

    def figure(self, results: Results) -> Figure:
        columns = {
            "success": "success",
            "error": "velocity error [m/s]",
            "transitions": "gait transitions",
            "changed": "changed world",
            **({"hands": "in hands"} if results.of(condition=HANDS) else {}),
            "r2": "one-step R2",
        }
        variants = {name: aggregate_variant(records) for name, records in group(results.records, "agent").items()}
        return plots.dots(
            {
                label: {"variants": {name: metrics[key] for name, metrics in variants.items()}}
                for key, label in columns.items()
            }
        )


def aggregate_variant(records: Group) -> dict[str, Any]:
    """Of all gaits: rates of "success", "transitions", "changed" and "hands"; means of "error" [m/s] and "r2"."""
    return {
        "success": records.where(condition=DRAWN).rate(),
        "error": records.where(condition=DRAWN).mean("velocity_error"),
        "transitions": Group(record for record in records if record["condition"].startswith("to ")).rate(),
        "changed": records.where(condition=CHANGED).rate(),
        "hands": records.where(condition=HANDS).rate(),
        "r2": records.where(condition=HELD_OUT).mean("r2"),
    }
