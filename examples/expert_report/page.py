"""The expert's part of README.md and of ``docs/results/README.md``, written from ``expert.json``."""

from collections.abc import Mapping, Sequence
from typing import Any

from expert_report.bars import LABELS, NOTE, PROTOTYPE, compare, measured
from expert_report.timing import MPC_HZ
from trainers.utils.report import closed_loop_table, markdown, number

CARD = (
    "gait",
    "success",
    "velocity error [m/s]",
    "vx back, forth [m/s]",
    "vy [m/s]",
    "yaw rate [rad/s]",
    "kick side [m/s]",
    "kick fore-aft [m/s]",
    "changes of gait",
    "MPC update [ms]",
    "x real time",
)
"""Columns of the report card."""
CARD_NOTE = (
    "Success: drawn commands, as defined for students. vx, vy, yaw rate: the largest command along that axis that "
    "every trial survived and that was tracked. Kick: the largest change of the base's velocity survived at every "
    "phase of the cycle, in the weaker of the two directions. Changes of gait: survived, from this gait to each other "
    "one. MPC update: median, one core. `(< x)` or `(> x)` marks a figure that misses the x of our prototype."
)
PICTURES = {
    "limits": "Largest command along each axis",
    "pushes": "Largest kick survived at every phase of the cycle",
    "contacts": "Feet on the ground over two cycles, planned and measured",
    "transitions": "Survived changes of gait",
}
"""Name of a picture -> its description."""


def expert_block(expert: Mapping[str, Any], made_by: str) -> str:
    """The report card, for README.md; only the closed-loop scores if nothing else was measured."""
    parts = [card_table(expert), CARD_NOTE] if "report" in expert else [closed_loop_table(expert["tasks"])]
    config = expert["config"]
    what = f"At {config['control_hz']} Hz"
    if "episodes" in config:
        what = f"{config['episodes']} drawn commands x {config['episode_s']:g} s per gait at {config['control_hz']} Hz"
    return "\n\n".join([*parts, f"{what}. {made_by}"])


def card_table(expert: Mapping[str, Any]) -> str:
    """One row per gait; "-" for what was not measured."""
    report = expert["report"]
    rows = []
    for gait in _gaits(expert):
        closed, limits = expert["tasks"].get(gait, {}), report.get("limits", {}).get(gait, {})
        episodes = closed.get("episodes")
        count = len(episodes) if isinstance(episodes, Sequence) else episodes
        success = f"{round(closed['success_rate'] * count)}/{count}" if count else "-"
        back = number(limits.get("-vx", {}).get("tracked"), ".1f")
        times = report.get("timing", {}).get(gait, {})
        rows.append(
            [
                gait,
                success,
                _against(expert, gait, "error", ".3f"),
                f"{back}, {_against(expert, gait, 'vx', '.1f')}",
                _against(expert, gait, "vy", ".1f"),
                _against(expert, gait, "yaw", ".2f"),
                _against(expert, gait, "lateral", ".1f"),
                _against(expert, gait, "fore_aft", ".1f"),
                _changes(report.get("transitions", {}).get(gait, {})),
                number(times.get("mpc_update_ms", {}).get("median"), ".2f"),
                number(times.get("real_time", {}).get("50", {}).get("expert"), ".1f"),
            ]
        )
    return markdown(CARD, rows, text_columns=1)


