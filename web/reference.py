"""``python -m web.reference``: what Python's own robot does, for the page's tests to compare with.

Drives of some seconds in every gait, with all that was observed, done and reached; and operator tours, as they are
certified, with their verdicts.
"""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, cast

import gymnasium
import joblib

from go1_mtl_gym import TASKS, Go1Env
from go1_mtl_gym.errors import InvalidInputError
from trainers.data.environments import base_env, make_env
from trainers.data.operator_wrapper import OperatorWrapper
from trainers.evaluation.agents import identity
from trainers.evaluation.cells import ALL_GAITS, FELL, Settings
from trainers.evaluation.certificate import Certificate
from trainers.evaluation.conditions import CONDITIONS
from trainers.evaluation.episodes import EpisodeSetup
from trainers.evaluation.rollout import controller
from trainers.evaluation.script import Script
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.policies.phase_free import PhaseFreePolicy
from trainers.utils.cli import main, positive_int, writable_folder
from trainers.utils.files import write_json
from web.export import add_policies, read_policies

OUT = Path(__file__).parent / "build" / "reference"
"""Where the page's tests look for it."""
SECONDS = 10.0
"""Duration of a drive [s]."""
TOURS, TOUR_S, SEED = 2, 90.0, 1
"""Number, duration [s] and seed of the tours; a certificate has the same ones first."""
PUSH_AT_S, PUSH = 7.0, (0.3, -0.4, 0.0)
"""When a drive through all gaits is pushed [s], and how [m/s]."""
Policy = MultiHeadPolicy | PhaseFreePolicy


def drives(tasks: Sequence[str]) -> Iterator[tuple[str, Script]]:
    """Name and script of each drive: a gait from a stand into its corners and back, and all gaits."""
    for name in tasks:
        span = TASKS[name].command_range
        moves = [
            (time_s, name, tuple(share * value for share, value in zip(shares, span))) for time_s, shares in _SHARES
        ]
        yield name, Script(tuple(moves), SECONDS)  # type: ignore[arg-type]  # fields of moves
    changes = [(1.0 + 1.5 * i, name, (0.3 if i % 2 else 0.5, 0.0, 0.4)) for i, name in enumerate(tasks)]
    yield "all gaits", Script(((0.0, tasks[0]), *changes), SECONDS + 2.0)  # type: ignore[arg-type]


_SHARES = (
    (0.0, (0.0, 0.0, 0.0)), (1.0, (0.6, 0.0, 0.0)), (3.0, (0.3, 0.5, -0.5)), (5.0, (-0.5, 0.0, 0.7)),
    (7.0, (0.0, 0.0, 0.0)), (8.5, (0.9, -0.3, 0.3)),
)  # fmt: skip
"""Times [s] of a drive's moves, and the share of the task's range in each direction."""


def _go1(env: gymnasium.Env) -> Go1Env:
    return cast(Go1Env, base_env(env))


def drive(policy: Policy, script: Script) -> dict[str, Any]:
    """Let a policy follow a script, and write down everything.

    Returns:
        JSON values: the robot's joints at the start, what is done before which step, and the state, observation and
        action of every step; where it ends, and whether it fell.
    """
    env = make_env(script.moves[0].task, None, **{**policy.env_kwargs, "episode_s": script.seconds})
    base, act = _go1(env), controller(policy, base_env(env))
    obs, info = env.reset(seed=SEED, options={"task": script.moves[0].task, "command": script.moves[0].command})
    start, observations, actions, states = base.simulation.q, [], [], []
    push_step = round(PUSH_AT_S * base.control_hz) if len(script.task_names) > 1 else -1
    for step in range(round(script.seconds * base.control_hz)):
        script.drive(env, step)
        if step == push_step:
            base.push(PUSH)
        data = base.simulation.data
        states.append({name: getattr(data, name).copy() for name in ("qpos", "qvel", "qacc_warmstart")})
        observations.append(obs)
        actions.append(act(obs))
        obs, _, terminated, _, info = env.step(actions[-1])
        if terminated:
            break
    moves = [[round(move.time_s * base.control_hz), move.task, move.command] for move in script.moves]
    return {
        "start": start,
        "moves": moves,
        "push": [push_step, PUSH],
        "states": states,
        "observations": observations,
        "actions": actions,
        "qpos": base.simulation.data.qpos.copy(),
        "fallen": info["fallen"],
    }


