"""What a policy knows of the environment that it is for."""

import functools
from collections.abc import Mapping
from typing import Any

import gymnasium

from go1_mtl_gym import TASKS
from go1_mtl_gym.contract import PolicyContract
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import one_of
from trainers.data.environments import base_env, make_env
from trainers.utils.files import json_form
from trainers.utils.validation import refuse_overridden


class ForEnvironment:
    """A policy that can make its environment.

    Attributes:
        contract: what gives its observations and actions their meaning; None for one that was made without.
        extra_env_kwargs: JSON values that `go1_mtl_gym.Go1Env` was given beyond what the contract says.
    """

    contract: PolicyContract | None
    extra_env_kwargs: dict[str, Any]

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks in the order of the task id.

        Raises:
            InvalidInputError: if the policy has no contract that names them.
        """
        return self.named_contract().tasks

    def named_contract(self) -> PolicyContract:
        """The contract, for whatever needs one: it names the tasks.

        Raises:
            InvalidInputError: if the policy has none.
        """
        if self.contract is None:
            raise InvalidInputError("a policy with a contract was expected: without one its tasks have no names")
        return self.contract

    @property
    def env_kwargs(self) -> dict[str, Any]:
        """Keyword arguments of `go1_mtl_gym.Go1Env` for the environment that the policy is for."""
        return self.extra_env_kwargs | (self.contract.env_kwargs if self.contract else {})

    def make_env(self, task: str | None = None, **env_kwargs: Any) -> gymnasium.Env:
        """The environment that the policy is for.

        Args:
            task: name of a task; None draws one of the policy's per episode.
            env_kwargs: of the environment, such as ``render_mode``; on top of the policy's own.

        Raises:
            InvalidInputError: if the policy does not have the task, or the arguments make an environment of another
                contract.
        """
        if task is not None:
            one_of(task, self.tasks, "task")
        refuse_overridden(env_kwargs, perturbation="trainers.make_env")
        self._check_registered()
        env = make_env(task, None, **{**self.env_kwargs, **env_kwargs})
        if self.contract is not None:
            self.contract.check(base_env(env).contract, "the policy", "the environment")
        return env

    def _check_registered(self) -> None:
        """Say how to make known what another process knew."""
        known = {} if self.contract is None else dict(zip(self.contract.tasks, self.contract.gaits))
        unknown = [(name, gait) for name, gait in known.items() if name not in TASKS]
        if unknown:
            raise InvalidInputError(
                f"the policy's task {unknown[0][0]!r} is not registered in this process: "
                f"go1_mtl_gym.register_task(Task({unknown[0][0]!r}, {unknown[0][1]}, command_range=...)) first"
            )


def json_arguments(env_kwargs: Mapping[str, Any], contract: PolicyContract | None) -> dict[str, Any]:
    """An environment's arguments as JSON values that the environment takes too, without what a contract says already.

    Raises:
        InvalidInputError: if one of them has no such form, so that a policy with it could not be saved, or says
            something else than the contract.
    """
    said = contract.env_kwargs if contract else {}
    for name, value in said.items():
        if name in env_kwargs and json_form(env_kwargs[name], name) != json_form(value, name):
            raise InvalidInputError(f"by the contract {name} is {value}, env_kwargs say {env_kwargs[name]}")
    env_kwargs = {name: value for name, value in env_kwargs.items() if name not in said}
    partial = [name for name, value in env_kwargs.items() if isinstance(value, functools.partial)]
    if partial:
        raise InvalidInputError(
            f"env_kwargs[{partial[0]!r}] must be a name that a file can hold, got {env_kwargs[partial[0]]!r}: put it "
            'at the top level of a module and name it as "module:name"'
        )
    return {name: json_form(value, f"env_kwargs[{name!r}]") for name, value in env_kwargs.items()}