def expert_section(expert: Mapping[str, Any], made_by: str, pictures: Sequence[str]) -> list[str]:
    """Paragraphs of the expert's part of the page of results.

    Args:
        expert: what ``expert.json`` holds.
        made_by: how it was made.
        pictures: those of `PICTURES` that are there.
    """
    parts = ["## Expert", expert_block(expert, made_by)]
    report = expert.get("report", {})
    if not report:
        return parts
    if expert["tasks"]:
        parts += ["### Drawn commands", closed_loop_table(expert["tasks"])]
    if report.get("changing"):
        parts += ["The same with commands that change:", closed_loop_table(report["changing"])]
    for title, section, write, picture in (
        ("Against the prototype", "", bars_table, None),
        ("Largest commands", "limits", limits_table, "limits"),
        ("Kicks", "pushes", push_table, "pushes"),
        ("Steady walking", "steady", steady_table, "contacts"),
        ("Changes of gait", "transitions", None, "transitions"),
        ("Labels", "labels", labels_table, None),
        ("Settings compared", "modes", modes_table, None),
        ("Time", "timing", timing_table, None),
        ("The long walk", "soak", soak_table, None),
    ):
        if section and not report.get(section):
            continue
        parts += [f"### {title}", *([write(expert)] if write else [])]
        if picture in pictures:
            parts.append(f"![{PICTURES[picture]}](expert_{picture}.png)")
    return [*parts, totals_text(expert["totals"])]


# -- Tables ------------------------------------------------------------------------------------------------------------


def bars_table(expert: Mapping[str, Any]) -> str:
    """Every bar, passed or missed."""
    rows = []
    for row in compare(expert):
        values = [f"{row[name]:.3g}" for name in ("here", "prototype")]
        rows.append([row["gait"], LABELS[row["figure"]], *values, "pass" if row["passed"] else "**miss**"])
    return markdown(["gait", "figure", "here", "prototype", ""], rows, text_columns=2) + f"\n\n{NOTE}"


def limits_table(expert: Mapping[str, Any]) -> str:
    """Largest command per gait and axis, with the errors there."""
    rows = []
    for gait, own in expert["report"]["limits"].items():
        for axis, found in own.items():
            errors = [number(found[name], ".3f") for name in ("velocity_error", "yaw_rate_error")]
            more = " (end of the search)" if found["at_cap"] else ""
            rows.append([gait, axis, f"{found['survived']:g}{more}", *errors, f"{found['tracked']:g}"])
    header = ["gait", "axis", "survived", "velocity error there [m/s]", "yaw rate error there [rad/s]", "and tracked"]
    return markdown(header, rows, text_columns=2)


def push_table(expert: Mapping[str, Any]) -> str:
    """Largest kick per gait and direction [m/s]."""
    names = ("left", "right", "forward", "backward")
    pushes = expert["report"]["pushes"]
    rows = [[gait, *(number(own.get(name), ".1f") for name in names)] for gait, own in pushes.items()]
    return markdown(["gait", *(f"{name} [m/s]" for name in names)], rows)


def steady_table(expert: Mapping[str, Any]) -> str:
    """Contacts, effort, posture and tracking of the walk at 0.3 m/s and of the one at a drawn command."""
    columns = {
        "contact as planned": ("contact_agreement", ".3f"),
        "touchdown lag [s]": ("touchdown_lag_s", ".3f"),
        "flight": ("flight_share", ".3f"),
        "planned": ("planned_flight_share", ".3f"),
        "torque at limit": ("saturated_share", ".4f"),
        "cost of transport": ("cost_of_transport", ".2f"),
        "height [m]": ("height", ".3f"),
        "RMS velocity error [m/s]": ("rms_velocity_error", ".3f"),
        "QP iterations": ("qp_iterations", ".0f"),
    }
    rows = []
    for gait, walks in expert["report"]["steady"].items():
        for name, own in walks.items():
            command = " ".join(f"{value:.2f}" for value in own["command"])
            ranges = [" ".join(f"{v:.1f}" for v in own.get(key, ())) or "-" for key in ("roll_deg", "pitch_deg")]
            rows.append([gait, name, command, *(number(own.get(key), how) for key, how in columns.values()), *ranges])
    header = ["gait", "walk", "command", *columns, "roll from, to [deg]", "pitch from, to [deg]"]
    return markdown(header, rows, text_columns=3)


