"""Tables in Markdown that are made from the code when the site is built, so that they cannot go stale."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import MISSING, fields
from pathlib import Path

from experiments.catalog import STUDIES, study_class, summary_line
from experiments.results import Results
from go1_mtl_gym import (
    BUILT_IN_TASKS,
    TASKS,
    DomainRandomization,
    EnvConfig,
    PDGains,
    PhysicsParams,
    RewardWeights,
    SensorNoise,
    SensorParams,
    env_id,
    robot,
)
from go1_mtl_gym.actuation import ActionMap
from go1_mtl_gym.sensing.observation import CHANNELS, UNITS, ObservationLayout
from trainers.cli.train import SAID
from trainers.data.operator import MOVES, OperatorConfig
from trainers.evaluation.conditions import CONDITIONS
from trainers.pipeline.config import JobConfig
from trainers.pipeline.presets import PRESETS
from trainers.utils.docstrings import described

CONTENT = {
    "accelerometer": "specific force at the IMU, trunk frame",
    "gyroscope": "angular velocity, trunk frame",
    "q": "joint positions, legs FL FR RL RR, joints hip thigh calf",
    "dq": "joint velocities, same order",
    "contacts": "feet on the ground, FL FR RL RR",
    "command": "filtered command: vx, vy, yaw rate",
    "gravity": "unit vector of gravity, trunk frame",
    "phase": "sine and cosine of the gait clock",
    "last_action": "the action of the last step",
    "leg_kinematics": "feet, 4 x 3, and what each says of the trunk's velocity if it stands still, 4 x 3; trunk frame",
    "gait": "of each leg sine and cosine of its clock, times to touchdown and lift-off [s], share of the next control "
    "period on the ground, duty; of the gait cycles per second, swing height [m], stance width, body height; standing",
    "history": "the first 34 numbers of the frames before this one, newest first",
    "task": "one-hot task id, in the order of `tasks`",
}
"""What the parts of an observation hold."""
SETTINGS = {
    "tasks": "gaits",
    "control_hz": "control rate [Hz]",
    "channels": "channels",
    "clean_s": "clean demonstrations per gait [s]",
    "perturbed_s": "perturbed demonstrations per gait [s]",
    "hard_push_s": "perturbed and pushed hard, per gait [s]",
    "randomized_s": "perturbed, with drawn physics and sensors, per gait [s]",
    "operator": "an [operator](#the-operator) in perturbed ones, rounds and evaluation",
    "world_s": "length of the episodes in which they are drawn [s]",
    "margin": "reach of the operator in demonstrations and rounds, as a multiple of the evaluated one",
    "hard_push_interval": "mean time between hard pushes in `hard_push_s` [s]",
    "held_out_s": "held-out demonstrations per gait [s]",
    "mirror": "rows in the mirror as well",
    "rounds": "DAgger rounds",
    "dagger_s": "per gait and round [s]",
    "randomized": "fraction of episodes in rounds with drawn physics and sensors",
    "width": "units per hidden layer",
    "normalization": "normalization",
    "batch_size": "rows per gradient step",
    "clone_steps": "gradient steps of cloning",
    "round_steps": "gradient steps per round",
    "phase_free_s": "walks of the policy that teach it the phase, per gait [s]",
    "episodes": "evaluation episodes per gait and agent",
    "episode_s": "duration of an episode [s]",
}
"""Settings of the main job that its table shows, and what they are called there."""
OPTIONS = ("preset", "out", "tasks", "rounds", "seed", "n_envs", "device", "channels", "history", "control_hz")
"""Of the main job, those that its table shows."""
NEEDS = {
    "dagger_s": "rounds",
    "round_steps": "rounds",
    "randomized": "rounds",
    "hard_push_s": "operator",
    "hard_push_interval": "operator",
}
"""Those that mean nothing without another one."""
RESULTS = Path(__file__).resolve().parents[1] / "results"
"""Where the results of the studies are."""


def markdown(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; columns of numbers are set right, the others left."""
    cells = [[str(cell) for cell in row] for row in rows]
    rule = ["--:" if all(re.fullmatch(r"[-±.\d ]+", cell) for cell in column) else ":--" for column in zip(*cells)]
    return "\n".join("| " + " | ".join(line) + " |" for line in (header, rule, *cells))


def _unit(name: str) -> str:
    return "0 or 1" if name in ("contacts", "task") else UNITS.get(name, "-").replace("^2", "²")


