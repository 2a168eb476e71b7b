"""Reinforcement learning that goes on from a trained policy, instead of from nothing.

python examples/ppo.py --steps 100000 --out runs/ppo.zip
"""

import argparse
import shlex
from collections.abc import Sequence

import trainers
from trainers.utils.cli import interpreter, main, positive_int, writable_file


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Measure the policy, improve it by PPO on the environments' reward, and measure it again."""
    parser = argparse.ArgumentParser(description="Go on from the policy that comes with the package with PPO.")
    parser.add_argument(
        "--steps", type=positive_int, default=50_000, help="of the environments together (default: 50000, some minutes)"
    )
    parser.add_argument("--critic-steps", type=int, default=16_384, help="to fit the critic first (default: 16384)")
    parser.add_argument("--episodes", type=positive_int, default=4, help="to measure it (default: 4)")
    parser.add_argument("--out", default="runs/ppo.zip", help="file of the policy")
    options = parser.parse_args(arguments)
    out = writable_file(options.out)

    policy = trainers.load_pretrained()
    venv = trainers.make_venv(policy.tasks, 1, policy.env_kwargs)
    model = trainers.ppo_from_policy(policy, venv, critic_steps=options.critic_steps, progress=True, verbose=1)
    model.learn(options.steps)
    venv.close()
    model.policy.save(out)

    for task in policy.tasks:
        before, after = (
            100 * trainers.evaluate(each, task, options.episodes, 10.0, progress=True).success_rate
            for each in (policy, model.policy)
        )
        print(f"{task}: success in {before:.0f} % of {options.episodes} episodes before, {after:.0f} % after")
    print(f"run it with: {interpreter()} examples/quickstart.py {shlex.quote(str(out))}")


if __name__ == "__main__":
    raise SystemExit(run())
