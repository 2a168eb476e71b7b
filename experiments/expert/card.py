"""The expert's report card: what several of its studies found, one row per gait."""

from collections.abc import Mapping
from typing import Any

from experiments.expert.commands import ONE
from experiments.expert.timing import REAL_TIME, UPDATE
from experiments.pushing import PAIRS, weaker
from experiments.results import Group, Record, Results, distinct
from experiments.tables import count, markdown, number

NOTE = (
    "Success: drawn commands, as defined for policies. vx, vy, yaw rate: the largest command along that axis that "
    "every trial survived and that was tracked. Push: the largest change of the base's velocity survived at every "
    "phase of the cycle, in the weaker of the two directions. Gait transitions: survived, from this gait to each other "
    "one. MPC update: median, one core."
)
STEPS_WANTED = 1_000_000
"""Control steps without a NaN and without an exception that the expert is to make."""
COLUMNS = (
    "gait",
    "success",
    "velocity error [m/s]",
    "vx back, forth [m/s]",
    "vy [m/s]",
    "yaw rate [rad/s]",
    "push side [m/s]",
    "push fore-aft [m/s]",
    "gait transitions",
    "MPC update [ms]",
    "x real time",
)


def card(measured: Mapping[str, Results]) -> list[str]:
    """Paragraphs above the studies of the expert, with what `measured` holds of them; none without drawn commands."""
    if "expert_commands" not in measured:
        return []
    rows = [_row(gait, measured) for gait in distinct(measured["expert_commands"].records, "task")]
    return ["## Report card", markdown(COLUMNS, rows), NOTE, totals(measured)]


def _row(gait: str, measured: Mapping[str, Results]) -> list[str]:
    def of(study: str, **values: Any) -> Group:
        return measured[study].of(task=gait, **values) if study in measured else Group()

    drawn = of("expert_commands", condition=ONE)
    tracked = {record["condition"]: record["tracked_to"] for record in of("expert_limits")}
    back, forth, vy = (number(tracked.get(axis), ".1f") for axis in ("-vx", "vx", "vy"))
    return [
        gait,
        count(drawn.rate()),
        number(drawn.mean("velocity_error"), ".3f"),
        f"{back}, {forth}",
        vy,
        number(tracked.get("yaw"), ".2f"),
        *(number(weaker(of("expert_pushes"), pair), ".1f") for pair in PAIRS.values()),
        count(of("expert_transitions").rate("survived")),
        number(of("expert_timing", condition=UPDATE).mean("median_ms"), ".2f"),
        number(of("expert_timing", condition=REAL_TIME, control_hz=50).mean("expert"), ".1f"),
    ]


def totals(measured: Mapping[str, Results]) -> str:
    """Control steps of all studies, what went wrong in them, and whether they are as many as wanted."""
    records: list[Record] = [record for results in measured.values() for record in results.records]
    ledger = Group(record for record in records if "calls" in record)
    flawless = ledger.total("bad_actions") == ledger.total("unhandled") == 0
    reached = "reached" if flawless and ledger.total("calls") >= STEPS_WANTED else "**missed**"
    return (
        f"All studies together: {ledger.total('calls')} control steps, {ledger.total('bad_actions')} actions that were "
        f"not finite, {ledger.total('unhandled')} exceptions, {ledger.total('solver_failures')} solves that fell back "
        f"to the nominal forces, {ledger.total('inexact_solves')} inexact ones, {ledger.total('bad_states')} states "
        f"refused. The target, {STEPS_WANTED} steps without a NaN and without an exception, is {reached}."
    )