def tour(policy: Policy, setup: EpisodeSetup, outcome: str = "") -> dict[str, Any]:
    """Drive an operator's tour.

    Args:
        policy: that is driven.
        setup: of the tour.
        outcome: a letter from a certificate of the same policy, which has driven it already; empty drives it.

    Returns:
        JSON values: the robot's joints at the start, all that the hands do, whether it fell, and, if it was driven,
        where it ended.
    """
    values: dict[str, Any] = _hands(policy, setup) | {"seconds": setup.seconds, "fallen": outcome == FELL, "qpos": None}
    if not outcome:

        def watch(env: gymnasium.Env, step: int) -> None:
            values["qpos"] = _go1(env).simulation.data.qpos.copy()

        record, _ = setup.play(policy, policy.env_kwargs, make_env, watch)
        values["fallen"] = record.fallen
    return values


def _hands(policy: Policy, setup: EpisodeSetup) -> dict[str, Any]:
    """The robot's joints at the start of a tour, and all that the hands do."""
    env = OperatorWrapper(
        make_env(setup.task, None, **{**policy.env_kwargs, "episode_s": setup.seconds}), setup.operator
    )
    env.reset(seed=setup.seed, options={"task": setup.task})
    plan = env.plan
    assert plan is not None  # a reset draws it
    return {
        "task": plan.task,
        "start": _go1(env).simulation.q,
        "segments": [[each.start_s, each.end_s, each.before, each.after] for each in plan.segments],
        "changes": plan.changes,
        "pushes": [[each.time_s, each.angle, each.size] for each in plan.pushes],
    }


def tours(policy: Policy, count: int, outcomes: str = "", n_jobs: int = 1) -> list[dict[str, Any]]:
    """The first tours of a certificate of `SEED`.

    Args:
        policy: that is driven.
        count: how many.
        outcomes: of the first ones, if they were driven already.
        n_jobs: processes for the others.
    """
    settings = Settings(0.99, 0.95, 1, None, TOUR_S, count, TOUR_S, SEED, False, policy.tasks, {})
    setups = [settings.setup(CONDITIONS["tour"], ALL_GAITS, number) for number in range(count)]
    known = list(outcomes[:count].ljust(count))
    calls = (joblib.delayed(tour)(policy, setup, letter.strip()) for setup, letter in zip(setups, known, strict=True))
    return list(joblib.Parallel(n_jobs=n_jobs)(calls))


def outcomes_of(certificate: Certificate, policy: str) -> str:
    """How the tours of a certificate ended.

    Args:
        certificate: that holds them.
        policy: file or name in the package of the policy that the page drives.

    Raises:
        InvalidInputError: if the certificate is of another policy, or its tours are others.
    """
    mine, theirs = identity(policy), certificate.policy
    if mine["sha256"] != theirs["sha256"]:
        raise InvalidInputError(f"the certificate is of {theirs}, the page drives {mine}")
    settings = certificate.settings
    if (settings.seed, settings.tour_seconds) != (SEED, TOUR_S):
        raise InvalidInputError(
            f"tours of {TOUR_S:g} s and seed {SEED} were expected, the certificate has {settings.tour_seconds:g} s "
            f"and seed {settings.seed}"
        )
    return certificate.cell("tour", ALL_GAITS).outcomes


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Write the reference data."""
    parser = argparse.ArgumentParser(prog="python -m web.reference", description="Write what the page is tested with.")
    add_policies(parser)
    parser.add_argument("--out", default=OUT, type=Path, help="folder of the data; %(default)s")
    parser.add_argument("--tours", default=TOURS, type=positive_int, help="how many; %(default)s")
    parser.add_argument("--certificate", help="file of the policy's certificate, whose tours need not be driven again")
    parser.add_argument("--jobs", default=1, type=int, help="processes for the tours; %(default)s")
    given = parser.parse_args(arguments)
    out = writable_folder(given.out)
    known = outcomes_of(Certificate.read(given.certificate), given.policy) if given.certificate else ""
    for policy in read_policies(given.policy, given.phase_free):
        driven = {name: drive(policy, script) for name, script in drives(policy.tasks)}
        write_json(out / f"drives_{policy.kind}.json", driven)
        if policy.kind == MultiHeadPolicy.kind:
            write_json(out / "tours.json", tours(policy, given.tours, known, given.jobs))


if __name__ == "__main__":
    raise SystemExit(run())
