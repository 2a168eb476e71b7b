"""Collecting for DAgger: learner and expert take turns at the controls, the expert labels every state."""

from os import PathLike
from typing import Any

import numpy as np
from imitation.algorithms.dagger import InteractiveTrajectoryCollector
from stable_baselines3.common.vec_env import VecEnv

from go1_mtl_gym.errors import Go1Error, InvalidInputError
from trainers.data.collection import BEFORE_FALL_S
from trainers.data.environments import flat_obs
from trainers.data.stateful import Learner


class StarvedCollectorError(Go1Error):
    """Episodes end so early that the rows asked for cannot be had."""


class BlockCollector(InteractiveTrajectoryCollector):
    """`imitation`'s collector with blocks of control instead of a coin per step, and with row budgets.

    Each environment is driven in blocks of random duration; a block belongs to the expert with probability `beta`, else
    to the learner, so that states are seen that only come of following the learner for a while. With `takeover_rad`,
    the expert takes over for a block as soon as the learner's joint targets are too far from its own: the safety rule
    of SafeDAgger (Zhang & Cho, 2017, arXiv 1605.06450), decided by the expert itself, not by a learned safety policy.
    ``step(expert_actions)`` records the expert's actions as labels whoever drives. An environment that has its rows is
    no longer recorded (it is stepped with the expert's actions until all have theirs). The last 0.24 s before a fall
    are dropped.

    Args:
        venv: environments of any tasks.
        learner: asked for the actions of all environments at every step, whoever drives.
        beta: probability that a block is the expert's.
        save_dir: kept for `imitation`; nothing is written here.
        rng: draws the blocks.
        rows_per_env: rows to record from each environment, shape (n_envs,).
        control_hz: rate of the environments.
        block_s: shortest and longest block [s].
        half_range: radians per unit of action, shape (12,); needed for `takeover_rad`.
        takeover_rad: largest root mean square over the joints of learner's less expert's target [rad] under which the
            learner goes on driving; None lets it drive its blocks to the end.

    Attributes:
        falls: recorded episodes that ended in a fall, whoever drove.
        takeovers: learner's blocks that the expert cut short, or took before their first step.

    Raises:
        InvalidInputError: if an argument is not as described.
    """

    _last_obs: np.ndarray
    _last_user_actions: np.ndarray

    def __init__(
        self,
        venv: VecEnv,
        learner: Learner,
        beta: float,
        save_dir: str | PathLike[str],
        rng: np.random.Generator,
        *,
        rows_per_env: np.ndarray,
        control_hz: float,
        block_s: tuple[float, float] = (0.3, 1.0),
        half_range: np.ndarray | None = None,
        takeover_rad: float | None = None,
    ) -> None:
        if not 0 <= beta <= 1 or not 0 < block_s[0] <= block_s[1]:
            raise InvalidInputError(f"beta must lie in [0, 1] and block_s be 0 < a <= b, got {beta} and {block_s}")
        if takeover_rad is not None and (half_range is None or not takeover_rad > 0):
            raise InvalidInputError(f"takeover_rad must be positive and come with half_range, got {takeover_rad}")
        super().__init__(venv, self._learners_actions, beta, save_dir, rng)
        self._learner = learner
        self._wanted = np.broadcast_to(np.asarray(rows_per_env, dtype=int), (venv.num_envs,))
        self._control_hz = control_hz
        self._block_s = block_s
        self._half_range = half_range
        self._takeover_rad = takeover_rad
        self._learner_steps = self._steps = self.falls = self.takeovers = 0

    # -- The vector environment ----------------------------------------------------------------------------------------

    def reset(self) -> np.ndarray:
        """Reset all environments and forget what was recorded."""
        n = self.num_envs
        self._obs: list[list[np.ndarray]] = [[] for _ in range(n)]
        self._acts: list[list[np.ndarray]] = [[] for _ in range(n)]
        self._starts: list[list[int]] = [[0] for _ in range(n)]
        self._left = np.zeros(n, dtype=int)
        self._experts_turn = np.zeros(n, dtype=bool)
        self._finished = self._wanted == 0
        self._last_obs = flat_obs(self.venv.reset())
        self._begins = np.ones(n, dtype=bool)
        self._is_reset = True
        return self._last_obs

    def step_async(self, actions: np.ndarray) -> None:
        """Drive each environment by whoever's turn it is.

        Args:
            actions: the expert's actions for the present states, shape (n_envs, 12).
        """
        if not self._is_reset:
            raise InvalidInputError("call reset() before step()")
        proposed = self.get_robot_acts(self._last_obs)
        self._draw_blocks()
        if self._takeover_rad is not None:
            self._take_over(proposed - actions)
        learner = ~self._experts_turn & ~self._finished
        driven = np.array(actions, dtype=np.float32)
        driven[learner] = proposed[learner]
        self._learner_steps += int(learner.sum())
        self._steps += int((~self._finished).sum())
        self._last_user_actions = np.array(actions, dtype=np.float32)
        self.venv.step_async(driven)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Record the states that were left and what the expert would have done in them."""
        seen, rewards, dones, infos = self.venv.step_wait()
        obs = flat_obs(seen)
        for i in np.flatnonzero(~self._finished).tolist():
            self._obs[i].append(self._last_obs[i].copy())
            self._acts[i].append(self._last_user_actions[i])
            if dones[i]:
                fell = _fell(infos[i])
                self.falls += fell
                self._end_episode(i, fell)
        self._left = np.where(dones, 0, self._left - 1)
        self._finished = np.array([len(rows) for rows in self._obs]) >= self._wanted
        self._last_obs, self._begins = obs, np.array(dones, dtype=bool)
        if self._steps > 20 * self.wanted + 1000:
            raise StarvedCollectorError(f"kept {self.rows} of {self._steps} steps, wanted {self.wanted}")
        return obs, rewards, dones, infos

    def _learners_actions(self, obs: np.ndarray) -> np.ndarray:
        return self._learner.act(obs, self._begins)

    def _draw_blocks(self) -> None:
        for i in np.flatnonzero(self._left <= 0):
            self._left[i] = self._draw_duration()
            self._experts_turn[i] = self.rng.uniform() < self.beta

    def _draw_duration(self) -> int:
        return max(1, round(self.rng.uniform(*self._block_s) * self._control_hz))

    def _take_over(self, difference: np.ndarray) -> None:
        """Begin an expert's block where the learner drives and its action less the expert's, (n_envs, 12), is large."""
        distance = np.sqrt(np.mean((difference * self._half_range) ** 2, axis=1))
        for i in np.flatnonzero(~self._experts_turn & ~self._finished & (distance > self._takeover_rad)):
            self._left[i] = self._draw_duration()
            self._experts_turn[i] = True
            self.takeovers += 1

    def _end_episode(self, i: int, fell: bool) -> None:
        keep = len(self._obs[i])
        if fell:
            keep = max(self._starts[i][-1], keep - round(BEFORE_FALL_S * self._control_hz))
        del self._obs[i][keep:], self._acts[i][keep:]
        if keep != self._starts[i][-1]:
            self._starts[i].append(keep)

    # -- What was recorded ---------------------------------------------------------------------------------------------

    @property
    def finished(self) -> bool:
        """Whether every environment has its rows."""
        return bool(self._finished.all())

    @property
    def wanted(self) -> int:
        """Rows that all environments together should give."""
        return int(self._wanted.sum())

    @property
    def rows(self) -> int:
        """Rows recorded so far."""
        return sum(len(rows) for rows in self._obs)

    @property
    def learner_fraction(self) -> float:
        """Share of recorded steps that the learner drove."""
        return self._learner_steps / max(1, self._steps)

    def recorded(self) -> dict[str, np.ndarray]:
        """Arrays `obs` (n, D), `acts` (n, 12), `starts` (n,), one environment after the other."""
        starts = [np.isin(np.arange(len(rows)), first) for rows, first in zip(self._obs, self._starts)]
        return {
            "obs": np.array([row for rows in self._obs for row in rows], dtype=np.float32),
            "acts": np.array([row for rows in self._acts for row in rows], dtype=np.float32),
            "starts": np.concatenate(starts),
        }


def _fell(info: dict[str, Any]) -> bool:
    return bool(info.get("fallen", not info.get("TimeLimit.truncated", False)))
