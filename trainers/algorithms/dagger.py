"""DAgger on `imitation`'s trainer: our collector, shards, batches and loss in its rounds."""

import dataclasses
import json
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from imitation.algorithms import dagger as imitation_dagger
from imitation.util.logger import HierarchicalLogger
from stable_baselines3.common.vec_env import VecEnv

from go1_mtl_gym.errors import InvalidInputError
from trainers.algorithms.bc import BCHistory, BCTrainer
from trainers.algorithms.config import BCConfig, DAggerConfig
from trainers.algorithms.dagger_collector import BlockCollector
from trainers.data.collection import ShardMismatchError
from trainers.data.demonstrations import Demonstrations
from trainers.data.environments import contracts_of, derive_seed, flat_obs, settings_of
from trainers.data.stateful import Learner
from trainers.policies.checkpoint import fingerprint
from trainers.policies.expert_policy import ExpertPolicy
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.utils.files import json_ready, write_json
from trainers.utils.logging import make_logger
from trainers.utils.progress import Bar


class DAggerTrainer(imitation_dagger.DAggerTrainer):
    """Rounds of collecting with learner and expert taking turns, and cloning on all rows so far (Ross et al., 2011).

    The environments own the gait clock, so expert and learner share it. Under `scratch_dir` stand ``config.json``,
    ``demos/round-000/demonstrations.npz`` and ``policy-000.zip`` per round, each complete or absent: a trainer made
    anew on the same folder with the same settings takes finished parts from there.

    Args:
        venv: environments of all tasks, e.g. from `trainers.make_venv`, with a method ``expert_action``.
        policy: the student, already cloned on `base`; its normalisation stays as it is.
        base: demonstrations that every round trains on too.
        config: how to collect.
        bc_config: how to clone in each round.
        scratch_dir: folder for resuming.
        logger: from `trainers.make_logger`; shared by collection and cloning. None logs nothing.
        validation: held-out rows whose R2 is logged, or None.
        progress: show bars.
        first_step: gradient steps of the cloning, where the log's axis goes on.

    Raises:
        InvalidInputError: if environments, policy and base do not belong together.
        ShardMismatchError: if `scratch_dir` was filled with other settings, or on another base.
    """

    bc_trainer: BCTrainer

    def __init__(
        self,
        venv: VecEnv,
        policy: MultiHeadPolicy,
        base: Demonstrations,
        config: DAggerConfig | None = None,
        bc_config: BCConfig | None = None,
        *,
        scratch_dir: str | PathLike[str],
        logger: HierarchicalLogger | None = None,
        validation: Demonstrations | None = None,
        progress: bool = False,
        first_step: int = 0,
    ) -> None:
        self.config = config or DAggerConfig()
        for contract in contracts_of(venv):
            base.contract.check(contract, "the base", "the environments")
        self.base = base.fitted_to(policy.contract)
        if self.base.tasks != base.tasks:
            raise InvalidInputError(f"the policy has the tasks {policy.tasks}, environments and base have {base.tasks}")
        self.validation = None if validation is None else validation.fitted_to(policy.contract)
        self.progress = progress
        logger = make_logger() if logger is None else logger
        super().__init__(
            venv=venv,
            scratch_dir=scratch_dir,
            rng=np.random.default_rng(self.config.seed),
            beta_schedule=self.config.beta_of,
            bc_trainer=BCTrainer(policy, bc_config, logger, first_step),
            custom_logger=logger,
        )
        self.expert_policy = ExpertPolicy(venv)
        self._rounds: list[Demonstrations] = []
        self._claim_folder()

    @property
    def policy(self) -> MultiHeadPolicy:
        """The student."""
        return self.bc_trainer.policy

    # -- Rounds --------------------------------------------------------------------------------------------------------

    def run(self, rounds: int, callback: Callable[["DAggerTrainer", int], None] | None = None) -> MultiHeadPolicy:
        """Collect and train until `rounds` rounds are done.

        Args:
            rounds: total number, those found in `scratch_dir` included.
            callback: called as ``callback(trainer, rounds_done)`` after each round; evaluate and log there.

        Returns:
            The policy.
        """
        while self.round_num < rounds:
            self.collect_round()
            self.train_round()
            if callback is not None:
                callback(self, self.round_num)
        return self.policy

    @property
    def rows(self) -> Demonstrations:
        """All rows so far: the base and every round collected."""
        return Demonstrations.concatenate([self.base, *self._rounds])

    def collect_round(self, seconds_per_task: float | None = None) -> Demonstrations:
        """Record the present round, or read it if it was recorded before.

        Args:
            seconds_per_task: rows of each task [s]; None takes the configuration's.
        """
        if len(self._rounds) > self.round_num:
            return self._rounds[-1]
        seconds = self.config.seconds_per_task if seconds_per_task is None else seconds_per_task
        path = self._demo_dir_path_for_round() / "demonstrations.npz"
        meta = {"dagger_round": self.round_num, "seconds_per_task": seconds, "beta": self.beta_schedule(self.round_num)}
        rows = _read_round(path, meta)
        if rows is None:
            collector = self.create_trajectory_collector(seconds)
            self._drive(collector)
            counts = {name: getattr(collector, name) for name in ("learner_fraction", "falls", "takeovers")}
            for name, value in counts.items():
                self.logger.record(f"dagger/{name}", value)
            arrays: dict[str, Any] = collector.recorded()
            rows = dataclasses.replace(self.base, **arrays, meta=meta | counts)
            rows.save(path)
        self._rounds.append(rows)
        return rows

    def train_round(self, on_batch_end: Callable[[], None] | None = None) -> BCHistory | None:
        """Clone on all rows so far and go on to the next round.

        Returns:
            Losses over the steps; None if the round's policy was found in `scratch_dir` instead.

        Raises:
            imitation.algorithms.dagger.NeedsDemosException: if the round was not collected.
        """
        if len(self._rounds) <= self.round_num:
            raise imitation_dagger.NeedsDemosException(f"call collect_round() before train_round() {self.round_num}")
        path = self.scratch_dir / f"policy-{self.round_num:03d}.zip"
        history = None
        if path.is_file():
            self.policy.load_state_dict(MultiHeadPolicy.load(path, self.policy.device).state_dict())
            self.bc_trainer.steps_done += self.bc_trainer.config.steps
        else:
            data = self.rows
            weights = np.full(len(data), self.config.round_weight)
            weights[: len(self.base)] = 1
            for name, value in {"round": self.round_num, "rows": len(data)}.items():
                self.logger.record(f"dagger/{name}", value, exclude="tensorboard")  # lines that only climb
            seed = derive_seed("round", self.bc_trainer.config.seed, self.round_num)
            history = self.bc_trainer.fit(data, self.validation, self.progress, on_batch_end, seed, weights)
            self.policy.save(path)
        self.round_num += 1
        return history

    # -- What imitation's trainer is asked for -------------------------------------------------------------------------

    def create_trajectory_collector(self, seconds_per_task: float | None = None) -> BlockCollector:
        """The collector of the present round; it is a vector environment whose `step` takes the expert's actions."""
        seconds = self.config.seconds_per_task if seconds_per_task is None else seconds_per_task
        round_seed = derive_seed("dagger", self.config.seed, self.round_num)
        self.venv.seed(round_seed)
        return BlockCollector(
            self.venv,
            Learner(self.policy),
            self.beta_schedule(self.round_num),
            self._demo_dir_path_for_round(),
            np.random.default_rng(round_seed),
            rows_per_env=self._rows_per_env(seconds),
            control_hz=self.base.control_hz,
            block_s=self.config.block_s,
            half_range=self.base.half_range,
            takeover_rad=self.config.takeover_rad,
        )

    def extend_and_update(self, bc_train_kwargs: Any = None) -> int:
        """`imitation`'s name for `train_round`; returns the next round's number.

        Raises:
            InvalidInputError: if keyword arguments are given: `BCConfig` holds them here.
        """
        if bc_train_kwargs:
            raise InvalidInputError(f"cloning is described by bc_config, got bc_train_kwargs={bc_train_kwargs!r}")
        self.train_round()
        return self.round_num

    def save_trainer(self) -> tuple[Path, Path]:
        """Save the policy; everything else is on disk already. Returns (scratch_dir, path of the policy)."""
        path = self.scratch_dir / "policy-latest.zip"
        self.policy.save(path)
        return self.scratch_dir, path

    # -- Details -------------------------------------------------------------------------------------------------------

    def _drive(self, collector: BlockCollector) -> None:
        obs = collector.reset()
        with Bar(f"collect round {self.round_num + 1}", collector.wanted, "row", self.progress) as bar:
            while not collector.finished:
                seen, *_ = collector.step(self.expert_policy.predict(obs)[0])
                obs = flat_obs(seen)
                bar.update(collector.rows - bar.n)

    def _rows_per_env(self, seconds_per_task: float) -> np.ndarray:
        """Share each task's rows among its environments, by the task ids of their first observations."""
        task = flat_obs(self.venv.reset())[:, -len(self.base.tasks) :].argmax(axis=1)
        count = np.bincount(task, minlength=len(self.base.tasks))
        has_rows = np.bincount(self.base.task, minlength=len(self.base.tasks)) > 0
        left_out = [name for name, count_k, known in zip(self.base.tasks, count, has_rows) if known and not count_k]
        if left_out:
            raise InvalidInputError(f"no environment begins in {', '.join(left_out)}, of which the base has rows")
        return np.ceil(seconds_per_task * self.base.control_hz / count[task]).astype(int)

    def _claim_folder(self) -> None:
        settings = {
            "config": dataclasses.asdict(self.config),
            "bc_config": dataclasses.asdict(self.bc_trainer.config),
            "network": self.policy.network_kwargs() | {"contract": None},
            "contract": self.base.contract.as_dict(),
            "base": self.base.fingerprint(),
            "policy": fingerprint(self.policy),
            "environments": settings_of(self.venv),
        }
        settings = json_ready(settings)
        path = self.scratch_dir / "config.json"
        if not path.is_file():
            write_json(path, settings)
            return
        claimed = json.loads(path.read_text())
        for name, kind in (("config", DAggerConfig), ("bc_config", BCConfig)):  # with options that came later
            claimed[name] = json_ready(dataclasses.asdict(kind())) | claimed.get(name, {})
        differing = sorted(name for name in settings | claimed if settings.get(name) != claimed.get(name))
        if differing:
            raise ShardMismatchError(
                f"{self.scratch_dir} holds rounds made with another {', '.join(differing)}; use another folder"
            )


def _read_round(path: Path, meta: dict[str, Any]) -> Demonstrations | None:
    """The rows of a finished round; None if they must be (re)made."""
    try:
        rows = Demonstrations.load(path)
    except InvalidInputError:  # absent or damaged
        return None
    made_from = {key: rows.meta.get(key) for key in meta}
    if made_from != meta:
        raise ShardMismatchError(f"{path} was made from {made_from}, now asked for {meta}; use another folder")
    return rows
