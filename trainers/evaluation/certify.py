"""Episodes until a claim about a policy is settled, gait by gait and condition by condition."""

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import joblib
from tqdm.auto import tqdm

from go1_mtl_gym import BUILT_IN_TASKS, TASKS
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.tasks import ANY_GAIT, gait_can_change
from go1_mtl_gym.validation import one_of
from trainers.data.environments import EnvFactory, make_env
from trainers.evaluation.agents import identity, opened
from trainers.evaluation.causes import cause_of
from trainers.evaluation.cells import ALL_GAITS, FELL, SUCCEEDED, SURVIVED, Cell, FailedEpisode, Settings
from trainers.evaluation.certificate import FILE, Certificate
from trainers.evaluation.conditions import CONDITIONS, Condition
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.rollout import run_all
from trainers.policies.checkpoint import versions
from trainers.utils.files import write_atomically, write_json
from trainers.utils.folder_lock import alone_in
from trainers.utils.validation import checked_jobs, refuse_overridden

PAGE = "certificate.md"
PER_PROCESS = 4
"""Episodes that each of several processes is given at a time."""


def certify(
    policy_or_expert: Any,
    out: str | PathLike[str] | None = None,
    *,
    tasks: Sequence[str] | None = None,
    conditions: Sequence[str | Condition] | None = None,
    claim: float = 0.99,
    confidence: float = 0.95,
    allowed_failures: int = 1,
    episodes: int | None = None,
    seconds: float = 30.0,
    tours: int = 100,
    tour_seconds: float = 90.0,
    seed: int = 1,
    n_jobs: int = 1,
    progress: bool = False,
    reference: Any = None,
    stop_early: bool = True,
    make_env: EnvFactory = make_env,
    **env_kwargs: Any,
) -> Certificate:
    """Find out what a policy can be trusted with, and say so with exact errors.

    Each cell is a gait under a condition, and has a claim: at least so large a share of all such episodes succeeds.
    `trainers.evaluation.stopping.Plan` says when a claim is met, refuted, or left open, and how often that is wrong.
    Episode i of a cell depends on (seed, gait, i) alone, so the same hands come in every world and to every policy.

    Args:
        policy_or_expert: as in `trainers.evaluate`, or the path of a policy's file, or "clocked" or "phase_free".
        out: folder of ``certificate.json``, written after every cell, and ``certificate.md``. A folder that has a
            certificate of the same policy and settings keeps its cells, which are not measured again. None: no files.
        tasks: the gaits; None: all that the policy knows.
        conditions: names from `trainers.evaluation.conditions.CONDITIONS`, or `trainers.Condition` of your own; None:
            all of those, without tours if there is only one gait.
        claim: success rate that is claimed where a condition has none of its own.
        confidence: of all claims.
        allowed_failures: that a claim bears, once enough episodes are done; 0 needs the fewest without a failure.
        episodes: largest number per cell; None: what `allowed_failures` needs.
        seconds: duration of an episode [s].
        tours: largest number of tours.
        tour_seconds: duration of a tour [s].
        seed: of all of them.
        n_jobs: processes; they change no result.
        progress: show a bar per cell.
        reference: another policy or expert, which then has the same episodes.
        stop_early: end a cell as soon as its claim is settled; False does all `episodes` and looks once.
        make_env: another environment factory.
        env_kwargs: of the environment, on top of the policy's own ``env_kwargs``; JSON values or frozen dataclasses.

    Raises:
        InvalidInputError: if an argument is not as described, or `out` holds the certificate of something else or is in
            use by another process.
    """
    refuse_overridden(env_kwargs, episode_s="seconds and tour_seconds", task="tasks")
    agent, other = opened(policy_or_expert), None if reference is None else opened(reference)
    chosen = None if tasks is None else tuple(one_of(task, tuple(TASKS), "task") for task in tasks)
    known = _known(agent, chosen)
    settings = Settings(
        claim, confidence, allowed_failures, episodes, seconds, tours, tour_seconds, seed, stop_early, known, env_kwargs
    )
    asked = [
        (condition, task)
        for condition in _conditions(conditions, known)
        for task in ((ALL_GAITS,) if condition.is_tour else chosen or known)
    ]
    _check(asked, settings, agent, other)
    theirs = None if reference is None else identity(reference)
    empty = Certificate(identity(policy_or_expert), settings, versions(), (), theirs)
    measuring = _Measuring(settings, agent, other, checked_jobs(n_jobs), progress, make_env)
    if out is None:
        return _fill(empty, asked, measuring, None)
    with alone_in(Path(out)):
        certificate = _fill(empty, asked, measuring, Path(out))
        write_json(Path(out) / FILE, certificate.as_dict())
        write_atomically(Path(out) / PAGE, lambda file: file.write(certificate.markdown().encode()))
    return certificate


def _known(agent: Any, chosen: tuple[str, ...] | None) -> tuple[str, ...]:
    """The gaits of an agent's environment: its own, or the built-in ones and those that were asked for."""
    own = getattr(agent, "env_kwargs", {}).get("tasks")
    if own is None and chosen == (ANY_GAIT,):
        return chosen
    return tuple(dict.fromkeys((*BUILT_IN_TASKS, *(chosen or ())))) if own is None else tuple(own)


def _conditions(given: Sequence[str | Condition] | None, known: tuple[str, ...]) -> list[Condition]:
    if given is None:
        return [each for each in CONDITIONS.values() if gait_can_change(known) or not each.is_tour]
    if isinstance(given, str) or not given:
        raise InvalidInputError(f"conditions must be a sequence of names or Condition, got {given!r}")
    found = [
        each if isinstance(each, Condition) else CONDITIONS[one_of(each, tuple(CONDITIONS), "condition")]
        for each in given
    ]
    names = [each.name for each in found]
    if len(set(names)) != len(names):
        raise InvalidInputError(f"conditions must differ in their names, got {names}")
    return found


