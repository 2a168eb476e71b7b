"""``docs/results/paper.md``, written from ``paper.json``: the paper's tables, and ours beside them."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from go1_mtl_gym import EstimatorNoise
from paper_report.config import TABLES
from paper_report.data import NAMED, TRAIN, UNSEEN
from paper_report.published import FIGURES, KINDS, MULTI_HEAD, POOLED, PUBLISHED
from paper_report.sums import Estimate, Learner, learners, scores, uses, verdicts
from trainers.utils.report import markdown, number

TITLES = {
    "simulation": "Simulation",
    "hardware": "Hardware, and data like a robot's",
    "hardware_half_noise": "Hardware, and data like a robot's with half the noise",
    "hardware_estimator": "Hardware, and data like a robot's with a state estimator",
}
SHOWN = {"mse": "MSE [rad^2]", "mae": "MAE [rad]", "r2": "R2", "r2_joint_mean": "R2, mean of joints"}
DIGITS = {"mse": ".6f", "mae": ".5f", "r2": ".5f", "r2_joint_mean": ".5f"}
USES = {NAMED: "the authors' held-out command", UNSEEN: "other held-out commands"}
OWN_KINDS = {MULTI_HEAD: "multi-task", POOLED: "single-task"}
"""What the paper calls them."""
PICTURES = {
    "loss": "Held-out loss per gait over the gradient steps; a line per training seed",
    "targets": "Joint targets of the front left leg, of student and expert, on held-out rows",
    "contacts": "Feet on the ground, of the expert on held-out rows",
}
"""Name of a figure and what it shows; its file is ``paper_TABLE_NAME.png``."""


def paper_page(data: Mapping[str, Any], pictures: Sequence[str] = ()) -> str:
    """The whole page.

    Args:
        data: what ``paper.json`` holds.
        pictures: names of the files of figures that are there.
    """
    parts = [
        "# The paper's tables, and ours beside them",
        "Written by `examples/reproduce_paper.py` from `paper.json`; do not edit. The paper is arXiv 2505.08574. All "
        "figures are one-step errors of the joint targets on states that the expert visited with commands that nobody "
        "was trained on. They say how well a network fits its own expert, and nothing about whether it walks.",
    ]
    for name, table in data["tables"].items():
        parts += section(name, table, pictures)
    return "\n\n".join(parts) + "\n"


def section(name: str, table: Mapping[str, Any], pictures: Sequence[str] = ()) -> list[str]:
    """Paragraphs of one table.

    Args:
        name: of the table.
        table: what ``paper.json`` holds of it.
        pictures: names of the files of figures that are there.
    """
    students = table["students"]
    parts = [f"## {TITLES[name]}"]
    for i, use in enumerate(uses(students)):
        parts += [f"With {USES[use]}:", score_table(TABLES[name].published, students, use, paper=i == 0)]
    parts += [
        "Means over training seeds with the 95 % interval of Student's t where there are several. R2 is flattened over "
        "the joints, each about its own mean; how the paper averages its R2 is not stated.",
        "### Aims",
        verdict_table(TABLES[name].published, students),
        "### What differs",
        differences(TABLES[name].published, table),
        "### Data and training",
        account_table(table["data"]),
        training_table(students),
        made_by(table),
    ]
    files = {what: f"paper_{name}_{what}.png" for what in PICTURES}
    return parts + [f"![{PICTURES[what]}]({file})" for what, file in files.items() if file in pictures]


# -- Tables ------------------------------------------------------------------------------------------------------------


def summary_table(tables: Mapping[str, Mapping[str, Any]]) -> str:
    """R2 alone, of every table: one row per gait and way of training, the paper's beside ours.

    Args:
        tables: name -> what ``paper.json`` holds of it; the first of its held-out rows are shown.
    """
    rows = []
    for name, table in tables.items():
        published = PUBLISHED[TABLES[name].published]
        for gait, paper in published.items():
            theirs = [number(paper.get(kind, {}).get("r2"), ".4f") for kind in (MULTI_HEAD, POOLED)]
            own = scores(table["students"], gait, uses(table["students"])[0])
            for width, steps, precision in dict.fromkeys(learner[:3] for learner in own):
                found = [own.get(Learner(width, steps, precision, rank)) for rank in range(len(KINDS))]
                ours = ["-" if each is None else _cell(each["r2"], ".4f") for each in found]
                rows.append([name.replace("_", " "), gait, *theirs, f"{width}, {steps}, {precision}", *ours])
    theirs = [f"{OWN_KINDS[kind]}, paper" for kind in (MULTI_HEAD, POOLED)]
    header = ["data", "gait", *theirs, "width, steps, trained in", *(f"{kind}, here" for kind in KINDS.values())]
    return markdown(header, rows, text_columns=2)


def score_table(name: str, students: Sequence[Mapping[str, Any]], use: str, paper: bool) -> str:
    """One row per gait and learner, with the rows of the paper's table of that name before ours if wanted."""
    rows = []
    for gait, published in PUBLISHED[name].items():
        for kind, figures in published.items() if paper else ():
            cells = [number(figures.get(key), DIGITS[key]) for key in SHOWN]
            rows.append([gait, f"paper, {OWN_KINDS[kind]}", "-", "2560", "-", "-", *cells])
        for learner, own in scores(students, gait, use).items():
            cells = [_cell(own[key], DIGITS[key]) for key in SHOWN]
            about = [learner.precision, str(learner.width), str(learner.steps), str(own["r2"].count)]
            rows.append([gait, KINDS[learner.kind], *about, *cells])
    header = ["gait", "learner", "trained in", "width", "steps", "seeds", *SHOWN.values()]
    return markdown(header, rows, text_columns=3)


