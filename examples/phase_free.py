"""Without a clock: a trained policy learns to read the phase of its gait from what it feels.

python examples/phase_free.py --out runs/phase_free.zip
"""

import argparse
import shlex
from collections.abc import Sequence

import trainers
from trainers.utils.cli import interpreter, main, positive_float, positive_int, writable_file


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Watch the policy walk with its clock, and put an estimate of the phase in the clock's place."""
    parser = argparse.ArgumentParser(description="Make a policy that needs no gait clock from one that does.")
    parser.add_argument("--policy", help="file of a policy with a clock (default: the one in the package)")
    parser.add_argument("--seconds", type=positive_float, default=30.0, help="of walking per gait (default: 30)")
    parser.add_argument("--steps", type=positive_int, default=1000, help="of gradient descent (default: 1000)")
    parser.add_argument("--episodes", type=positive_int, default=4, help="to measure it (default: 4)")
    parser.add_argument("--out", default="runs/phase_free.zip", help="file of the policy")
    options = parser.parse_args(arguments)
    out = writable_file(options.out)

    policy = trainers.load(options.policy) if options.policy else trainers.load_pretrained()
    config = trainers.PhaseConfig(steps=options.steps)
    phase_free = trainers.train_phase_free(policy, options.seconds, config=config, progress=True)
    phase_free.save(out)

    print(f"with a clock it sees    {', '.join(policy.env_kwargs['channels'])}")
    history = phase_free.env_kwargs["history"]
    print(f"without one it sees     {', '.join(phase_free.env_kwargs['channels'])} and {history} frames")
    for task in phase_free.env_kwargs["tasks"]:
        result = trainers.evaluate(phase_free, task, options.episodes, seconds=10.0)
        print(f"{task}: success in {100 * result.success_rate:.0f} % of {options.episodes} episodes without a clock")
    print(f"run it with: {interpreter()} examples/quickstart.py {shlex.quote(str(out))}")
    if any(getattr(options, name) < parser.get_default(name) for name in ("seconds", "steps")):
        print("So little training is not enough to read the phase; leave out --seconds and --steps to train in full.")


if __name__ == "__main__":
    raise SystemExit(run())
