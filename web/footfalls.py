"""When the expert has its feet on the ground, recorded, for the page to lay beside the network's."""

import numpy as np

from go1_mtl_gym import TASKS, PolicyContract
from trainers.data.environments import base_env, make_env

SETTLE_S, RECORD_S = 2.0, 4.0
"""Of a drive: what does not count, and what is recorded [s]."""
SHARE = 0.5
"""Of the task's range, forward; what it is recorded at."""


def expert_footfalls(contract: PolicyContract) -> dict[str, list[list[int]]]:
    """Contacts of the expert by task, along one cycle of its gait.

    Args:
        contract: of the policy that it is compared with: tasks, rate and gains are the same.

    Returns:
        Of each task as many rows as control periods fit into a cycle; each has 1 for every foot (FL, FR, RL, RR) that
        was on the ground in at least half of the cycles.
    """
    return {name: _footfalls(name, contract) for name in contract.tasks}


def _footfalls(name: str, contract: PolicyContract) -> list[list[int]]:
    task = TASKS[name]
    env = make_env(name, None, **{**contract.env_kwargs, "episode_s": SETTLE_S + RECORD_S})
    base = base_env(env)
    _, info = env.reset(seed=1, options={"command": (SHARE * task.command_range[0], 0.0, 0.0)})
    bins = max(1, round(task.gait.period * contract.control_hz))
    on_ground, seen = np.zeros((bins, 4)), np.zeros((bins, 1))
    for step in range(round((SETTLE_S + RECORD_S) * contract.control_hz)):
        _, _, _, _, info = env.step(base.expert_action())
        if step >= SETTLE_S * contract.control_hz:
            place = min(int(info["phase"] * bins + 1e-6), bins - 1)
            on_ground[place] += info["contacts"]
            seen[place] += 1
    return (on_ground >= np.maximum(seen, 1) / 2).astype(int).tolist()
