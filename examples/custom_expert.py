"""Any object with `reset` and `action` can be the expert: here one that stands and nods.

python examples/custom_expert.py
"""

import argparse
from collections.abc import Sequence

import gymnasium as gym
import numpy as np

from go1_mtl_gym import RobotState
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.robot import HOME_POSE
from trainers.utils.cli import main

NOD = np.tile([0.0, 0.12, -0.24], 4) * np.repeat([1.0, 1.0, -1.0, -1.0], 3)
"""Front legs bend while hind legs stretch [rad]; legs FL FR RL RR, joints hip thigh calf."""


class NoddingExpert:
    """Joint targets around the home pose, in time with the gait clock.

    Args:
        gains: of the environment's actuators; not needed here.
        hold_s: how long a target is held [s]; not needed here.
    """

    def __init__(self, gains: PDGains, hold_s: float) -> None:
        pass

    def reset(self, state: RobotState) -> None:
        """Begin an episode; this expert remembers nothing."""

    def action(self, state: RobotState) -> np.ndarray:
        """Joint targets [rad], shape (12,); a function of the state alone gives labels that a network can learn."""
        return HOME_POSE + NOD * np.sin(2 * np.pi * state.phase)


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Let the expert drive."""
    parser = argparse.ArgumentParser(description="Let an expert of your own drive.")
    parser.add_argument("--seconds", type=float, default=3.0, help="of robot time (default: 3)")
    options = parser.parse_args(arguments)

    env = gym.make("go1_mtl_gym:Go1Trot-v0", expert=NoddingExpert)
    _, info = env.reset(seed=0, options={"command": (0.3, 0.0, 0.0)})
    pitch = []
    for _ in range(round(options.seconds * env.unwrapped.control_hz)):
        *_, info = env.step(env.unwrapped.expert_action())
        pitch.append(env.unwrapped.state.rpy[1])
    env.close()
    print(f"fallen {info['fallen']}, pitch from {min(pitch):.2f} to {max(pitch):.2f} rad")


if __name__ == "__main__":
    raise SystemExit(run())
