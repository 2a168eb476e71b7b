"""A wrapper of the Go1 that draws something itself."""

from typing import TYPE_CHECKING, Any, ClassVar, cast

import gymnasium
import numpy as np

if TYPE_CHECKING:
    from go1_mtl_gym.env import Go1Env


class SeededWrapper(gymnasium.Wrapper):
    """Has a generator of its own beside the environment's, which therefore draws the same with it and without.

    Args:
        env: a `Go1Env`, wrapped or not.
    """

    _STREAM: ClassVar[int]
    """Tells a class's generator from those of the others that are seeded by the same `reset`."""

    def __init__(self, env: gymnasium.Env) -> None:
        """Wrap an environment; see the class."""
        super().__init__(env)
        self._rng = np.random.default_rng()

    @property
    def _go1(self) -> "Go1Env":
        return cast("Go1Env", self.env.unwrapped)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Reset the environment; a seed also seeds this wrapper."""
        result = self.env.reset(seed=seed, options=options)
        if seed is not None:
            self._rng = np.random.default_rng([seed, self._STREAM])
        return result
