"""Without a clock: a trained policy learns to read the phase of its gait from what it feels.

python examples/phase_free.py --out runs/phase_free.zip
"""

import argparse
from collections.abc import Sequence

import trainers
from trainers.utils.cli import main


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Watch the policy walk with its clock, and put an estimate of the phase in the clock's place."""
    parser = argparse.ArgumentParser(description="Make a policy that needs no gait clock from one that does.")
    parser.add_argument("--policy", help="file of a policy with a clock (default: the one in the package)")
    parser.add_argument("--seconds", type=float, default=30.0, help="of walking per gait (default: 30)")
    parser.add_argument("--steps", type=int, default=1000, help="of gradient descent (default: 1000)")
    parser.add_argument("--episodes", type=int, default=4, help="to measure it (default: 4)")
    parser.add_argument("--out", default="runs/phase_free.zip", help="file of the policy")
    options = parser.parse_args(arguments)

    policy = trainers.load(options.policy) if options.policy else trainers.load_pretrained()
    config = trainers.PhaseConfig(steps=options.steps)
    phase_free = trainers.train_phase_free(policy, options.seconds, config=config, progress=True)
    phase_free.save(options.out)

    print(f"with a clock it sees    {', '.join(policy.env_kwargs['channels'])}")
    history = phase_free.env_kwargs["history"]
    print(f"without one it sees     {', '.join(phase_free.env_kwargs['channels'])} and {history} frames")
    for task in phase_free.env_kwargs["tasks"]:
        result = trainers.evaluate(phase_free, task, options.episodes, seconds=10.0)
        print(f"{task}: success in {100 * result.success_rate:.0f} % of {options.episodes} episodes without a clock")


if __name__ == "__main__":
    raise SystemExit(run())
