"""``python -m web.export``: everything that the page in the browser needs to know, from the objects that know it.

One JSON of constants, the weights of the networks, and the robot's files as they are. The page types no number again.
"""

import argparse
import dataclasses
import hashlib
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from go1_mtl_gym import TASKS, PolicyContract, episode, gait_change, gaits, robot
from go1_mtl_gym.actuation import PHYSICS_HZ
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import PROPRIOCEPTION
from go1_mtl_gym.sim.simulation import CONTACT_FORCE
from trainers.evaluation.tour import DEFAULT_TOUR
from trainers.policies.loading import load
from trainers.policies.multi_head import MultiHeadPolicy
from trainers.policies.phase_estimator import CLIP_SD
from trainers.policies.phase_free import PhaseFreePolicy, without_phase
from trainers.policies.pretrained import PRETRAINED, load_pretrained
from trainers.utils.cli import main, writable_folder
from trainers.utils.files import json_form, write_atomically, write_json
from web.footfalls import expert_footfalls

OUT = Path(__file__).parent / "build" / "data"
"""Where the page's build looks for it."""
CONSTANTS = "constants.json"
WEIGHTS = "weights"
MODEL_FILES = (robot.MODEL_PATH, robot.SCENE_PATH)
_CHANNELS = ("command", "phase", "last_action", "leg_kinematics")
"""The channels that the page can make."""


