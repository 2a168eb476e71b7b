"""The MPC expert drives alone, through a change of gait and a push; no network is involved.

python examples/expert.py --task trot --then bound
"""

import argparse
from collections.abc import Sequence

import gymnasium as gym

import go1_mtl_gym
from trainers.utils.cli import main, positive_float


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Drive with `expert_action`, which answers for the present state and changes nothing."""
    parser = argparse.ArgumentParser(description="Let the MPC expert drive through a change of gait and a push.")
    parser.add_argument("--task", choices=go1_mtl_gym.TASKS, default="trot", help="first gait (default: trot)")
    parser.add_argument("--then", choices=go1_mtl_gym.TASKS, default="walk", help="second gait (default: walk)")
    parser.add_argument("--seconds", type=positive_float, default=3.0, help="of each gait (default: 3)")
    options = parser.parse_args(arguments)

    env = gym.make(go1_mtl_gym.env_id(options.task))
    robot = env.unwrapped
    _, info = env.reset(seed=0, options={"command": (0.4, 0.0, 0.2)})
    for task in (options.task, options.then):
        robot.set_task(task)
        robot.push((0.0, 0.3, 0.0))  # a sudden sideways velocity of the trunk [m/s]
        for _ in range(round(options.seconds * robot.control_hz)):
            *_, info = env.step(robot.expert_action())
        vx, vy, yaw_rate = info["base_velocity"]
        print(f"{info['task']}: fallen {info['fallen']}, velocity {vx:.2f}, {vy:.2f} m/s, {yaw_rate:.2f} rad/s")
    env.close()


if __name__ == "__main__":
    raise SystemExit(run())
