"""The main job: stages that leave their results on disk, and take from there what is done."""

import contextlib
from collections.abc import Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.vec_env import VecEnv

from go1_mtl_gym.rendering import RenderingError
from trainers.algorithms.bc import train_bc
from trainers.algorithms.dagger import DAggerTrainer
from trainers.algorithms.phase_free import train_phase_free
from trainers.data.collection import collect_all
from trainers.data.demonstrations import Demonstrations
from trainers.data.environments import base_env, make_env, make_venv
from trainers.evaluation.figures import joint_target_figure
from trainers.pipeline.baselines import baseline_names, train_baselines
from trainers.pipeline.config import NOISE_RAD, JobConfig
from trainers.pipeline.demonstrations import held_out_jobs, training_jobs
from trainers.pipeline.new_policy import new_policy
from trainers.pipeline.pictures import save_small_video, save_videos
from trainers.pipeline.run_folder import RunFolder
from trainers.pipeline.scores import DRAWN, OPERATOR, Scores, certified, means
from trainers.pipeline.stages import Stages, announced_if_slow
from trainers.policies.checkpoint import versions
from trainers.policies.loading import load
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.utils.files import write_json
from trainers.utils.gif import Gif
from trainers.utils.logging import log_figure, log_film, log_round, log_settings, log_text, make_logger
from trainers.utils.wandb_log import check_wandb

ANY_GAIT_ENVS = 6
"""Environments of a DAgger round in which the gait can be any."""


