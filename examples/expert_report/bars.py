"""The bars that the expert is held against: what a prototype of it reached, from a single seed and few episodes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Bars:
    """What the prototype reached in one gait.

    Attributes:
        vx, vy, yaw: largest command with small errors [m/s, m/s, rad/s].
        error: mean velocity error up to there [m/s].
        lateral, fore_aft: largest kick survived [m/s]; None where it was not tried.
    """

    vx: float
    vy: float
    yaw: float
    error: float
    lateral: float | None = None
    fore_aft: float | None = None


PROTOTYPE = {
    "trot": Bars(2.0, 0.6, 2.0, 0.03, 1.6, 2.0),
    "walk": Bars(1.2, 0.6, 2.0, 0.02, 1.1, 1.6),
    "bound": Bars(2.0, 0.6, 2.0, 0.02, 2.0, 1.1),
    "jump": Bars(1.5, 0.4, 2.0, 0.03, 1.1, 1.6),
    "pace": Bars(1.6, 0.3, 0.8, 0.02),
    "gallop": Bars(1.6, 0.3, 0.8, 0.023),
}
"""Gait -> bars."""
NOTE = "The prototype's figures are of a single seed and few episodes, so they are good to about 30 %."
LABELS = {
    "vx": "largest vx tracked [m/s]",
    "vy": "largest vy tracked [m/s]",
    "yaw": "largest yaw rate tracked [rad/s]",
    "error": "velocity error [m/s]",
    "lateral": "kick to the side [m/s]",
    "fore_aft": "kick fore and aft [m/s]",
}
"""How each bar is called in a table."""


def compare(expert: Mapping[str, Any]) -> list[dict[str, Any]]:
    """One entry per gait and bar that can be compared: gait, figure, here, prototype, passed.

    Args:
        expert: what ``expert.json`` holds.
    """
    rows = []
    for gait, bars in PROTOTYPE.items():
        for name in LABELS:
            bar, here = getattr(bars, name), measured(expert, gait, name)
            if bar is not None and here is not None:
                passed = here <= bar + 1e-9 if name == "error" else here >= bar - 1e-9
                rows.append({"gait": gait, "figure": name, "here": here, "prototype": bar, "passed": passed})
    return rows


def measured(expert: Mapping[str, Any], gait: str, name: str) -> float | None:
    """The expert's own figure for a bar, or None if it was not measured."""
    report = expert.get("report", {})
    if name == "error":
        return expert["tasks"].get(gait, {}).get("velocity_error")
    if name in ("lateral", "fore_aft"):
        return report.get("pushes", {}).get(gait, {}).get(name)
    return report.get("limits", {}).get(gait, {}).get(name, {}).get("tracked")
