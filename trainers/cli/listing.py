"""``go1-mtl-gym list``: what there is to name on the command line."""

import dataclasses
from collections.abc import Iterable, Sequence

from go1_mtl_gym.registration import env_id
from go1_mtl_gym.tasks import TASKS
from trainers.cli.options import parse
from trainers.evaluation.conditions import CONDITIONS
from trainers.pipeline.presets import ABOUT, PRESETS
from trainers.policies.packaged import PRETRAINED


@dataclasses.dataclass(frozen=True)
class Options:
    """List gaits with their commands, environments, packaged policies, presets of the main job, conditions."""


def run(words: Sequence[str]) -> None:
    """Print the lists."""
    parse(Options, words, "list")
    print("\n\n".join(f"{title}\n{_aligned(rows)}" for title, rows in lists().items()))


def lists() -> dict[str, list[tuple[str, ...]]]:
    """Title -> rows; the first word of a row is what one types."""
    gaits = [
        (name, env_id(name), *(f"{unit} ±{x:g}" for unit, x in zip(("vx", "vy", "yaw"), task.command_range)))
        for name, task in TASKS.items()
    ]
    return {
        "gaits, their environments, and the largest drawn commands [m/s, m/s, rad/s]": [
            *gaits,
            ("-", env_id(None), "one of them per episode"),
        ],
        "policies in the package": list(PRETRAINED.items()),
        "presets of `train`": [(name, ABOUT[name]) for name in PRESETS],
        "conditions of `certify`": [
            (name, each.title, "the claim" if each.claim is None else f"{each.claim:.4g}", f"by {each.judged_by}")
            for name, each in CONDITIONS.items()
        ],
    }


def _aligned(rows: Iterable[Sequence[str]]) -> str:
    """Columns of equal width."""
    rows = list(rows)
    widths = [max((len(row[i]) for row in rows if len(row) > i + 1), default=0) for i in range(max(map(len, rows)))]
    return "\n".join("  " + "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths)).rstrip() for row in rows)