class Job:
    """One training run in one folder.

    Each stage is a method that leaves its result in the folder and, called again, takes it from there; a job that was
    interrupted is made again with the same settings and folder, and goes on.

    Args:
        config: what to do.
        out: folder of the results; made if missing.
        command: how the run was started, for `metrics.json`.
        progress: show bars.

    Attributes:
        folder: paths of the results, and the wall time of every stage.
        logger: of the run, for TensorBoard, and for Weights & Biases if the settings ask for it.

    Raises:
        InvalidInputError: if a setting cannot be, or the folder cannot be written to or holds another run.
    """

    def __init__(
        self, config: JobConfig, out: str | PathLike[str], *, command: str = "", progress: bool = False
    ) -> None:
        self.config = config
        self.command = command
        self.progress = progress
        torch.set_num_threads(config.threads)
        self._untrained()  # refuses impossible settings before anything is written
        if config.wandb:
            check_wandb()
        self.folder = RunFolder(Path(out))
        self.folder.claim(config)
        self._scores = Scores(config, self.folder, progress)
        self.stages = Stages(config, progress, self.folder.seconds)
        self.logger = make_logger(self.folder.log, ("tensorboard", "wandb") if config.wandb else ("tensorboard",))
        log_text(self.logger, "configuration", config.as_dict())

    def run(self) -> dict[str, Any]:
        """All stages, in order; returns what ``metrics.json`` holds.

        Raises:
            go1_mtl_gym.rendering.RenderingError: if no picture can be drawn on this machine; all else is done then.
        """
        train, held_out = self.demonstrations()
        policy = self.dagger(self.clone(train, held_out), train, held_out)
        metrics = self.evaluate({"multi_head": policy} | self.phase_free(policy) | self.baselines(), held_out)
        self.draw(policy, held_out)
        return metrics

    # -- Demonstrations ------------------------------------------------------------------------------------------------

    def demonstrations(self) -> tuple[Demonstrations, Demonstrations]:
        """Training rows (clean and perturbed) and held-out rows (clean, other commands and seeds)."""
        train, held_out = training_jobs(self.config), held_out_jobs(self.config)
        with self._stage("demonstrations"):
            folder = self.folder.path / "demonstrations"
            self._prepare_expert(folder)
            paths = collect_all(train + held_out, folder, self.config.n_envs, progress=self.progress)
        shards = [Demonstrations.load(path) for path in paths]
        return Demonstrations.concatenate(shards[: len(train)]), Demonstrations.concatenate(shards[len(train) :])

    # -- Training ------------------------------------------------------------------------------------------------------

    def clone(self, train: Demonstrations, held_out: Demonstrations) -> MultiHeadPolicy:
        """The multi-head policy, cloned from the training rows."""
        path = self.folder.cloned
        if path.is_file():
            self.stages.skip("clone")
            return MultiHeadPolicy.load(path, self.config.device)
        policy = self._untrained()
        with self._stage("clone"):
            train_bc(policy, train, self.config.bc, held_out, self.logger, progress=self.progress)
        policy.save(path)
        return policy

    def dagger(self, policy: MultiHeadPolicy, train: Demonstrations, held_out: Demonstrations) -> MultiHeadPolicy:
        """The cloned policy after the DAgger rounds; saves it and all rows that it learned from."""
        rows = train
        if self.config.rounds:
            rows = self._rounds(policy, train, held_out)
        rows.save(self.folder.all_rows)
        policy.save(self.folder.policy)
        return policy

    def _rounds(self, policy: MultiHeadPolicy, train: Demonstrations, held_out: Demonstrations) -> Demonstrations:
        """Train a policy in all rounds, in place; returns all rows."""
        with self._stage("dagger"), self._venv() as venv:
            trainer = DAggerTrainer(
                venv,
                policy,
                train,
                self.config.dagger,
                self.config.round_bc,
                scratch_dir=self.folder.path / "dagger",
                logger=self.logger,
                validation=held_out,
                progress=self.progress,
                first_step=self.config.clone_steps,
            )
            if trainer.round_num == 0:
                self._log_round(policy, held_out, 0)
            trainer.run(self.config.rounds, lambda _, done: self._log_round(policy, held_out, done))
        return trainer.rows

    @contextlib.contextmanager
    def _venv(self) -> Iterator[VecEnv]:
        """One environment per task, as DAgger rounds want them; several where one task stands for all gaits."""
        config = self.config
        kwargs = config.env_kwargs | config.randomization_kwargs(config.randomized)
        per_task = ANY_GAIT_ENVS if config.is_any_gait else 1
        venv = make_venv(config.tasks, per_task, kwargs, config.round_perturbation, subproc=config.n_envs > 1)
        try:
            yield venv
        finally:
            with contextlib.suppress(EOFError, OSError):  # if a process has died, that is the error to be seen
                venv.close()

    def _log_round(self, policy: MultiHeadPolicy, held_out: Demonstrations, round_num: int) -> None:
        """A quick look at the closed loop, in figures and a film, for TensorBoard."""
        agent = f"round-{round_num}"
        episodes = self.config.round_episodes
        protocol = DRAWN if self.config.operator is None else OPERATOR
        closed_loop = {
            task: self._scores.closed_loop(policy, agent, task, episodes, protocol) for task in self.config.tasks
        }
        step = self._steps_after(round_num)
        log_round(self.logger, step, closed_loop, certified=certified(closed_loop.values()))
        if self.config.round_video_s:
            with contextlib.suppress(RenderingError):  # said once, where the other pictures are drawn
                path = self.folder.film(round_num)
                save_small_video(policy, self.config.tasks, self.config.round_video_s, path)
                log_film(self.logger, "film", Gif(path.read_bytes()), step)

    def phase_free(self, policy: MultiHeadPolicy) -> dict[str, Any]:
        """The policy with an estimate of the phase in its clock's place, by name; nothing where it has no clock."""
        config, path = self.config, self.folder.phase_free
        if not (config.phase_free_s and config.has_clock):
            return {}
        if not path.is_file():
            with self._stage("phase_free"):
                phase_free = train_phase_free(
                    policy,
                    config.phase_free_s,
                    config.phase_free_history,
                    perturbation=config.perturbation(NOISE_RAD),
                    config=config.phase,
                    seed=config.seed,
                    progress=self.progress,
                    **config.randomization_kwargs(config.randomized),
                )
            phase_free.save(path)
        else:
            self.stages.skip("phase_free")
        return {"phase_free": load(path)}

    def baselines(self) -> dict[str, Any]:
        """The pooled and the paper-literal policy by name, trained on the same rows with as many gradient steps."""
        paths = {name: self.folder.parts / f"{name}.zip" for name in baseline_names(self.config)}
        if not paths:
            return {}
        missing = [name for name, path in paths.items() if not path.is_file()]
        if missing:
            with self._stage("baselines"):
                train_baselines(self.config, missing, self.folder.parts, self.progress)
        else:
            self.stages.skip("baselines")
        return {name: load(path) for name, path in paths.items()}

    # -- Evaluation ----------------------------------------------------------------------------------------------------

    def evaluate(self, policies: Mapping[str, Any], held_out: Demonstrations) -> dict[str, Any]:
        """One-step errors and closed loop of the policies and the expert; writes and returns ``metrics.json``.

        Args:
            policies: by the names that `clone`, `phase_free` and `baselines` give them.
            held_out: rows that none of them learned from.
        """
        tasks = self._scores.one_step_errors(policies, held_out)
        with self._stage("evaluation"):
            for name, policy in {"expert": "expert", **policies}.items():
                for task in self.config.tasks:
                    tasks[task].setdefault(name, {}).update(self._scores.of(policy, name, task))
        metrics = {
            "tasks": tasks,
            "config": self.config.as_dict(),
            "seed": self.config.seed,
            "versions": versions(),
            "seconds": self.folder.seconds,
            "command": self.command,
        }
        write_json(self.folder.metrics, metrics)
        log_settings(self.logger, self.config.as_dict(), means(tasks), self._steps_after(self.config.rounds))
        return metrics

    # -- Pictures ------------------------------------------------------------------------------------------------------

    def draw(self, policy: MultiHeadPolicy, held_out: Demonstrations) -> None:
        """Write ``joint_targets.png``, ``<task>.gif`` and ``gaits.gif``.

        Raises:
            go1_mtl_gym.rendering.RenderingError: if no video can be drawn on this machine.
        """
        with self.stages.stage("pictures"):
            figure = joint_target_figure(policy, held_out)
            figure.savefig(self.folder.path / "joint_targets.png", dpi=120)
            log_figure(self.logger, "joint_targets", figure)
            save_videos(policy, self.config.tasks, self.config.video_s, self.folder.path, self.progress)

    # -- Details -------------------------------------------------------------------------------------------------------

    @contextlib.contextmanager
    def _stage(self, name: str) -> Iterator[None]:
        """Measure a stage, and show where it is."""
        with self.folder.stage(name), self.stages.stage(name):
            yield

    def _steps_after(self, rounds: int) -> int:
        """Gradient steps of cloning and so many rounds: the axis of the log."""
        return self.config.clone_steps + rounds * self.config.round_steps

    def _prepare_expert(self, demonstrations: Path) -> None:
        """Have the expert's loops compiled once, before every worker begins to do it, if they are not yet."""
        if demonstrations.is_dir() and any(demonstrations.glob("*.npz")):
            return
        sentence = "the expert gets ready; the first time on a machine it compiles its loops, in about half a minute"
        with announced_if_slow(sentence, self.progress):
            env = make_env(self.config.tasks[0], **self.config.env_kwargs)
            env.reset(seed=0)
            base_env(env).expert_action()
            env.close()

    def _untrained(self) -> MultiHeadPolicy:
        return new_policy(self.config, self.config.env_kwargs)