def verdict_table(name: str, students: Sequence[Mapping[str, Any]]) -> str:
    """One row per gait, held-out rows and multi-head learner; bold misses its aim."""
    rows = []
    for own in verdicts(name, students):
        r2 = number(own["r2"], ".5f")
        better = "-" if own["worse"] is None else _better(own["worse"])
        reached = r2 if own["reached"] else f"**{r2}**"
        about = [str(own["width"]), str(own["steps"]), f"> {own['aim']:g}"]
        rows.append([own["gait"], USES[own["use"]], own["precision"], *about, reached, better])
    header = ["gait", "held out", "trained in", "width", "steps", "aim, R2", "multi-head, R2", "better than pooled in"]
    return markdown(header, rows, text_columns=3)


def account_table(data: Mapping[str, Mapping[str, Mapping[str, float]]]) -> str:
    """One row per gait: seconds of rows, and falls of the expert, by use."""
    held = [use for use in USES if use in data]
    rows = []
    for gait in data[TRAIN]:
        own = [data[use][gait] for use in (TRAIN, *held)]
        rows.append([gait, *(f"{part['seconds']:g}" for part in own), str(sum(part["falls"] for part in own))])
    header = ["gait", "training [s]", *(f"{USES[use]} [s]" for use in held), "falls of the expert"]
    return markdown(header, rows)


def training_table(students: Sequence[Mapping[str, Any]]) -> str:
    """One row per learner: number of networks, time and rows per second of all its trainings."""
    rows = []
    for learner, own in learners(students).items():
        devices = sorted({f"{each['device']}, {each['threads']} thread(s)" for each in own})
        minutes = sum(each["seconds"] for each in own) / 60
        speeds = [each["samples_per_s"] for each in own]
        about = [str(learner.width), str(learner.steps), str(len(own)), f"{minutes:.1f}"]
        where = [KINDS[learner.kind], "; ".join(devices), learner.precision]
        rows.append([*where, *about, f"{sum(speeds) / len(speeds):,.0f}"])
    times = ["training, all [min]", "rows per second, mean"]
    header = ["learner", "on", "trained in", "width", "steps", "networks", *times]
    return markdown(header, rows, text_columns=3)


def _cell(value: Estimate, how: str) -> str:
    interval = "" if math.isnan(value.half) else f" ± {value.half:{how}}"
    return f"{number(value.mean, how)}{interval}"


