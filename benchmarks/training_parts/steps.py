"""Gradient steps: against others, against the number of heads, and with less precision."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import torch

from trainers import BCConfig, BCTrainer, Demonstrations, MultiTaskLoss
from training_parts.loops import bare, made_up, ours, stock, student
from training_parts.settings import N_TASKS, Settings
from training_parts.timing import RATE, WARM_UP, Heat, Stopwatch, Turn

PRECISIONS = {
    "highest": {},
    "high": {"matmul_precision": "high"},
    "medium": {"matmul_precision": "medium"},
    "bfloat16": {"autocast": True},
}
"""Name -> options of `trainers.BCConfig`."""
STOCK = "imitation"
STOCK_LOOP = "imitation, our network"


def step(settings: Settings) -> Iterator[Heat]:
    """Our training against a bare loop and `imitation`, at every width and number of threads."""
    for width in settings.widths:
        for threads in settings.threads[:1] if settings.on_gpu else settings.threads:

            def contestants(_: Path, width: int = width) -> Mapping[str, Turn]:
                data = made_up(settings.rows, N_TASKS, settings.seed)
                return {
                    "ours": ours(data, width, settings),
                    "ours, medium": ours(data, width, settings, **PRECISIONS["medium"]),
                    "ours, bfloat16": ours(data, width, settings, **PRECISIONS["bfloat16"]),
                    "bare loop": bare(data, width, settings),
                    STOCK: stock(data, width, settings, own_network=True),
                    STOCK_LOOP: stock(data, width, settings, own_network=False),
                }

            yield Heat(f"{width} wide, {_plural(threads)}", threads, contestants, ("bare loop", STOCK, STOCK_LOOP))


def heads(settings: Settings) -> Iterator[Heat]:
    """Our training with different numbers of heads and the same batch, at the smallest width."""
    width = min(settings.widths)

    def contestants(_: Path) -> Mapping[str, Turn]:
        return {
            _plural(count, "head"): ours(made_up(settings.rows, count, settings.seed), width, settings)
            for count in settings.heads
        }

    yield Heat(f"{width} wide, 1 thread", 1, contestants, (_plural(settings.heads[0], "head"),))


def precision(settings: Settings) -> Iterator[Heat]:
    """Speed, and loss after equal steps from equal weights; every round is another seed."""
    for width in settings.widths if settings.on_gpu else (min(settings.widths),):

        def contestants(_: Path, width: int = width) -> Mapping[str, Turn]:
            data = made_up(settings.rows, N_TASKS, settings.seed)
            held_out = made_up(settings.rows // 10 + N_TASKS, N_TASKS, settings.seed + 1, episode=1)
            return {name: _learning(data, held_out, width, settings, **options) for name, options in PRECISIONS.items()}

        yield Heat(f"{width} wide, 1 thread", 1, contestants, ("highest",))


def _learning(
    data: Demonstrations, held_out: Demonstrations, width: int, settings: Settings, **options: object
) -> Turn:
    """Training for a while; gives its speed, and its loss on held-out rows computed in full precision."""

    def turn(i: int) -> dict[str, float]:
        watch = Stopwatch(settings)
        config = BCConfig(
            steps=settings.learning_steps + WARM_UP, batch_size=settings.batch_size, seed=settings.seed + i, **options
        )
        policy = student(data, width, settings, seed=settings.seed + i)
        BCTrainer(policy, config).fit(data, on_batch_end=watch)
        rate = watch.rate(config.batch_size)
        obs, acts = (torch.from_numpy(part).to(policy.device) for part in (held_out.obs, held_out.acts))
        with torch.no_grad():
            loss = MultiTaskLoss(data.tasks, data.half_range)(policy, obs, acts).loss
        return {RATE: rate, "loss": float(loss)}

    return turn


def _plural(count: int, what: str = "thread") -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
