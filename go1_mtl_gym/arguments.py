"""Checks of what users pass to the environment; every message says what came and what was expected."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

from go1_mtl_gym.conditions import Conditions
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import SensorNoise
from go1_mtl_gym.sensing.state_estimator import StateEstimatorConfig
from go1_mtl_gym.sensing.state_noise import EstimatorNoise
from go1_mtl_gym.sim.domain_randomization import DomainRandomization
from go1_mtl_gym.sim.physics_params import PhysicsParams
from go1_mtl_gym.sim.simulation import PHYSICS_HZ
from go1_mtl_gym.tasks import TASKS
from go1_mtl_gym.validation import number_in, one_of

Kind = TypeVar("Kind")


def check_control_hz(control_hz: object) -> int:
    """Return a control rate that the physics can be divided by [Hz].

    Raises:
        InvalidInputError: if it is none.
    """
    rate = number_in(control_hz, 50, PHYSICS_HZ, "control_hz")
    if rate % 1 or PHYSICS_HZ % rate:
        raise InvalidInputError(f"control_hz must be an integer that divides {PHYSICS_HZ}, got {control_hz}")
    return int(rate)


def check_rendering(render_mode: object, modes: list[str], width: object, height: object) -> None:
    """Check how and how large the robot is to be drawn.

    Raises:
        InvalidInputError: if the mode is unknown or the size [pixels] impossible.
    """
    for name, size in (("width", width), ("height", height)):
        number_in(size, 16, 8192, f"{name} [pixels]")
    if render_mode is not None:
        one_of(render_mode, modes, "render_mode")


def check_switch(value: Kind | bool | None, kind: type[Kind], what: str) -> Kind | None:
    """Return what can be switched on: True is the default of its kind, None and False are none.

    Raises:
        InvalidInputError: if it is something else.
    """
    if not (value is None or isinstance(value, (bool, kind))):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        raise InvalidInputError(f"{what} must be None, True, False or {article} {kind.__name__}, got {value!r}")
    return kind() if value is True else (value or None)


def check_conditions(given: Mapping[str, Any], figures: Mapping[str, Any]) -> Conditions:
    """Return what the environment's episodes take place under.

    Args:
        given: the environment's arguments by name, among them noise, estimator_noise, state_estimator
            and randomization.
        figures: all further keyword arguments; those of `PhysicsParams`.

    Raises:
        InvalidInputError: for an unknown name, an impossible figure, or both ways to estimate a state.
    """
    for name in figures:
        one_of(name, (*given, *(each.name for each in fields(PhysicsParams))), "argument of Go1Env")
    return Conditions(
        PhysicsParams(**figures),
        check_switch(given["noise"], SensorNoise, "noise"),
        check_switch(given["estimator_noise"], EstimatorNoise, "estimator_noise"),
        check_switch(given["state_estimator"], StateEstimatorConfig, "state_estimator"),
        check_switch(given["randomization"], DomainRandomization, "randomization"),
    )


def check_phase(phase: object) -> float:
    """Return a phase of the gait clock [cycles].

    Raises:
        InvalidInputError: if it is no number in [0, 1).
    """
    number = number_in(phase, 0.0, 1.0, "phase [cycles]")
    if number == 1.0:
        raise InvalidInputError("phase [cycles] must lie in [0, 1), got 1")
    return number


def check_reset_options(
    options: Mapping[str, Any] | None, tasks: tuple[str, ...], default_task: str | None
) -> tuple[str | None, np.ndarray | None]:
    """Return the task's name (None: draw one) and the command (None: draw one) that an episode was asked to have.

    Args:
        options: what `reset` was given.
        tasks: names that the environment knows.
        default_task: the environment's own, or None.

    Raises:
        InvalidInputError: for an unknown option, task or impossible command.
    """
    options = dict(options or {})
    for name in options:
        one_of(name, ("command", "task"), "reset option")
    task, command = options.get("task"), options.get("command")
    if task is not None:
        one_of(task, tasks, "task")
    task = task or default_task
    if command is not None:
        for name in tasks if task is None else (task,):  # whichever is drawn must allow it
            command = TASKS[name].check_command(command)
    return task, command
