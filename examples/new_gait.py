"""A trained policy learns a gait of your own from a minute of demonstrations; its old ones stay as they are.

python examples/new_gait.py --out runs/with_amble.zip
"""

import argparse
from collections.abc import Sequence

import trainers
from go1_mtl_gym import Gait, Task, register_task
from trainers.utils.cli import main, positive_float, positive_int, writable_file

AMBLE = Task(
    "amble",
    Gait("amble", period=0.5, duty=0.65, offsets=(0.25, 0.75, 0.0, 0.5)),
    command_range=(0.5, 0.2, 0.5),
)
"""A faster walk; `examples/custom_gait.py` says what the numbers mean."""


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Give the policy a head for the gait, and train that head alone."""
    parser = argparse.ArgumentParser(description="Teach the policy that comes with the package another gait.")
    parser.add_argument("--seconds", type=positive_float, default=60.0, help="of demonstrations (default: 60)")
    parser.add_argument("--steps", type=positive_int, default=1000, help="of gradient descent (default: 1000)")
    parser.add_argument("--episodes", type=positive_int, default=4, help="to measure it (default: 4)")
    parser.add_argument("--out", default="runs/with_amble.zip", help="file of the policy")
    options = parser.parse_args(arguments)
    out = writable_file(options.out)

    register_task(AMBLE)
    policy = trainers.load_pretrained().add_task("amble", like="walk")
    perturbation = trainers.PerturbationConfig()
    rows = trainers.collect("amble", seconds=options.seconds, perturbation=perturbation, env_kwargs=policy.env_kwargs)
    trainers.learn_task(policy, rows, trainers.BCConfig(steps=options.steps), progress=True)
    policy.save(out)

    for task in ("trot", "amble"):
        result = trainers.evaluate(policy, task, options.episodes, seconds=10.0)
        print(f"{task}: success in {100 * result.success_rate:.0f} % of {options.episodes} episodes")
    print(f"{out} holds the name of the gait: a program that loads it registers the gait first, as this one does")
    if any(getattr(options, name) < parser.get_default(name) for name in ("seconds", "steps")):
        print("So little training is not enough to learn a gait; leave out --seconds and --steps to train in full.")


if __name__ == "__main__":
    raise SystemExit(run())