def gaits() -> str:
    """Contact plan of every task that comes with the package."""
    header = ("gait", "id", "period [s]", "duty", "offsets FL FR RL RR", "steps/s", "swing [m]", "stands")
    rows = []
    for task in (TASKS[name] for name in BUILT_IN_TASKS):
        gait = task.gait
        rows.append(
            (
                task.name,
                f"`{env_id(task.name).partition(':')[2]}`",
                f"{gait.period:.2f}",
                f"{gait.duty:.2f}",
                " ".join(f"{offset:g}" for offset in gait.offsets),
                f"{gait.step_rate:.2f}",
                f"{gait.swing_height:.2f}",
                "yes" if gait.can_stand else "no",
            )
        )
    return markdown(header, rows)


def commands() -> str:
    """Ranges and limits of every task's commands."""
    header = ("gait", "range: vx", "vy [m/s]", "yaw rate [rad/s]", "accepted: vx", "vy [m/s]", "yaw rate [rad/s]")
    return markdown(
        header,
        [
            (task.name, *(f"± {x:g}" for x in (*task.command_range, *task.command_limit)))
            for task in (TASKS[name] for name in BUILT_IN_TASKS)
        ],
    )


def actions() -> str:
    """The twelve entries of an action, with the default gains."""
    action_map = ActionMap.for_gains(PDGains())
    low, high = action_map.to_radians(-1.0), action_map.to_radians(1.0)
    header = ("index", "joint", "-1 [rad]", "0 [rad]", "+1 [rad]", "joint range [rad]", "torque limit [N m]")
    rows = [
        (
            index,
            f"`{joint.removesuffix('_joint')}`",
            f"{low[index]:.3f}",
            f"{action_map.center[index]:.3f}",
            f"{high[index]:.3f}",
            f"{robot.JOINT_LOWER[index]:.3f} ... {robot.JOINT_UPPER[index]:.3f}",
            f"{robot.TORQUE_LIMIT[index]:g}",
        )
        for index, joint in enumerate(robot.JOINTS)
    ]
    return markdown(header, rows)


def _layout_table(layout: ObservationLayout) -> str:
    rows = []
    for name, where in layout.slices.items():
        size, span = where.stop - where.start, f"`{where.start}:{where.stop}`"
        low, high = layout.low[where], layout.high[where]
        largest = ", ".join(f"{value:.4g}" for value in sorted(set(high.tolist()), reverse=True))
        bounds = f"± {largest}" if (low == -high).all() else f"0 ... {largest}"
        bounds = "as of those" if name == "history" else bounds
        rows.append((f"`{name}`", span, size, _unit(name), bounds, CONTENT[name]))
    return markdown(("part", "slice", "size", "unit", "bounds", "content"), rows)


def default_observation() -> str:
    """The observation of an environment that was made without arguments."""
    return _layout_table(EnvConfig().layout)


def paper_observation() -> str:
    """The observation of arXiv 2505.08574: 34 numbers and the task id."""
    return _layout_table(ObservationLayout(EnvConfig().tasks))


def optional_parts() -> str:
    """Parts of an observation that are there when asked for."""
    rows = [(f"`{name}`", size, _unit(name), CONTENT[name]) for name, size in CHANNELS.items()]
    rows.append(("`history`", "34 (n - 1)", "-", "with `history=n`: the n - 1 frames before this one, newest first"))
    return markdown(("channel", "size", "unit", "content"), rows)


def physics() -> str:
    """Ways in which the physics can differ, with the ranges of `DomainRandomization`."""
    rows = [_ranged(PhysicsParams, each.name, each.name) for each in fields(PhysicsParams)]
    return markdown(("argument", "default", "randomized over", "meaning"), rows)


def sensors() -> str:
    """Faults of the sensors, with the ranges of `DomainRandomization`."""
    rows = [
        _ranged(SensorParams, "encoder_offset", "encoder_offset"),
        _ranged(SensorParams, "delay_s", "sensor_delay_s"),
    ]
    return markdown(("field", "default", "randomized over", "meaning"), rows)


def _ranged(kind: type, name: str, drawn: str) -> tuple[str, ...]:
    """A field of a dataclass, and its range in `DomainRandomization`, where it may have another name."""
    default = next(each.default for each in fields(kind) if each.name == name)
    low, high = getattr(DomainRandomization(), drawn)
    return f"`{name}`", f"`{default}`", f"{low:g} ... {high:g}", described(kind)[name]


