"""A policy drives a Go1 for five seconds, and what it did is printed.

python examples/quickstart.py                                       the policy that comes with the package
python examples/quickstart.py runs/<date>/policy.zip --task walk    one that you trained
python examples/quickstart.py --render                              in a window
"""

import argparse
from collections.abc import Sequence

import trainers
from trainers.utils.cli import main, positive_float


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Make the environment that the policy was trained for, and let it drive."""
    parser = argparse.ArgumentParser(description="Let a policy drive a Go1 and print what it does.")
    parser.add_argument("policy", nargs="?", help="file of a trained policy (default: the one in the package)")
    parser.add_argument("--task", default="trot", help="a gait that the policy knows (default: trot)")
    parser.add_argument(
        "--command",
        nargs=3,
        type=float,
        default=(0.5, 0.0, 0.0),
        metavar=("VX", "VY", "YAW"),
        help="velocity forward and to the left [m/s], yaw rate [rad/s] (default: 0.5 0 0)",
    )
    parser.add_argument("--seconds", type=positive_float, default=5.0, help="of robot time (default: 5)")
    parser.add_argument("--render", action="store_true", help="open a window")
    options = parser.parse_args(arguments)

    policy = trainers.load(options.policy) if options.policy else trainers.load_pretrained()
    render_mode = "human" if options.render else None
    env = policy.make_env(options.task, render_mode=render_mode)
    obs, info = env.reset(seed=0, options={"command": tuple(options.command)})
    fallen = False
    for _ in range(round(options.seconds * env.unwrapped.control_hz)):
        action, _ = policy.predict(obs, deterministic=True)
        obs, _, fallen, truncated, info = env.step(action)
        if fallen or truncated:
            break
    env.close()
    vx, vy, yaw_rate = info["base_velocity"]
    print(f"{info['task']}: {'fell' if fallen else 'still up'}, {vx:.2f} m/s forward, {vy:.2f} m/s left,", end=" ")
    print(f"{yaw_rate:.2f} rad/s; asked for {options.command[0]:g}, {options.command[1]:g}, {options.command[2]:g}")


if __name__ == "__main__":
    raise SystemExit(run())
