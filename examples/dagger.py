"""The main job: expert demonstrations, cloning, DAgger, evaluation, pictures.

    python examples/dagger.py                      about 15 minutes on 2 cores, results under runs/<date>
    python examples/dagger.py --preset smoke       two minutes, to see that everything works

Every stage leaves its result on disk; Ctrl-C keeps what is done and the same command with ``--out`` goes on from there.
"""

# ruff: noqa: E402 (OpenGL is chosen before MuJoCo is imported)

import dataclasses
import json
import shlex
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import headless

NO_GL = headless.choose_gl()

import joblib
import torch
from main_job.config import NOISE_RAD, ROUND_NOISE_RAD, JobConfig, parse
from main_job.demonstrations import shard_jobs
from main_job.pictures import draw
from main_job.students import new_policy, train_baseline
from tqdm.auto import tqdm

import trainers
from go1_mtl_gym import Go1Error, InvalidInputError
from trainers.policies.checkpoint import versions
from trainers.utils.files import json_ready, write_json

BASELINES = ("pooled", "paper_literal")


class Job:
    """One run of the main job in one folder.

    Args:
        config: what to do.
        out: folder of the results; made if missing.

    Raises:
        InvalidInputError: if a setting cannot be, or the folder holds a run with other settings.
    """

    def __init__(self, config: JobConfig, out: Path) -> None:
        self.config = config
        self.out = out
        torch.set_num_threads(config.threads)
        new_policy(config, config.env_kwargs)  # refuses impossible settings before anything is written
        self._claim()
        self._times_path = out / "parts" / "seconds.json"
        self.seconds: dict[str, float] = _read_json(self._times_path) or {}
        self.logger = trainers.make_logger(out / "tensorboard")
        trainers.log_text(self.logger, "configuration", dataclasses.asdict(config))

    def run(self) -> dict[str, Any]:
        """All stages, in order; returns what ``metrics.json`` holds."""
        train, held_out = self.demonstrations()
        student = self.student(train, held_out)
        policies = {"multi_head": student} | self.phase_free(student) | self.baselines()
        metrics = self.evaluate(policies, held_out)
        draw(self.config, self.out, student, held_out, self.logger, NO_GL)
        return metrics

    # -- Demonstrations ------------------------------------------------------------------------------------------------

    def demonstrations(self) -> tuple[trainers.Demonstrations, trainers.Demonstrations]:
        """Training rows (clean and perturbed) and held-out rows (clean, other commands and seeds)."""
        config = self.config
        disturbed = config.disturbed(NOISE_RAD)
        train = shard_jobs(config, config.clean_s, 0)
        train += shard_jobs(config, config.perturbed_s, 1, disturbed, config.world)
        held_out = shard_jobs(config, config.held_out_s, 2)
        with self.stage("demonstrations"):
            paths = trainers.collect_all(train + held_out, self.out / "demonstrations", config.n_envs, progress=True)
        shards = [trainers.Demonstrations.load(path) for path in paths]
        return (
            trainers.Demonstrations.concatenate(shards[: len(train)]),
            trainers.Demonstrations.concatenate(shards[len(train) :]),
        )

    # -- Students ------------------------------------------------------------------------------------------------------

    def student(self, train: trainers.Demonstrations, held_out: trainers.Demonstrations) -> Any:
        """The multi-head policy: cloned, then improved by DAgger."""
        config, path = self.config, self.out / "parts" / "cloned.zip"
        if path.is_file():
            policy = trainers.load(path, config.device)
        else:
            policy = new_policy(config, config.env_kwargs)
            with self.stage("clone"):
                trainers.train_bc(policy, train, config.bc, held_out, self.logger, progress=True)
            policy.save(path)
        if config.rounds:
            policy = self._dagger(policy, train, held_out)
        else:
            self._everything(train)
        policy.save(self.out / "policy.zip")
        return policy

    def _dagger(self, policy: Any, train: trainers.Demonstrations, held_out: trainers.Demonstrations) -> Any:
        config = self.config
        disturbed = config.disturbed(ROUND_NOISE_RAD)
        kwargs = config.env_kwargs | config.world
        venv = trainers.make_venv(config.tasks, 1, kwargs, disturbed, subproc=config.n_envs > 1)
        try:
            trainer = trainers.DAggerTrainer(
                venv,
                policy,
                train,
                config.dagger,
                config.round_bc,
                scratch_dir=self.out / "dagger",
                logger=self.logger,
                validation=held_out,
                progress=True,
            )
            with self.stage("dagger"):
                if trainer.round_num == 0:
                    self._watch(policy, held_out, 0)
                while trainer.round_num < config.rounds:
                    trainer.collect_round()
                    trainer.train_round()
                    self._watch(trainer.policy, held_out, trainer.round_num)
        finally:
            with suppress(EOFError, OSError):  # after Ctrl-C its processes may be gone already
                venv.close()
        self._everything(trainer.rows)
        return trainer.policy

    def _everything(self, rows: trainers.Demonstrations) -> None:
        """Leave all training rows for the baselines, which learn from the same data."""
        rows.save(self.out / "parts" / "all_rows.npz")

    def _watch(self, policy: Any, held_out: trainers.Demonstrations, round_num: int) -> None:
        """A quick look at the closed loop and the one-step errors, for TensorBoard."""
        closed_loop = {
            task: self.closed_loop(policy, f"round-{round_num}", task, self.config.round_episodes)
            for task in self.config.tasks
        }
        trainers.log_round(self.logger, round_num, closed_loop, trainers.offline_metrics(policy, held_out))

    def phase_free(self, student: Any) -> dict[str, Any]:
        """The student with an estimate of the phase in its clock's place, where it has a clock."""
        config, path = self.config, self.out / "phase_free.zip"
        if not (config.phase_free_s and config.has_clock):
            return {}
        if not path.is_file():
            with self.stage("phase_free"):
                policy = trainers.train_phase_free(
                    student,
                    config.phase_free_s,
                    config.phase_free_history,
                    perturbation=config.disturbed(NOISE_RAD),
                    config=trainers.PhaseConfig(steps=config.phase_free_steps, seed=config.seed),
                    seed=config.seed,
                    progress=True,
                    **config.world,
                )
            policy.save(path)
        return {"phase_free": trainers.load(path)}

    def baselines(self) -> dict[str, Any]:
        """The pooled and the paper-literal student, on the same rows with as many gradient steps, side by side."""
        names = [name for name in BASELINES if not (name == "paper_literal" and self._is_literal)]
        missing = [name for name in names if not self._path(name).is_file()]
        if missing:
            jobs = min(len(missing), self.config.n_envs) if self.config.device == "cpu" else 1
            parallel = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered")
            calls = (joblib.delayed(train_baseline)(self.config, name, self.out, jobs == 1) for name in missing)
            with self.stage("baselines"):
                for _ in tqdm(parallel(calls), "baselines", len(missing), unit="network"):
                    pass
        return {name: trainers.load(self._path(name)) for name in names}

    @property
    def _is_literal(self) -> bool:
        return not self.config.channels and self.config.history == 1

    def _path(self, name: str) -> Path:
        return self.out / "parts" / f"{name}.zip"

    # -- Evaluation ----------------------------------------------------------------------------------------------------

    def evaluate(self, policies: dict[str, Any], held_out: trainers.Demonstrations) -> dict[str, Any]:
        """One-step errors and closed loop of everybody; writes ``metrics.json``."""
        config = self.config
        tasks: dict[str, dict[str, Any]] = {task: {} for task in config.tasks}
        for name, policy in policies.items():
            if name == "phase_free":  # these rows hold one frame, it needs several
                continue
            rows = held_out.proprioceptive() if name == "paper_literal" else held_out
            for task, scores in trainers.offline_metrics(policy, rows).items():
                tasks[task][name] = scores
        with self.stage("evaluation"):
            for name, policy in {"expert": "expert", **policies}.items():
                for task in config.tasks:
                    tasks[task].setdefault(name, {}).update(self.closed_loop(policy, name, task, config.episodes))
        metrics = {
            "tasks": tasks,
            "config": dataclasses.asdict(config),
            "seed": config.seed,
            "versions": versions(),
            "seconds": self.seconds,
            "command": shlex.join(["python", "examples/dagger.py", *sys.argv[1:]]),
        }
        write_json(self.out / "metrics.json", metrics)
        return metrics

    def closed_loop(self, policy: Any, name: str, task: str, episodes: int) -> dict[str, Any]:
        """Scores of `trainers.evaluate`, kept on disk; "episodes" is their number."""
        path = self.out / "parts" / "closed_loop" / f"{name}-{task}.json"
        known = _read_json(path)
        if known is None:
            config = self.config
            result = trainers.evaluate(
                policy,
                task,
                episodes=episodes,
                seconds=config.episode_s,
                seed=config.seed + 1,
                command_interval=config.command_interval,
                n_jobs=config.n_envs,
                progress=True,
                **(config.env_kwargs if policy == "expert" else {}),
            )
            known = json_ready(result.as_dict() | {"learner": name})
            write_json(path, known)
        kept = {key: value for key, value in known.items() if key not in ("task", "learner", "episodes", "seconds")}
        return kept | {"episodes": len(known["episodes"])}

    # -- Housekeeping --------------------------------------------------------------------------------------------------

    @contextmanager
    def stage(self, name: str) -> Any:
        """Add the wall time of a stage to what earlier, interrupted runs took for it."""
        start = time.monotonic()
        try:
            yield
        finally:
            self.seconds[name] = round(self.seconds.get(name, 0.0) + time.monotonic() - start, 1)
            write_json(self._times_path, self.seconds)

    def _claim(self) -> None:
        path = self.out / "config.json"
        settings = json_ready(dataclasses.asdict(self.config))
        for name in ("n_envs", "threads"):
            settings.pop(name)
        known = _read_json(path)
        if known is None:
            write_json(path, settings)
        elif known != settings:
            changed = sorted(name for name in settings if known.get(name) != settings[name])
            what = f"a run with other settings ({', '.join(changed)})"
            raise InvalidInputError(f"{self.out} holds {what}; choose another --out")


def _read_json(path: Path) -> Any:
    return json.loads(path.read_text()) if path.is_file() else None


def main(arguments: list[str] | None = None) -> int:
    """Run the job from the command line; returns the exit status."""
    out = Path("runs") / time.strftime("%Y-%m-%d_%H-%M-%S")
    try:
        config, folder = parse(arguments)
        out = Path(folder or out)
        metrics = Job(config, out).run()
    except KeyboardInterrupt:
        print(f"\ninterrupted; what is done is kept, go on with: --out {out}")
        return 130
    except Go1Error as error:
        print(f"error: {error}")
        return 2
    table = trainers.results_table(metrics)
    (out / "table.md").write_text(table + "\n")
    print(f"\n{table}\n\nresults in {out}; watch the training with: tensorboard --logdir {out / 'tensorboard'}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
