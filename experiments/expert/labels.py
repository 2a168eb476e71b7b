"""What the expert's answers depend on: not on place or heading or what was asked before, but on the gait clock."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from experiments.expert.lab import ExpertOptions, ExpertStudy, Lab, generator
from experiments.study import option
from experiments.tables import mean
from experts import NMPCExpert
from experts.phase_fitting import fit_phase
from experts.robot_model import RobotModel
from go1_mtl_gym import TASKS
from go1_mtl_gym.rotations import yaw_matrix
from go1_mtl_gym.sensing.state import RobotState


@dataclass(frozen=True)
class LabelOptions(ExpertOptions):
    """States along walks at drawn commands, at which labels are compared."""

    walks: int = option(5, "per gait")
    seconds: float = option(6.0, "duration of each; the first does not count [s]")
    every: int = option(5, "control steps between two states")
    shift: float = option(0.25, "by how much the gait clock is put wrong [cycles]")
    distance: float = option(100.0, "how far robots are displaced at most [m]")


class Labels(ExpertStudy):
    """What the expert's labels depend on: place, heading, what was asked before, and the gait clock."""

    name = "expert_labels"
    title = "Labels"
    rows = {"task": "gait"}
    columns = {
        "states": mean("states", ".0f"),
        "other bits when asked again": mean("asked_again", ".0f"),
        "moved and turned [rad]": mean("displaced", ".0e"),
        "clock wrong by 1/4 [rad]": mean("wrong_clock", ".3f"),
        "then fitted [rad]": mean("fitted_clock", ".3f"),
        "error of the fitted clock [cycles]": mean("phase_error", ".3f"),
        "95 %": mean("phase_error_p95", ".3f"),
    }
    full = LabelOptions()
    quick = LabelOptions(("trot", "jump"), walks=1, seconds=1.5)

    def measure_in(self, lab: Lab, task: str, seed: int) -> list[dict[str, Any]]:
        return [labels(lab, task, self.options, seed)]


def labels(lab: Lab, task: str, options: LabelOptions, seed: int) -> dict[str, Any]:
    """Differences between joint targets [rad] and errors of the fitted clock [cycles].

    Returns:
        "displaced": largest difference when robots stand and face elsewhere; "asked_again": how many of the states got
        other bits from an expert that was asked in the opposite order; "wrong_clock": median over states of the mean
        difference per joint when the clock is shifted; "fitted_clock": the same when the clock was then fitted from the
        robot's motion; "phase_error" and "phase_error_p95": median and 95th percentile of that fit's error.
    """
    states = _states(lab, task, options, seed)
    rng, model = generator("labels", task, seed), RobotModel()
    asked, backwards = NMPCExpert(), NMPCExpert()
    answers = np.array([asked.action(state) for state in states])
    again = np.array([backwards.action(state) for state in reversed(states)])[::-1]
    displaced = [asked.action(_displaced(state, rng, options.distance)) for state in states]
    shifted = [replace(state, phase=(state.phase + options.shift) % 1.0) for state in states]
    fitted = [replace(state, phase=fit_phase(state, model).phase) for state in shifted]
    errors = np.array([abs((now.phase - then.phase + 0.5) % 1.0 - 0.5) for now, then in zip(fitted, states)])

    def off(others: list[RobotState]) -> float:
        return float(np.median(np.abs(np.array([asked.action(state) for state in others]) - answers).mean(axis=1)))

    return {
        "states": len(states),
        "displaced": float(np.abs(np.array(displaced) - answers).max()),
        "asked_again": int((again != answers).any(axis=1).sum()),
        "wrong_clock": off(shifted),
        "fitted_clock": off(fitted),
        "phase_error": float(np.median(errors)),
        "phase_error_p95": float(np.quantile(errors, 0.95)),
    }


def _states(lab: Lab, task: str, options: LabelOptions, seed: int) -> list[RobotState]:
    """States of a moving robot, from the second second of each walk."""
    states = []
    for i in range(options.walks):
        rng = generator("labels", task, seed, i)
        lab.begin(task, rng.uniform(-1, 1, 3) * np.array(TASKS[task].command_range), "labels", seed, i)
        for step in range(round(options.seconds * lab.env.control_hz)):
            if step >= lab.env.control_hz and step % options.every == 0:
                states.append(lab.env.state)
            if lab.step()["fallen"]:
                break
    return states


def _displaced(state: RobotState, rng: np.random.Generator, distance: float) -> RobotState:
    """The same robot somewhere else, facing another way."""
    yaw = rng.uniform(-np.pi, np.pi)
    turn = np.eye(3)
    turn[:2, :2] = yaw_matrix(yaw)
    w, x, y, z = state.quat_wxyz
    quat = np.cos(yaw / 2) * state.quat_wxyz + np.sin(yaw / 2) * np.array([-z, -y, x, w])
    return replace(
        state,
        position_w=turn @ state.position_w + np.array([*rng.uniform(-distance, distance, 2), 0.0]),
        quat_wxyz=quat,
        linear_velocity_w=turn @ state.linear_velocity_w,
    )