def sensor_noise() -> str:
    """Standard deviations of the default sensor noise."""
    rows = [(f"`{each.name}`", f"{each.default:g}", _unit(each.name)) for each in fields(SensorNoise)]
    return markdown(("reading", "standard deviation", "unit"), rows)


def rewards() -> str:
    """Terms of the reward and their weights."""
    formula = {
        "velocity": r"$\exp(-\lVert v_{xy} - c_{xy} \rVert^2 / 0.25)$",
        "yaw_rate": r"$\exp(-(\omega - c_\omega)^2 / 0.25)$",
        "posture": r"$-(g_x^2 + g_y^2 + \min(((z - z_0) / 0.1)^2, 4))$",
        "effort": r"$-\frac{1}{12} \sum_j (\tau_j / \tau_{j,\mathrm{max}})^2$",
        "alive": "$1$",
    }
    rows = [(f"`{each.name}`", f"{each.default:g}", formula[each.name]) for each in fields(RewardWeights)]
    return markdown(("term", "weight", "value"), rows)


def arguments() -> str:
    """Every keyword argument of the environment, with its default."""
    meaning = described(EnvConfig)
    defaults = {each.name: each.default for each in fields(EnvConfig) if each.default is not MISSING}
    rows = [(f"`{name}`", f"`{default!r}`", meaning[name]) for name, default in defaults.items()]
    return markdown(("argument", "default", "meaning"), rows)


def job_options() -> str:
    """The options of the main job that are given most often."""
    meaning = described(JobConfig) | SAID
    rows = [(f"`--{name.replace('_', '-')}`", meaning[name].replace("<", r"\<")) for name in OPTIONS]
    return markdown(("option", "meaning"), rows)


def presets() -> str:
    """What the presets of the main job do."""
    configs = [JobConfig(**settings) for settings in PRESETS.values()]
    rows = [[label, *(_setting(config, name) for config in configs)] for name, label in SETTINGS.items()]
    return markdown(["", *(f"`{name}`" for name in PRESETS)], rows)


def _setting(config: JobConfig, name: str) -> str:
    if name in NEEDS and not getattr(config, NEEDS[name]):
        return "-"
    value = getattr(config, name)
    if isinstance(value, bool) or name == "operator":
        return "yes" if value else "no"
    values = value if isinstance(value, tuple) else (value,)
    return (
        ", ".join(f"{each:g}" if isinstance(each, float) else str(each) for each in values if each is not None) or "-"
    )


def operator_moves() -> str:
    """What a hand does next, and how often."""
    meaning, hands = described(OperatorConfig), OperatorConfig()
    rows = []
    for name, weight in zip(MOVES, hands.weights):
        share, what = weight / hands.weights.sum(), re.sub(r"^(weight )?of ", "", meaning[name])
        rows.append((f"`{name}`", f"{weight:g}", f"{share:.1%}", what))
    return markdown(("move", "weight", "share of the moves", "what the hand does"), rows)


def operator_settings() -> str:
    """Everything else about an operator."""
    meaning = described(OperatorConfig)
    rows = [
        (f"`{each.name}`", f"`{each.default!r}`", meaning[each.name])
        for each in fields(OperatorConfig)
        if each.name not in MOVES
    ]
    return markdown(("field", "default", "meaning"), rows)


def conditions() -> str:
    """What `trainers.certify` knows by name."""
    rows = [
        (f"`{name}`", each.title, "nominal" if each.claim is None else f"{each.claim:.2%}", each.judged_by)
        for name, each in CONDITIONS.items()
    ]
    return markdown(("name", "condition", "claim", "judged by"), rows)


def studies() -> str:
    """Every study: what it measures, and what it took when it was published."""
    rows = []
    for name in STUDIES:
        path = RESULTS / f"{name}.json"
        minutes, size = "-", "-"
        if path.is_file():
            measured = Results.read(path)
            minutes, size = f"{measured.minutes:.0f}" if measured.seconds else "-", f"{path.stat().st_size / 1024:.0f}"
        rows.append((f"`{name}`", summary_line(study_class(name)), minutes, size))
    return markdown(("study", "measures", "one core [min]", "file [kB]"), rows)


TABLES: dict[str, Callable[[], str]] = {
    function.__name__: function
    for function in (
        gaits,
        commands,
        actions,
        default_observation,
        paper_observation,
        optional_parts,
        physics,
        sensors,
        sensor_noise,
        rewards,
        arguments,
        presets,
        operator_moves,
        operator_settings,
        job_options,
        conditions,
        studies,
    )
}
"""The tables that a page can ask for."""
