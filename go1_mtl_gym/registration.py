"""Gymnasium ids: one per task, and one for all of them."""

import gymnasium

from go1_mtl_gym.tasks import TASKS, Task, add_task


def env_id(task: str | None) -> str:
    """The id under which a task's environment can be made from anywhere; None names the multi-gait environment.

    "fast_trot" gives ``go1_mtl_gym:Go1FastTrot-v0``.
    """
    words = "multi_gait" if task is None else task
    return f"go1_mtl_gym:Go1{''.join(word.capitalize() for word in words.split('_'))}-v0"


def register_task(task: Task) -> None:
    """Make a task known to everything: `TASKS`, the Gymnasium id ``Go1<Name>-v0``, environments, trainers.

    Environments and policies made afterwards have it in their task id, after the tasks that were there before. To
    register an equal task again does nothing. Environments that are pickled take their tasks along, and so do the
    worker processes that `trainers` starts.

    Raises:
        InvalidInputError: if it is no `Task`, its name is no word like "amble" or "fast_trot", or another task has it.
    """
    if add_task(task):
        _register_id(task.name)


def _register_id(task: str | None) -> None:
    gymnasium.register(
        id=env_id(task).partition(":")[2],
        entry_point="go1_mtl_gym.env:Go1Env",
        kwargs={"task": task},
    )


def register_built_in() -> None:
    """Register the ids of the tasks that come with the package, and the multi-gait one."""
    for task in (None, *TASKS):
        _register_id(task)