def _better(worse: Sequence[str]) -> str:
    if not worse:
        return f"all {len(FIGURES)}"
    return f"**all but {', '.join(SHOWN[name] for name in worse)}**" if len(worse) < len(FIGURES) else "**none**"


# -- Text --------------------------------------------------------------------------------------------------------------


def differences(name: str, table: Mapping[str, Any]) -> str:
    """What is not as in the paper's table of some name, as a list."""
    config, env = table["config"], table["env_kwargs"]
    loss = "the mean over rows and joints per gait, summed over gaits; the paper's is the sum over rows"
    points = [
        "Expert: the MPC of this project, not the authors' controller; another expert makes other targets.",
        f"Gains: Kp {env['kp']:g} N m/rad and Kd {env['kd']:g} N m s/rad for all gaits. Targets are q + (tau + Kd v) / "
        "Kp in both, so other gains scale them differently.",
        f"Training: AdamW, one-cycle schedule with a peak of {config['learning_rate']:g}, {config['batch_size']} rows "
        f"per step, equally many of every gait, {loss}. Optimiser, rate, batch, duration and seeds of the paper are "
        "not stated. Where a student was trained in bfloat16, weights, loss and all measurements are float32 still. A "
        "network per gait draws as many rows of its gait per step as a network of all gaits does.",
        f"Commands: {config['train_commands']} per gait for training, drawn from ± {config['span'][0]:g} m/s forward "
        f"and ± {config['span'][1]:g} m/s sideways, yaw rate 0; the authors' own lists are not published. "
        f"{clipped(table)} Held-out ones are at least {config['gap']:g} m/s from every command of the training.",
        f"Recordings: {config['seconds']:g} s per command, from a standing start, the first steps included; after a "
        "fall the end is dropped and the walk begins again.",
        f"Normalisation: {config['normalization']}, contacts left as they are.",
    ]
    if name == "hardware":
        points.append(
            "World: the paper's walks are a real robot's. Ours is simulated, with the paper's rates (MPC 100 Hz, whole "
            f"body {env['control_hz']} Hz), white noise on the student's sensors, {1000 * env['action_delay_s']:g} ms "
            f"of delay, and {estimate(env)}"
        )
    else:
        points.append("World: MuJoCo with our model of the robot, flat ground, no noise, 1 kHz.")
    return "\n".join(f"- {point}" for point in points)


def estimate(env: Mapping[str, Any]) -> str:
    """What the expert knows of the state in an environment with these arguments, as the end of a sentence."""
    if env.get("state_estimator"):
        return (
            "an expert that does not know the state: a Kalman filter tells it what it can, from the inertial unit, "
            "the joints and the contacts, the very readings that the student sees. As on a robot, but there contacts "
            "are uncertain too."
        )
    return (
        "white noise and a bias per episode on the expert's estimate of the state "
        f"({noise_factor(env['estimator_noise']):g} times the environment's default). The noises of estimate and "
        "sensors are independent of each other, so a part of the expert's answer cannot be told from what the student "
        "sees; on a robot, estimate and observation come from the same readings."
    )


def noise_factor(noise: bool | Mapping[str, float]) -> float:
    """How large the estimator's noise is, in units of the default; True is the default."""
    return 1.0 if noise is True else noise["velocity"] / EstimatorNoise().velocity


def clipped(table: Mapping[str, Any]) -> str:
    """Which gaits' commands had to be clipped to what the expert survives."""
    span = [*table["config"]["span"], 0.0]
    own = [
        f"{gait} ± {' and ± '.join(f'{x:g}' for x in high[:2])}"
        for gait, high in table["largest"].items()
        if high != span
    ]
    return f"Clipped to what the expert survives: {'; '.join(own)} m/s." if own else "None had to be clipped."


def made_by(table: Mapping[str, Any]) -> str:
    """How a table was made."""
    commands = " and ".join(dict.fromkeys(f"`{own['command']}`" for own in table["students"]))
    minutes = sum(own["seconds"] for own in table["students"]) / 60
    return f"Made by {commands}, data seed {table['seed']}; the trainings took {minutes:.0f} min together."