class WeightFiles:
    """Tensors in files of little-endian float32, named by their content, so that equal networks are one file.

    Args:
        folder: where they go.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def add(self, module: torch.nn.Module) -> dict[str, Any]:
        """Write the tensors of a module.

        Returns:
            The file's name, its size in bytes, and name and shape of each tensor in order, as the page reads them.
        """
        tensors = {
            name: np.ascontiguousarray(value.cpu().numpy(), "<f4") for name, value in module.state_dict().items()
        }
        content = b"".join(value.tobytes() for value in tensors.values())
        name = f"{hashlib.sha256(content).hexdigest()[:16]}.bin"
        write_atomically(self._folder / name, lambda file: file.write(content))
        shapes = [{"name": name, "shape": list(value.shape)} for name, value in tensors.items()]
        return {"file": f"{WEIGHTS}/{name}", "bytes": len(content), "tensors": shapes}


def export(policies: Sequence[MultiHeadPolicy | PhaseFreePolicy], out: Path, footfalls: bool = True) -> dict[str, Any]:
    """Write a folder for the page's build; what stood there of an earlier one goes.

    Args:
        policies: the student with a clock first; then, if the page is to offer it, one without.
        out: the folder.
        footfalls: whether the expert's are recorded, which takes a minute.

    Returns:
        The constants, as they were written.

    Raises:
        InvalidInputError: if the policies are not what the page can drive.
    """
    student = _checked(policies)
    shutil.rmtree(out, ignore_errors=True)
    files = WeightFiles(out / WEIGHTS)
    values = constants(student.named_contract()) | {"policies": {each.kind: _policy(each, files) for each in policies}}
    if footfalls:
        values["footfalls"] = expert_footfalls(student.named_contract())
    for path in MODEL_FILES:
        content = Path(path).read_bytes()
        write_atomically(out / "model" / Path(path).name, lambda file, content=content: file.write(content))  # type: ignore[misc]
    write_json(out / CONSTANTS, values)
    return values


def _checked(policies: Sequence[MultiHeadPolicy | PhaseFreePolicy]) -> MultiHeadPolicy:
    """The student with a clock.

    Raises:
        InvalidInputError: if there is none, or the page cannot drive one of the policies.
    """
    if not policies or not isinstance(policies[0], MultiHeadPolicy) or policies[0].pooled:
        raise InvalidInputError(f"the first policy must be a student with a clock and a head per gait, got {policies}")
    first = policies[0].named_contract()
    if set(first.channels) != set(_CHANNELS):
        raise InvalidInputError(f"the page makes the channels {_CHANNELS}, the student sees {first.channels}")
    for other in policies[1:]:
        if not isinstance(other, PhaseFreePolicy):
            raise InvalidInputError(f"after the student with a clock came {other}, where one without was expected")
        contract = other.named_contract()
        first.check(contract, "the student with a clock", "the one without", ignore=("terms",))
        if contract.channels != without_phase(first.channels):
            raise InvalidInputError(
                f"the student without a clock must see {without_phase(first.channels)}, it sees {contract.channels}"
            )
    return policies[0]


def constants(contract: PolicyContract) -> dict[str, Any]:
    """All numbers of the page but the policies', as JSON values.

    Args:
        contract: of the student with a clock.
    """
    tasks = [TASKS[name] for name in contract.tasks]
    values = {
        "tasks": {task.name: _task(task) for task in tasks},
        "physics_hz": PHYSICS_HZ,
        "control_hz": contract.control_hz,
        "actuators": {name: getattr(contract, name) for name in ("kp", "kd", "default_q", "action_scale")},
        "robot": _robot(),
        "clock": {"stand_command": gaits.STAND_COMMAND, "slack": gaits.PHASE_SLACK},
        "command_filter": {"time_constant_s": episode.COMMAND_FILTER_S, "slew": episode.COMMAND_SLEW},
        "gait_change": {
            "shortest_task_s": gait_change.SHORTEST_TASK_S,
            "slack_s": gait_change.SLACK_S,
            "fraction": gait_change.CHANGE_FRACTION,
            "reach": gait_change.REACH,
            "slack_command": gait_change.SLACK_COMMAND,
        },
        "episode": {
            "joint_noise": episode.RESET_JOINT_NOISE,
            "fallen_height": episode.FALLEN_HEIGHT,
            "fallen_cosine": episode.FALLEN_COSINE,
        },
        "proprioception": list(PROPRIOCEPTION),
        "contact_force": CONTACT_FORCE,
        "default_tour": DEFAULT_TOUR,
    }
    form: dict[str, Any] = json_form(values, "constants of the page")
    return form


def _task(task: Any) -> dict[str, Any]:
    followed = {name: getattr(task.gait, name) for name in ("duties", "can_stand", "change_phase")}
    gait = dataclasses.asdict(task.gait) | followed
    return {name: getattr(task, name) for name in ("command_range", "command_limit", "push_limit")} | {"gait": gait}


def _robot() -> dict[str, Any]:
    names = (
        "LEGS", "JOINTS", "HOME_POSE", "STANDING_HEIGHT", "THIGH_LENGTH", "CALF_LENGTH", "HIP_TO_THIGH",
        "HIP_POSITION_B", "LEG_SIDE",
    )  # fmt: skip
    return {name.lower(): getattr(robot, name) for name in names}


def _policy(policy: MultiHeadPolicy | PhaseFreePolicy, files: WeightFiles) -> dict[str, Any]:
    """What the page needs to know of a policy."""
    contract = policy.named_contract()
    layout = contract.layout
    values = {
        "contract": contract.as_dict(),
        "low": layout.low,
        "high": layout.high,
    }
    if isinstance(policy, PhaseFreePolicy):
        estimator = {"clip_sd": CLIP_SD, "weights": files.add(policy.estimator)}
        student = _policy(policy.student, files)
        values |= {"student": student, "estimator": estimator, "correction": policy.correction}
    else:
        shared = torch.nn.ModuleDict({name: getattr(policy, f"{name}_normalizer") for name in ("obs", "act")})
        shared["trunk"] = policy.actor.trunk
        heads = {name: files.add(head) for name, head in zip(contract.tasks, policy.actor.heads, strict=True)}
        values |= {"clip_sd": policy.clip_sd, "shared": files.add(shared), "heads": heads}
    form: dict[str, Any] = json_form(values, "a policy")
    return form


def read_policies(clocked: str, phase_free: str) -> list[MultiHeadPolicy | PhaseFreePolicy]:
    """The policies of two files, or of the package by their names there."""
    return [load_pretrained(given) if given in PRETRAINED else load(given) for given in (clocked, phase_free) if given]


@main
def run(arguments: Sequence[str] | None = None) -> None:
    """Write the page's data."""
    parser = argparse.ArgumentParser(prog="python -m web.export", description="Write what the page needs to know.")
    add_policies(parser)
    parser.add_argument("--out", default=OUT, type=Path, help="folder of the data; %(default)s")
    parser.add_argument("--no-footfalls", action="store_true", help="without the expert's, which take a minute")
    given = parser.parse_args(arguments)
    out = writable_folder(given.out)
    export(read_policies(given.policy, given.phase_free), out, not given.no_footfalls)
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    print(f"{out}: {size / 1e6:.1f} MB")


def add_policies(parser: argparse.ArgumentParser) -> None:
    """Options that say which policies the page drives."""
    parser.add_argument("--policy", default="clocked", help="file of the student with a clock (default: the package's)")
    parser.add_argument("--phase-free", default="phase_free", help='likewise without one; "" leaves it out')


if __name__ == "__main__":
    raise SystemExit(run())
