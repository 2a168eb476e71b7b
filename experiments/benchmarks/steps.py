"""Gradient steps: against others, against the number of heads, and with less precision."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import torch

from experiments.benchmarks.loops import bare, made_up, ours, stock, student
from experiments.benchmarks.turns import N_TASKS, RATE, WARM_UP, Heat, Stopwatch, TrainingOptions, Turn
from trainers import BCConfig, BCTrainer, Demonstrations, MultiTaskLoss

PRECISIONS = {
    "highest": {},
    "high": {"matmul_precision": "high"},
    "medium": {"matmul_precision": "medium"},
    "bfloat16": {"autocast": True},
}
"""Name -> options of `trainers.BCConfig`."""
STOCK = "imitation"
STOCK_LOOP = "imitation, our network"


def step(amounts: TrainingOptions) -> Iterator[Heat]:
    """Our training against a bare loop and `imitation`, at every width and number of threads."""
    for width in amounts.widths:
        for threads in amounts.threads[:1] if amounts.on_gpu else amounts.threads:

            def contestants(_: Path, width: int = width) -> Mapping[str, Turn]:
                data = made_up(amounts.rows, N_TASKS, amounts.data_seed)
                return {
                    "ours": ours(data, width, amounts),
                    "ours, medium": ours(data, width, amounts, **PRECISIONS["medium"]),
                    "ours, bfloat16": ours(data, width, amounts, **PRECISIONS["bfloat16"]),
                    "bare loop": bare(data, width, amounts),
                    STOCK: stock(data, width, amounts, their_network=True),
                    STOCK_LOOP: stock(data, width, amounts, their_network=False),
                }

            yield Heat(f"{width} wide, {_plural(threads)}", threads, contestants, ("bare loop", STOCK, STOCK_LOOP))


def heads(amounts: TrainingOptions) -> Iterator[Heat]:
    """Our training with different numbers of heads and the same batch, at the smallest width."""
    width = min(amounts.widths)

    def contestants(_: Path) -> Mapping[str, Turn]:
        return {
            _plural(count, "head"): ours(made_up(amounts.rows, count, amounts.data_seed), width, amounts)
            for count in amounts.heads
        }

    yield Heat(f"{width} wide, 1 thread", 1, contestants, (_plural(amounts.heads[0], "head"),))


def precision(amounts: TrainingOptions) -> Iterator[Heat]:
    """Speed, and loss after equal steps from equal weights; every round is another seed."""
    for width in amounts.widths if amounts.on_gpu else (min(amounts.widths),):

        def contestants(_: Path, width: int = width) -> Mapping[str, Turn]:
            data = made_up(amounts.rows, N_TASKS, amounts.data_seed)
            held_out = made_up(amounts.rows // 10 + N_TASKS, N_TASKS, amounts.data_seed + 1, episode=1)
            return {name: _learning(data, held_out, width, amounts, **options) for name, options in PRECISIONS.items()}

        yield Heat(f"{width} wide, 1 thread", 1, contestants, ("highest",))


def _learning(
    data: Demonstrations, held_out: Demonstrations, width: int, amounts: TrainingOptions, **options: object
) -> Turn:
    """Training for a while; gives its speed, and its loss on held-out rows computed in full precision."""

    def turn(i: int) -> dict[str, float]:
        watch = Stopwatch(amounts)
        config = BCConfig(
            steps=amounts.learning_steps + WARM_UP, batch_size=amounts.batch_size, seed=amounts.data_seed + i, **options
        )
        policy = student(data, width, amounts, seed=amounts.data_seed + i)
        BCTrainer(policy, config).fit(data, on_batch_end=watch)
        rate = watch.rate(config.batch_size)
        obs, acts = (torch.from_numpy(part).to(policy.device) for part in (held_out.obs, held_out.acts))
        with torch.no_grad():
            loss = MultiTaskLoss(data.tasks, data.half_range)(policy, obs, acts).loss
        return {RATE: rate, "loss": float(loss)}

    return turn


def _plural(count: int, noun: str = "thread") -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
