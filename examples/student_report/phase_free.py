"""Walking without a clock: students that see raw proprioception, or a phase that they tell from it."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from main_job.config import NOISE_RAD, JobConfig
from main_job.demonstrations import shard_jobs
from main_job.students import new_policy

import trainers
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout, SensorNoise
from student_report.lab import Walker, summary
from student_report.lessons import Pupil, kept_policy, pooled, rows_of
from student_report.phase import (
    Estimate,
    ask_for_phase,
    asked_phase,
    phase_error,
    running_phase,
    with_correction,
    without_asked,
)
from student_report.switching import SwitchingConfig
from trainers.policies.phase_free import phase_free_layout

TAUGHT, CORRECTED = "taught here", "correction {:g}"
"""Part of a variant, and part of a finished student that corrects its clock so much; see `trainers.PhaseFreePolicy`."""


@dataclass(frozen=True)
class Variant:
    """A student without a clock, or the one with.

    Attributes:
        channels: that it sees, but for the phase of two stages, which is told from the rest.
        history: frames of proprioception that it sees, or that its phase is told from.
        asked: whether the network has the phase as two more outputs in training.
        correction: of two stages, a clocked student and an estimator; None is one network.
    """

    channels: tuple[str, ...]
    history: int = 1
    asked: bool = False
    correction: float | None = None


FRAMES = 10
"""That the phase is told from; the main job's default."""
FELT = ("command", "last_action")
CLOCKED = ("command", "phase", "last_action")
VARIANTS = {
    "paper-literal": Variant(()),
    "one frame": Variant(FELT),
    "three frames": Variant(FELT, 3),
    "ten frames": Variant(FELT, FRAMES),
    "ten frames, phase asked for": Variant(FELT, FRAMES, asked=True),
    "two stages": Variant(FELT, FRAMES, correction=1.0),
    "two stages, clock with correction": Variant(FELT, FRAMES, correction=0.2),
    "clock": Variant(CLOCKED),
}
"""Everything that is taught here, by name; the last is the bound."""


@dataclass(frozen=True)
class PhaseFreeConfig:
    """What all variants share.

    Attributes:
        job: rows, network, `clone_steps` of every training and evaluation; it records the channels of `CLOCKED` and as
            many frames as any variant sees.
        held_out_s: disturbed demonstrations that the phase's error is measured on, per gait [s].
        noise_rad: largest action noise in disturbed demonstrations [rad].
        switching: of the changes of gait, for every ordered pair.
        noisy_s: duration of the episodes with noisy sensors [s].
        given_episodes: of finished students that are measured too.
        corrections: that these are measured with.

    Raises:
        InvalidInputError: if the job records less than the variants see.
    """

    job: JobConfig = JobConfig(n_envs=1, history=FRAMES)
    held_out_s: float = 30.0
    noise_rad: float = NOISE_RAD
    switching: SwitchingConfig = SwitchingConfig(trials=3)
    noisy_s: float = 10.0
    given_episodes: int = 100
    corrections: tuple[float, ...] = (1.0, 0.2)

    def __post_init__(self) -> None:
        most = max(variant.history for variant in VARIANTS.values())
        if not set(CLOCKED) <= set(self.job.channels) or self.job.history < most:
            raise InvalidInputError(
                f"expected the channels {CLOCKED} and {most} frames, got {self.job.channels} and {self.job.history}"
            )

    def walkers(self, given: Sequence[Walker]) -> list[Walker]:
        """A student of every variant, and those finished students that are given.

        Raises:
            InvalidInputError: if a finished student is no `trainers.PhaseFreePolicy`, or sees what is not recorded.
        """
        finished = [walker for walker in given if walker.path is not None]
        for policy, walker in ((walker.load(), walker) for walker in finished):
            if not isinstance(policy, trainers.PhaseFreePolicy):
                kind = type(policy).__name__
                raise InvalidInputError(f"expected a PhaseFreePolicy, got a {kind}: {walker.path}")
            self.layout.columns(policy.estimator.layout)
        corrected = tuple(CORRECTED.format(correction) for correction in self.corrections)
        own = [Pupil(name, only=(TAUGHT,)) for name in VARIANTS]
        return [*own, *(dataclasses.replace(walker, only=corrected) for walker in finished)]

    def parts(self, _task: str, _tasks: Sequence[str]) -> tuple[str, ...]:
        """One part for each of the variants, and one per correction for finished students."""
        return (TAUGHT, *(CORRECTED.format(correction) for correction in self.corrections))

    @property
    def layout(self) -> ObservationLayout:
        """Of the rows."""
        return ObservationLayout(self.job.tasks, self.job.channels, self.job.history)

    @property
    def training(self) -> list[trainers.CollectJob]:
        """Clean and disturbed demonstrations, as the main job's."""
        return shard_jobs(self.job, self.job.clean_s, 0) + self._disturbed(self.job.perturbed_s, 1)

    @property
    def held_out(self) -> list[trainers.CollectJob]:
        """Disturbed demonstrations of other seeds."""
        return self._disturbed(self.held_out_s, 2)

    def _disturbed(self, seconds: float, block: int) -> list[trainers.CollectJob]:
        return shard_jobs(self.job, seconds, block, self.job.disturbed(self.noise_rad), self.job.world)


