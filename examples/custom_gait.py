"""A gait of your own is data: register it, and environment, expert and trainer know it.

python examples/custom_gait.py
"""

import argparse
from collections.abc import Sequence

import gymnasium as gym

from go1_mtl_gym import Gait, Task, register_task
from trainers.utils.cli import main, positive_float

AMBLE = Gait("amble", period=0.5, duty=0.65, offsets=(0.25, 0.75, 0.0, 0.5))
"""Cycle [s], fraction of it on the ground, and when each leg (FL FR RL RR) begins its cycle."""


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Register the gait and let the expert walk it."""
    parser = argparse.ArgumentParser(description="Register a new gait and let the MPC expert walk it.")
    parser.add_argument("--seconds", type=positive_float, default=3.0, help="of robot time (default: 3)")
    options = parser.parse_args(arguments)

    register_task(Task("amble", AMBLE, command_range=(0.5, 0.2, 0.5)))  # vx, vy [m/s], yaw rate [rad/s]
    env = gym.make("Go1Amble-v0")
    _, info = env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    for _ in range(round(options.seconds * env.unwrapped.control_hz)):
        *_, info = env.step(env.unwrapped.expert_action())
    env.close()
    print(f"amble: fallen {info['fallen']}, {info['base_velocity'][0]:.2f} m/s forward; asked for 0.3")


if __name__ == "__main__":
    raise SystemExit(run())
