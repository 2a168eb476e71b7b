"""What the main job says at its end: what was made, how good it is, and what to do with it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from trainers.utils.report import number

FILES = {
    "policy.zip": "the trained policy",
    "phase_free.zip": "the same without a clock",
    "gaits.gif": "the policy in every gait",
    "table.md": "every gait and learner in a table",
    "metrics.json": "everything measured",
}
"""What a run leaves for its user."""
SMOKE = """
So little training gives a robot that falls: the smoke preset only shows that every stage works. Without --preset the
same command trains the robot of the README."""


def summary(metrics: Mapping[str, Any], out: Path, next_steps: Mapping[str, str]) -> str:
    """The whole of it.

    Args:
        metrics: what ``metrics.json`` holds.
        out: folder of the run.
        next_steps: what one may want -> the command for it.
    """
    files = {str(out / name): text for name, text in FILES.items() if (out / name).is_file()}
    parts = [_aligned("results:", files), "\n".join(verdict(metrics)), _aligned("go on with:", next_steps)]
    return "\n\n".join(parts) + (f"\n{SMOKE}" if metrics["config"]["preset"] == "smoke" else "")


def verdict(metrics: Mapping[str, Any]) -> list[str]:
    """How good the policy is, beside the expert, the policy without a clock, and the baselines: three lines."""
    tasks = metrics["tasks"]
    hands = any("operator_success_rate" in scores.get("multi_head", {}) for scores in tasks.values())
    lines = [f"with drawn commands: {_compared(tasks, 'success_rate')}"]
    if hands:
        lines.append(f"in an operator's hands: {_compared(tasks, 'operator_success_rate')}")
    r2 = [scores["multi_head"]["r2"] for scores in tasks.values() if "r2" in scores.get("multi_head", {})]
    error = [scores["multi_head"].get("velocity_error") for scores in tasks.values()]
    known = [value for value in error if value is not None]
    lines.append(
        f"R2 of its joint targets {number(_mean(r2), '.4f')}, mean velocity error {number(_mean(known), '.3f')} m/s"
    )
    return lines


NAMES = {"multi_head": "the policy", "expert": "the expert", "phase_free": "without a clock", "pooled": "told no gait"}
"""Learner -> what a sentence calls it."""


def _compared(tasks: Mapping[str, Mapping[str, Any]], rate: str) -> str:
    """Such as "the policy succeeds in 57 of 60 episodes, the expert in 60, without a clock in 55, ..." of all gaits."""
    counts = {
        learner: (
            round(sum(scores[learner][rate] * scores[learner]["episodes"] for scores in having)),
            sum(scores[learner]["episodes"] for scores in having),
        )
        for learner in NAMES
        if (having := [scores for scores in tasks.values() if rate in scores.get(learner, {})])
    }
    (first, (successes, episodes)), *others = counts.items()
    rest = "".join(f", {NAMES[learner]} in {count}" for learner, (count, _) in others)
    return f"{NAMES[first]} succeeds in {successes} of {episodes} episodes{rest}"


def _mean(values: list[float]) -> float | None:
    return sum(values) / len(values) if values else None


def _aligned(title: str, rows: Mapping[str, str]) -> str:
    width = max(map(len, rows), default=0)
    return "\n".join([title, *(f"  {name:{width}}  {text}" for name, text in rows.items())])