def _check(asked: Sequence[tuple[Condition, str]], settings: Settings, agent: Any, other: Any) -> None:
    """Refuse what could only fail after hours."""
    for condition, task in asked:
        settings.plan(condition)
        if task != ALL_GAITS:
            one_of(task, settings.gaits, "task that the policy knows")
            continue
        if not gait_can_change(settings.gaits):
            raise InvalidInputError(f"tours lead through several gaits, and the policy knows {settings.gaits} alone")
        theirs = settings.arguments(other, condition)["tasks"] if other is not None else settings.gaits
        if tuple(theirs) != tuple(settings.arguments(agent, condition)["tasks"]):
            raise InvalidInputError(
                f"tours are the same for both policies only if they know the same gaits: {settings.gaits} and {theirs}"
            )


def _fill(
    empty: Certificate, asked: Sequence[tuple[Condition, str]], measuring: "_Measuring", out: Path | None
) -> Certificate:
    """The certificate with its cells; those that a folder has already are kept, the others measured and kept there."""
    done = {cell.name: cell for cell in _kept(out, empty)}
    for condition, task in asked:
        name = f"{condition.name}/{task}"
        if name in done:
            _same(done[name].condition.as_dict(), condition.as_dict(), f"condition {condition.name!r}")
            continue
        done[name] = measuring.cell(condition, task)
        if out is not None:
            write_json(out / FILE, _together(empty, asked, done).as_dict())
    return _together(empty, asked, done)


def _kept(out: Path | None, empty: Certificate) -> tuple[Cell, ...]:
    """The cells that a folder holds already."""
    if out is None or not (out / FILE).exists():
        return ()
    there = Certificate.read(out)
    before, now = there.as_dict(), empty.as_dict()
    for name in ("policy", "reference", "settings", "versions"):
        _same(before[name], now[name], f"{name} of the certificate in {str(out)!r}")
    return there.cells


def _same(before: Any, now: Any, label: str) -> None:
    """Refuse to go on with a certificate that something else has begun."""
    if before == now:
        return
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        name = next(name for name in (*before, *now) if before.get(name) != now.get(name))
        label, before, now = f"{label}: {name}", before.get(name), now.get(name)
    raise InvalidInputError(f"choose another folder: {label} was {json.dumps(before)}, now {json.dumps(now)}")


def _together(empty: Certificate, asked: Sequence[tuple[Condition, str]], done: Mapping[str, Cell]) -> Certificate:
    """The certificate with the cells in the order that they were asked for, then those that were there besides."""
    order = dict.fromkeys([*(f"{condition.name}/{task}" for condition, task in asked), *done])
    return dataclasses.replace(empty, cells=tuple(done[name] for name in order if name in done))


@dataclasses.dataclass(frozen=True)
class _Measuring:
    settings: Settings
    agent: Any
    other: Any
    n_jobs: int
    progress: bool
    make_env: EnvFactory

    def cell(self, condition: Condition, task: str) -> Cell:
        """Episodes until the plan says that it is enough."""
        plan = self.settings.plan(condition)
        at_once = 1 if self.n_jobs == 1 else PER_PROCESS * joblib.effective_n_jobs(self.n_jobs)
        played: list[_Played] = []
        with tqdm(desc=f"{condition.name}/{task}", total=plan.largest, disable=not self.progress) as bar:
            verdict, count = "", 0
            while not verdict:
                until = min(len(played) + at_once, plan.next_stop(len(played)))
                played += self._play(self.agent, condition, task, range(len(played), until))
                bar.update(len(played) - bar.n)
                verdict, count = plan.judge([each.failure is None for each in played])
        played = played[:count]
        errors = [each.velocity_error for each in played if not math.isnan(each.velocity_error)]
        reference = None
        if self.other is not None:
            theirs = self._play(self.other, condition, task, range(count), self.progress)
            reference = "".join(each.outcome for each in theirs)
        return Cell(
            condition,
            task,
            plan,
            verdict,
            outcomes="".join(each.outcome for each in played),
            failures=tuple(each.failure for each in played if each.failure is not None),
            velocity_error=sum(errors) / len(errors) if errors else None,
            reference=reference,
        )

    def _play(
        self, agent: Any, condition: Condition, task: str, numbers: range, progress: bool = False
    ) -> "list[_Played]":
        kwargs = self.settings.arguments(agent, condition)
        calls = [
            (self.settings.setup(condition, task, number), number, condition.judged_by, agent, kwargs, self.make_env)
            for number in numbers
        ]
        return run_all(_episode, calls, len(calls), self.n_jobs, progress, f"{condition.name}/{task}, reference")


@dataclasses.dataclass(frozen=True)
class _Played:
    outcome: str
    velocity_error: float
    failure: FailedEpisode | None


def _episode(
    setup: EpisodeSetup, number: int, judged_by: str, agent: Any, env_kwargs: dict[str, Any], make_env: EnvFactory
) -> _Played:
    record, series = setup.play(agent, env_kwargs, make_env)
    outcome = FELL if record.fallen else SUCCEEDED if record.success else SURVIVED
    if outcome == SUCCEEDED or (outcome == SURVIVED and judged_by == "survival"):
        return _Played(outcome, record.velocity_error, None)
    error = None if math.isnan(record.velocity_error) else record.velocity_error
    cause = cause_of(series, record, setup.task, len(series.measured) / record.survival_s)
    failure = FailedEpisode(number, setup.seed, setup.task, record.survival_s, error, cause)
    return _Played(outcome, record.velocity_error, failure)
