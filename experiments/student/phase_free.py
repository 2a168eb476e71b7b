"""Walking without a clock: policies that see raw proprioception, or a phase that they tell from it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

import trainers
from experiments import plots
from experiments.agents import Agent, shipped
from experiments.results import Group, Results, distinct, group
from experiments.student.episodes import counts, evaluate_gaits, other_gaits
from experiments.student.phase import (
    Estimate,
    ask_for_phase,
    asked_phase,
    phase_error,
    phase_of,
    running_phase,
    without_asked,
)
from experiments.student.transitions import TransitionOptions
from experiments.study import ALL_GAITS, Cell, Metrics, Study, option
from experiments.tables import mean, share, table
from experiments.training_runs import QUICK_JOB, collect, kept_policy, rows_of
from go1_mtl_gym.env_config import DEFAULT_CHANNELS, DEFAULT_HISTORY
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout, SensorNoise
from go1_mtl_gym.validation import one_of
from trainers.pipeline.config import NOISE_RAD, JobConfig
from trainers.pipeline.demonstrations import shard_jobs, training_jobs
from trainers.pipeline.new_policy import new_policy
from trainers.policies.phase_free import phase_free_layout

WALKING, NOISY, TRANSITIONS, PHASE_ERROR = "walking", "noisy sensors", "gait transitions", "phase error"
FRAMES = 10
"""That the phase is told from; the main job's default."""
CLOCKED = DEFAULT_CHANNELS
FELT = tuple(name for name in CLOCKED if name != "phase")


@dataclass(frozen=True)
class Variant:
    """A policy without a clock, or the one with.

    Attributes:
        channels: that it sees, but for the phase of two stages, which is told from the rest.
        history: frames of proprioception that it sees, or that its phase is told from.
        asked: whether the network has the phase as two more outputs in training.
        correction: of two stages, a clocked policy and an estimator; None is one network.
    """

    channels: tuple[str, ...]
    history: int = 1
    asked: bool = False
    correction: float | None = None


VARIANTS = {
    "paper-literal": Variant(()),
    "one frame": Variant(FELT),
    "three frames": Variant(FELT, 3),
    "ten frames": Variant(FELT, FRAMES),
    "ten frames, phase asked for": Variant(FELT, FRAMES, asked=True),
    "two stages": Variant(FELT, FRAMES, correction=1.0),
    "two stages, clock with correction": Variant(FELT, FRAMES, correction=0.2),
    "clock": Variant(CLOCKED, DEFAULT_HISTORY),
}
"""Everything that is trained here, by name; the last is the bound."""


@dataclass(frozen=True)
class PhaseFreeOptions:
    """What all variants share.

    Raises:
        InvalidInputError: if the job records less than the variants see.
    """

    job: JobConfig = option(
        JobConfig(n_envs=1, history=FRAMES, mirror=False),
        "rows, network, clone_steps of every training, and evaluation; it records all that any variant sees",
    )
    held_out_s: float = option(30.0, "perturbed demonstrations that the phase's error is measured on, per gait [s]")
    transitions: TransitionOptions = option(TransitionOptions(trials=3), "changes of gait, for every ordered pair")
    noisy_s: float = option(10.0, "duration of the episodes with noisy sensors [s]")
    given_episodes: int = option(100, "of finished policies that are measured too")
    corrections: tuple[float, ...] = option((1.0, 0.2), "that these are measured with")

    def __post_init__(self) -> None:
        most = max(variant.history for variant in VARIANTS.values())
        if not set(CLOCKED) <= set(self.job.channels) or self.job.history < most:
            raise InvalidInputError(
                f"expected the channels {CLOCKED} and {most} frames, got {self.job.channels} and {self.job.history}"
            )

    @property
    def training(self) -> list[trainers.CollectJob]:
        """Those of the main job."""
        return training_jobs(self.job)

    @property
    def held_out(self) -> list[trainers.CollectJob]:
        """Perturbed demonstrations of other seeds."""
        job = self.job
        world = job.randomization_kwargs(job.randomized)
        return shard_jobs(job, self.held_out_s, 2, job.perturbation(NOISE_RAD), world)


