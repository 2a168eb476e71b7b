"""Any object with `reset` and `action` can be the expert: here one that stands and nods.

python examples/custom_expert.py
"""

import argparse
from collections.abc import Sequence

import numpy as np

import trainers
from go1_mtl_gym import RobotState
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.robot import HOME_POSE
from trainers.utils.cli import main, positive_float

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
    """Let the expert drive, and keep what it saw and did as rows to learn from."""
    parser = argparse.ArgumentParser(description="Collect demonstrations of an expert of your own.")
    parser.add_argument("--seconds", type=positive_float, default=3.0, help="of robot time (default: 3)")
    options = parser.parse_args(arguments)

    rows = trainers.collect("trot", seconds=options.seconds, env_kwargs={"expert": NoddingExpert})
    targets = rows.acts * rows.contract.action_scale + rows.contract.default_q
    front_knee = targets[:, rows.contract.joints.index("FL_calf_joint")]
    print(f"{len(rows)} rows in {rows.starts.sum()} episode,", end=" ")
    print(f"front left knee from {front_knee.min():.2f} to {front_knee.max():.2f} rad")


if __name__ == "__main__":
    raise SystemExit(run())