def labels_table(expert: Mapping[str, Any]) -> str:
    """What the expert's answers depend on."""
    rows = []
    for gait, own in expert["report"]["labels"].items():
        phase = [f"{own['phase_error'][name]:.3f}" for name in ("median", "p95")]
        clocks = [f"{own[name]:.3f}" for name in ("wrong_clock", "fitted_clock")]
        rows.append([gait, str(own["states"]), str(own["asked_again"]), f"{own['displaced']:.0e}", *clocks, *phase])
    header = ["gait", "states", "other bits when asked again", "moved and turned [rad]", "clock wrong by 1/4 [rad]"]
    return markdown([*header, "then fitted [rad]", "error of the fitted clock [cycles]", "95 %"], rows)


def modes_table(expert: Mapping[str, Any]) -> str:
    """What other settings of the expert buy and cost."""
    rows = []
    for gait, own in expert["report"]["modes"].items():
        times = expert["report"].get("timing", {}).get(gait, {}).get("mode_action_ms", {})
        for name, found in own.items():
            survived = f"{round(found['survival_rate'] * found['episodes'])}/{found['episodes']}"
            values = [number(found["velocity_error"], ".3f"), number(found["lateral_push"], ".1f")]
            rows.append([gait, name, survived, *values, number(times.get(name, {}).get("median"), ".2f")])
    header = ["gait", "settings", "survived", "velocity error [m/s]", "kick to the side [m/s]", "action [ms]"]
    return markdown(header, rows, text_columns=2)


def timing_table(expert: Mapping[str, Any]) -> str:
    """Milliseconds per answer and multiples of real time."""
    rows = []
    for gait, own in expert["report"]["timing"].items():
        times = [f"{own[name][q]:.2f}" for name in ("mpc_update_ms", "action_ms") for q in ("median", "p99")]
        for rate, found in own["real_time"].items():
            factors = [f"{found[name]:.1f}" for name in ("expert", "environment", "physics")]
            rows.append([gait, f"{rate} Hz", *times, *factors, f"{found['expert_to_physics']:.3f}"])
    header = ["gait", "control", "MPC update [ms]", "p99", "action [ms]", "p99", "expert x real time"]
    table = markdown([*header, "environment x", "MuJoCo x", "expert / MuJoCo"], rows, text_columns=2)
    return f"{table}\n\nWhere control is faster than {MPC_HZ} Hz, forces are planned at that rate."


def soak_table(expert: Mapping[str, Any]) -> str:
    """Steps and falls under random commands, changes of gait and kicks at once."""
    names = ("steps", "switches", "kicks", "falls")
    rows = [[gait, *(str(own[name]) for name in names)] for gait, own in expert["report"]["soak"].items()]
    return markdown(["begun in", "control steps", "changes of gait", "kicks", "falls"], rows)


def totals_text(totals: Mapping[str, Any]) -> str:
    """Control steps of all sections, and what went wrong in them."""
    return (
        f"All sections together: {totals['calls']} control steps, {totals['bad_actions']} actions that were not "
        f"finite, {totals['unhandled']} exceptions, {totals['solver_failures']} solves that fell back to the nominal "
        f"forces, {totals['inexact_solves']} inexact ones, {totals['bad_states']} states refused. The bar, "
        f"{totals['wanted']} steps without a NaN and without an exception, is "
        f"{'passed' if totals['passed'] else '**missed**'}."
    )


# -- Cells -------------------------------------------------------------------------------------------------------------


def _gaits(expert: Mapping[str, Any]) -> list[str]:
    return list(dict.fromkeys([*expert["tasks"], *(gait for own in expert["report"].values() for gait in own)]))


def _against(expert: Mapping[str, Any], gait: str, name: str, how: str) -> str:
    """A figure, with the prototype's in brackets where it is missed."""
    here, bar = measured(expert, gait, name), getattr(PROTOTYPE.get(gait), name, None)
    missed = None not in (here, bar) and (here > bar + 1e-9 if name == "error" else here < bar - 1e-9)
    sign = ">" if name == "error" else "<"
    return number(here, how) + (f" ({sign} {bar:g})" if missed else "")


def _changes(pairs: Mapping[str, Mapping[str, int]]) -> str:
    trials = sum(pair["trials"] for pair in pairs.values())
    return f"{sum(pair['survived'] for pair in pairs.values())}/{trials}" if trials else "-"