class PhaseFree(Study):
    """Walking without a clock: raw proprioception, or a phase that is told from it."""

    name = "student_phase_free"
    title = "Without a clock"
    note = (
        "Successful episodes with commands that change, in every gait; survivors, gait transitions and noisy sensors "
        "of all gaits together; median and 99th percentile of the error of the phase on perturbed walks of the expert "
        "that nobody learned from. Students with a correction in their name were given; the others learned from the "
        "same demonstrations."
    )
    caption = "Success and error of the phase, of students without a clock"
    full = PhaseFreeOptions()
    quick = PhaseFreeOptions(replace(full.job, **QUICK_JOB), 2.0, TransitionOptions(1, 0.5, 2.5), 2.5, 1, (0.2,))
    code = (*Study.code, "experiments.student.phase", "experiments.training_runs")
    takes_policies = True

    def agents(self) -> list[Agent]:
        """Every variant, and finished policies with every correction.

        Raises:
            InvalidInputError: if a finished policy is no `trainers.PhaseFreePolicy`, or sees what is not recorded.
        """
        given = self.policies or [shipped("phase_free", "phase_free")]
        for agent in given:
            policy = agent.load()
            if not isinstance(policy, trainers.PhaseFreePolicy):
                raise InvalidInputError(f"expected a PhaseFreePolicy, got a {type(policy).__name__}: {agent.path}")
            for task in self.options.job.tasks:
                one_of(task, policy.tasks, f"gait of {agent.name}")
            job = self.options.job
            ObservationLayout(policy.tasks, job.channels, job.history).columns(policy.estimator.layout)
        corrected = [
            replace(agent, name=f"{agent.name}, correction {correction:g}")
            for agent in given
            for correction in self.options.corrections
        ]
        return [*(Agent(name) for name in VARIANTS), *corrected]

    def cells(self, agent: Agent) -> list[Cell]:
        return [Cell(ALL_GAITS)]

    def prepare(self, n_jobs: int) -> None:
        collect([*self.options.training, *self.options.held_out], self.folder, n_jobs)

    def measure(self, agent: Agent, cell: Cell, seed: int) -> Metrics:
        options = self.options
        if agent.name in VARIANTS:
            episodes, (policy, estimate) = options.job.episodes, Trainings(options, self.folder).policy(agent.name)
        else:
            policy = agent.load().with_correction(float(agent.name.split()[-1]))
            episodes, estimate = options.given_episodes, running_phase(policy)
        records = walk(policy, options, episodes, seed)
        if estimate is not None:
            error = phase_error(estimate, rows_of(options.held_out, self.folder))
            records.append({"condition": PHASE_ERROR, **error})
        return records

    def table(self, results: Results) -> str:
        gaits = [task for task in distinct(results.records, "task") if task != ALL_GAITS]
        together = {"task": ALL_GAITS, "condition": WALKING}
        columns = {gait: share(task=gait, condition=WALKING) for gait in gaits} | {
            "survived": share("survived", **together),
            "velocity error [m/s]": mean("velocity_error", ".3f", **together),
            TRANSITIONS: share(condition=TRANSITIONS),
            NOISY: share(condition=NOISY),
            "phase error [cycles]": _phase_error,
        }
        return table(group(results.records, "agent"), [""], columns)

    def figure(self, results: Results) -> Figure:
        together = results.of(task=ALL_GAITS)
        walked = (record for record in together if record["condition"] != PHASE_ERROR)
        success = plots.panel(walked, "condition", "agent", Group.rate)
        per_agent = group(together.where(condition=PHASE_ERROR), "agent").items()
        errors = {key: {agent: members.mean(key) for agent, members in per_agent} for key in ("median", "p99")}
        return plots.dots({"success": success, "phase error [cycles]": errors}, log=["phase error [cycles]"])


def _phase_error(members: Group) -> str:
    """Median and 99th percentile of the error of the phase."""
    errors = members.where(condition=PHASE_ERROR)
    return f"{errors[0]['median']:.3f}, {errors[0]['p99']:.3f}" if errors else "-"


def walk(policy: Any, options: PhaseFreeOptions, episodes: int, seed: int) -> list[dict[str, Any]]:
    """Records of a policy in closed loop: unperturbed, with noisy sensors, and through changes of gait."""
    job, spans = options.job, {"before_s": options.transitions.before_s, "after_s": options.transitions.after_s}
    steady = evaluate_gaits(policy, replace(job, episodes=episodes), seed)
    noisy = evaluate_gaits(policy, replace(job, episode_s=options.noisy_s), seed, noise=SensorNoise())
    changed = [
        trainers.evaluate_transition(policy, first, second, options.transitions.trials, seed, **spans)
        for first in job.tasks
        for second in other_gaits(first, job.tasks)
    ]
    per_gait = [
        {"task": task, "condition": WALKING, **counts(result), "step_rate": result.step_rate}
        for task, result in steady.items()
    ]
    together = {WALKING: list(steady.values()), NOISY: list(noisy.values()), TRANSITIONS: changed}
    return per_gait + [{"condition": name, **counts(*results)} for name, results in together.items() if results]


@dataclass(frozen=True)
class Trainings:
    """Policies of the same demonstrations, trained when they are asked for and then kept.

    Attributes:
        options: what all share.
        folder: of demonstrations and policies.
    """

    options: PhaseFreeOptions
    folder: Path

    def policy(self, name: str) -> tuple[Any, Estimate | None]:
        """A variant, and what gives its estimate of the phase if it has one."""
        variant = VARIANTS[name]
        if variant.correction is not None:
            policy = self._kept("two stages", self._two_stages).with_correction(variant.correction)
            return policy, running_phase(policy)
        policy = self._kept(name, lambda: self._one_network(variant))
        return (without_asked(policy), asked_phase(policy)) if variant.asked else (policy, None)

    def _kept(self, name: str, train: Callable[[], Any]) -> Any:
        return kept_policy(self.folder / f"{name.replace(',', '').replace(' ', '-')}.zip", train)

    def _one_network(self, variant: Variant) -> trainers.MultiHeadPolicy:
        rows = rows_of(self.options.training, self.folder)
        job = replace(self.options.job, channels=variant.channels, history=variant.history)
        policy = new_policy(job, job.env_kwargs)
        seen = rows.select(job.channels, job.history)
        if variant.asked:
            policy, seen = ask_for_phase(policy, seen, phase_of(rows))
        trainers.train_bc(policy, seen, job.bc)
        return policy

    def _two_stages(self) -> trainers.PhaseFreePolicy:
        job, history = self.options.job, VARIANTS["two stages"].history
        policy = self._kept("clock", lambda: self._one_network(VARIANTS["clock"]))
        estimator = trainers.PhaseEstimator(phase_free_layout(policy, history), job.width, job.seed)
        phase = trainers.PhaseConfig(job.clone_steps, job.batch_size, seed=job.seed)
        trainers.train_phase(estimator, rows_of(self.options.training, self.folder), phase)
        return trainers.PhaseFreePolicy(policy, estimator)
