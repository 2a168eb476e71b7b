"""A public controller that the expert is compared with; it is not needed otherwise, and none of its code is here."""

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from experts.robot_model import to_pinocchio
from go1_mtl_gym import Gait
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.state import RobotState


class MissingPeerError(InvalidInputError):
    """A checkout that was asked for cannot be used; the message says what is missing."""


class Go2ConvexMPC:
    """github.com/elijah-waichong-chan/go2-convex-mpc, imported from a checkout.

    It controls another robot of the same family with the same number of joints in the same order, so it can be asked at
    our robot's states: base, joints and velocities are handed over, its own model of its own robot answers. Its horizon
    is 16 intervals over one cycle, like ours; its gait is set to the same period, duty and phase.

    Args:
        checkout: root folder of the repository.
        gait: of the walk; a trot, the only gait it has.
        command: (vx [m/s], vy [m/s], yaw rate [rad/s]).

    Raises:
        MissingPeerError: if the folder, a package or a mesh is missing.
    """

    HEIGHT = 0.27
    STEPS = 16

    def __init__(self, checkout: Path, gait: Gait, command: Sequence[float]) -> None:
        source = checkout / "src" / "python"
        if not (source / "convex_mpc").is_dir():
            raise MissingPeerError(
                f"{checkout} is no checkout of go2-convex-mpc: there is no src/python/convex_mpc in it"
            )
        if gait.name != "trot":
            raise MissingPeerError(f"go2-convex-mpc knows trot only, got {gait.name}")
        if not hasattr(np, "trapz"):
            raise MissingPeerError(f"go2-convex-mpc does not run on numpy {np.__version__}; it needs numpy < 2.4")
        sys.path.append(str(source))
        try:
            from convex_mpc.centroidal_mpc import CentroidalMPC
            from convex_mpc.com_trajectory import ComTraj
            from convex_mpc.gait import Gait as TheirGait
            from convex_mpc.go2_robot_data import PinGo2Model
            from convex_mpc.leg_controller import LegController
        except ImportError as error:
            raise MissingPeerError(f"go2-convex-mpc cannot be imported: {error}; it needs casadi and pin") from error
        try:
            self._robot = PinGo2Model()
        except ValueError as error:
            raise MissingPeerError(
                f"go2-convex-mpc cannot read its robot: {error}; is the checkout complete?"
            ) from error
        self._ours, self._command = gait, command
        self._gait, self._legs = TheirGait(1.0 / gait.period, gait.duty), LegController()
        self._trajectory = ComTraj(self._robot)
        self._time = 0.0
        self._plan()
        self._mpc = CentroidalMPC(self._robot, self._trajectory)

    def _plan(self) -> None:
        vx, vy, yaw_rate = self._command
        dt = self._ours.period / self.STEPS
        self._trajectory.generate_traj(
            self._robot, self._gait, self._time, vx, vy, self.HEIGHT, yaw_rate, time_step=dt * (1 - 1e-9)
        )

    def __call__(self, state: RobotState) -> dict[str, float]:
        """Seconds of its QP (by its own clock), of its MPC update, and of everything down to joint torques."""
        start = time.perf_counter()
        self._robot.update_model(*to_pinocchio(state))
        cycles = self._time // self._ours.period
        turn = (state.phase + 0.5) % 1.0  # its diagonals are half a cycle from ours
        self._time = (cycles + (turn < (self._time / self._ours.period) % 1.0) + turn) * self._ours.period
        begin = time.perf_counter()
        self._plan()
        forces = self._mpc.solve_QP(self._robot, self._trajectory)["x"].full().ravel()
        end = time.perf_counter()
        first = forces[self.STEPS * 12 : self.STEPS * 12 + 12]
        for i, leg in enumerate(("FL", "FR", "RL", "RR")):
            self._legs.compute_leg_torque(leg, self._robot, self._gait, first[3 * i : 3 * i + 3], self._time)
        action = time.perf_counter() - start
        return {"qp": self._mpc.solve_time / 1e3, "update": end - begin, "action": action}