QUICK = PhaseFreeConfig(
    JobConfig(
        n_envs=1,
        history=FRAMES,
        clean_s=2.0,
        perturbed_s=2.0,
        shard_s=2.0,
        width=64,
        batch_size=256,
        clone_steps=60,
        episodes=1,
        episode_s=3.0,
    ),
    held_out_s=2.0,
    switching=SwitchingConfig(1, 0.5, 2.5),
    noisy_s=2.5,
    given_episodes=1,
)


def prepare(config: PhaseFreeConfig, folder: Path, n_jobs: int) -> None:
    """Have everything demonstrated that the parts share."""
    trainers.collect_all([*config.training, *config.held_out], folder / "demonstrations", n_jobs, progress=True)


def phase_free(who: Any, _task: str, what: str, config: PhaseFreeConfig, seed: int, folder: Path) -> dict[str, Any]:
    """Teach one variant, or take a finished student, and measure how it walks.

    Args:
        who: name of the variant, or a finished `trainers.PhaseFreePolicy`.
        what: "correction C" of a finished student.
        config: what all share.
        seed: of the evaluation.
        folder: of demonstrations and students.

    Returns:
        `student_lab.summary` of all gaits together in "walking", "noisy" and "switching"; of each gait in "tasks",
        with its "step_rate" [1/s]; and in "phase" the error of the estimate, see `student_phase.phase_error`.
    """
    if isinstance(who, str):
        episodes, (policy, estimate) = config.job.episodes, Lessons(config, folder).student(who)
    else:
        policy, episodes = with_correction(who, float(what.split()[-1])), config.given_episodes
        estimate = running_phase(policy)
    held_out = rows_of(config.held_out, folder)
    error = None if estimate is None else phase_error(estimate, held_out, config.layout)
    return walk(policy, config, episodes, seed) | {"phase": error}


def walk(policy: Any, config: PhaseFreeConfig, episodes: int, seed: int) -> dict[str, Any]:
    """Closed loop of a policy: undisturbed, through changes of gait, and with noisy sensors."""
    job, pairs = config.job, [(a, b) for a in config.job.tasks for b in config.job.tasks if a != b]

    def evaluate(task: str, number: int, seconds: float, **world: Any) -> trainers.ClosedLoopResult:
        interval = job.command_interval
        return trainers.evaluate(policy, task, number, seconds, seed, command_interval=interval, **world)

    steady = {task: evaluate(task, episodes, job.episode_s) for task in job.tasks}
    noisy = {task: evaluate(task, job.episodes, config.noisy_s, noise=SensorNoise()) for task in job.tasks}
    trials, spans = config.switching.trials, {name: getattr(config.switching, name) for name in ("before_s", "after_s")}
    switches = {f"{a} to {b}": trainers.evaluate_transition(policy, a, b, trials, seed, **spans) for a, b in pairs}
    return {
        "walking": pooled(steady),
        "noisy": pooled(noisy),
        "switching": pooled(switches) if switches else None,
        "tasks": {task: summary(result) | {"step_rate": result.step_rate} for task, result in steady.items()},
    }


# -- Teaching ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Lessons:
    """Students of the same demonstrations, taught when they are asked for and then kept.

    Attributes:
        config: what all share.
        folder: of demonstrations and students.
    """

    config: PhaseFreeConfig
    folder: Path

    def student(self, name: str) -> tuple[Any, Estimate | None]:
        """A variant, and what gives its estimate of the phase if it has one."""
        variant = VARIANTS[name]
        if variant.correction is not None:
            policy = with_correction(self._kept("two stages", self._two_stages), variant.correction)
            return policy, running_phase(policy)
        policy = self._kept(name, lambda: self._one_network(variant))
        return (without_asked(policy), asked_phase(policy)) if variant.asked else (policy, None)

    def _kept(self, name: str, teach: Callable[[], Any]) -> Any:
        return kept_policy(self.folder / f"{name.replace(',', '').replace(' ', '-')}.zip", teach)

    def _one_network(self, variant: Variant) -> trainers.MultiHeadPolicy:
        layout, rows = self.config.layout, rows_of(self.config.training, self.folder)
        job = dataclasses.replace(self.config.job, channels=variant.channels, history=variant.history)
        policy = new_policy(job, job.env_kwargs)
        seen = rows.select(layout, ObservationLayout(job.tasks, job.channels, job.history))
        if variant.asked:
            policy, seen = ask_for_phase(policy, seen, rows.obs[:, layout.slices["phase"]])
        trainers.train_bc(policy, seen, job.bc)
        return policy

    def _two_stages(self) -> trainers.PhaseFreePolicy:
        job, history = self.config.job, VARIANTS["two stages"].history
        student = self._kept("clock", lambda: self._one_network(VARIANTS["clock"]))
        estimator = trainers.PhaseEstimator(phase_free_layout(student, history), job.width, job.seed)
        phase = trainers.PhaseConfig(job.clone_steps, job.batch_size, seed=job.seed)
        trainers.train_phase(estimator, rows_of(self.config.training, self.folder), self.config.layout, phase)
        return trainers.PhaseFreePolicy(student, estimator)
