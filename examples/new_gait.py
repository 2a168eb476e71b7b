"""A trained policy learns another gait from a minute of demonstrations; what it does in its old ones stays as it is.

python examples/new_gait.py --task pace --out runs/with_pace.zip
"""

import argparse
import shlex
from collections.abc import Sequence

import trainers
from trainers.utils.cli import interpreter, main, positive_float, positive_int, writable_file


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Give the policy a head for the gait, and train that head alone."""
    parser = argparse.ArgumentParser(description="Teach the policy that comes with the package another gait.")
    parser.add_argument("--task", default="pace", help="gait that the policy does not know (default: pace)")
    parser.add_argument("--seconds", type=positive_float, default=60.0, help="of demonstrations (default: 60)")
    parser.add_argument("--steps", type=positive_int, default=1000, help="of gradient descent (default: 1000)")
    parser.add_argument("--episodes", type=positive_int, default=4, help="to measure it (default: 4)")
    parser.add_argument("--out", default="runs/with_new_gait.zip", help="file of the policy")
    options = parser.parse_args(arguments)
    out = writable_file(options.out)

    policy = trainers.load_pretrained().add_task(options.task, like="trot")
    perturbation = trainers.PerturbationConfig()
    rows = trainers.collect(
        options.task, seconds=options.seconds, perturbation=perturbation, env_kwargs=policy.env_kwargs
    )
    trainers.learn_task(policy, rows, trainers.BCConfig(steps=options.steps), progress=True)
    policy.save(out)

    for task in ("trot", options.task):
        result = trainers.evaluate(policy, task, options.episodes, seconds=10.0)
        print(f"{task}: success in {100 * result.success_rate:.0f} % of {options.episodes} episodes")
    print(f"run it with: {interpreter()} examples/quickstart.py {shlex.quote(str(out))} --task {options.task}")
    if any(getattr(options, name) < parser.get_default(name) for name in ("seconds", "steps")):
        print("So little training is not enough to learn a gait; leave out --seconds and --steps to train in full.")


if __name__ == "__main__":
    raise SystemExit(run())
