"""The Go1 in Pinocchio: one map from `RobotState`, and the dynamic quantities that the expert uses.

Conventions. Pinocchio's free-flyer has the quaternion as (x, y, z, w) and both base velocities in the base frame;
MuJoCo has (w, x, y, z), linear velocity in the world and angular velocity in the base. `to_pinocchio` is the only place
that knows. Everything else here is in Pinocchio's coordinates: generalized velocity (18,) = [v_b, omega_b, joints].
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from experts.planning.plane import to_complex, turn
from go1_mtl_gym import robot
from go1_mtl_gym.sensing.state import RobotState

_TRUNK = 1
"""Index of the trunk's joint, the free-flyer; joint 0 is the universe."""


@dataclass(frozen=True)
class Dynamics:
    """The robot's dynamics at one state.

    Attributes:
        v: generalized velocity in Pinocchio's coordinates, shape (18,).
        mass_matrix: M, shape (18, 18); rotor inertia included.
        bias: h = C v + g + D v, shape (18,); joint damping included, so that M vdot + h = S^T tau + J^T f.
        jacobian: J of the four feet, world-aligned, shape (12, 18).
        drift: Jdot v, classical acceleration of the feet at zero vdot, shape (4, 3) [m/s^2].
        feet_w: centres of the feet, world [m], shape (4, 3).
        feet_velocity_w: world [m/s], shape (4, 3).
        com_w: centre of mass, world [m], shape (3,).
        com_velocity_w: world [m/s], shape (3,).
        inertia_w: composite inertia about the centre of mass, world axes [kg m^2], shape (3, 3).
        mass: of the whole robot, payload included [kg].
        mean_omega_w: angular velocity of the whole robot, trunk and legs: I^-1 times its angular momentum about the
            centre of mass, world [rad/s], shape (3,).
        lean_w: rotation of the whole robot against the trunk's, I^-1 A_joints (q - q_home), world [rad], shape (3,);
            its rate is, to first order, mean_omega_w less the trunk's angular velocity (Y.-M. Chen et al., 2023, call
            such a frame an integrable whole-body orientation).
    """

    v: np.ndarray
    mass_matrix: np.ndarray
    bias: np.ndarray
    jacobian: np.ndarray
    drift: np.ndarray
    feet_w: np.ndarray
    feet_velocity_w: np.ndarray
    com_w: np.ndarray
    com_velocity_w: np.ndarray
    inertia_w: np.ndarray
    mass: float
    mean_omega_w: np.ndarray
    lean_w: np.ndarray


def to_pinocchio(state: RobotState) -> tuple[np.ndarray, np.ndarray]:
    """Configuration (19,) and generalized velocity (18,) of a state in Pinocchio's order and frames."""
    w, x, y, z = state.quat_wxyz
    q = np.concatenate([state.position_w, [x, y, z, w], state.q])
    v = np.concatenate([state.rotation.T @ state.linear_velocity_w, state.angular_velocity_b, state.v])
    return q, v


def whole_body_attitude(state: RobotState, dynamics: Dynamics) -> np.ndarray:
    """Roll, pitch, yaw [rad] of trunk and legs together, for small angles between the two, shape (3,).

    Args:
        state: the robot now.
        dynamics: at the state.
    """
    # The lean is small, so it adds to the angles about the heading's axes.
    lean = to_complex(dynamics.lean_w) * turn(-state.rpy[2])
    return state.rpy + np.array([lean.real, lean.imag, dynamics.lean_w[2]])


class RobotModel:
    """Pinocchio's model of the Go1, read from the environment's MJCF.

    A copy, deep or pickled, is read anew; Pinocchio's data is memory of C++ that holds nothing but scratch.

    Attributes:
        model: the Pinocchio model.
        mass: total mass [kg].
    """

    def __init__(self) -> None:
        self.model = pin.buildModelFromMJCF(robot.MODEL_PATH)
        self.data = self.model.createData()
        self.mass = pin.computeTotalMass(self.model)
        self._feet = [self.model.getFrameId(f"{leg}_foot", pin.FrameType.OP_FRAME) for leg in robot.LEGS]
        self._damping = np.asarray(self.model.damping)
        self._no_acceleration = np.zeros(self.model.nv)
        self._upper = np.triu_indices(self.model.nv, 1)
        self._trunk = self.model.inertias[_TRUNK].copy()
        self._payload_kg = 0.0
        self._standing_moments = _diagonal(self.standing_inertia())

    def __reduce__(self) -> tuple[type["RobotModel"], tuple[()]]:
        return type(self), ()

    def standing_inertia(self, payload_kg: float = 0.0) -> np.ndarray:
        """Composite inertia about the centre of mass in the home pose, trunk axes [kg m^2], shape (3, 3).

        Args:
            payload_kg: mass that the trunk carries, as of `RobotState`.
        """
        self._carry(payload_kg)
        q = np.concatenate([np.zeros(6), [1.0], robot.HOME_POSE])
        pin.ccrba(self.model, self.data, q, self._no_acceleration)
        return self.data.Ig.inertia.copy()

    def standing_moments(self, payload_kg: float = 0.0) -> tuple[float, float, float]:
        """Ixx, Iyy, Izz of `standing_inertia`."""
        self._carry(payload_kg)
        return self._standing_moments

    def _carry(self, payload_kg: float) -> None:
        """Let the trunk have a cube of some mass fixed at its centre of mass."""
        if payload_kg == self._payload_kg:
            return
        cube = payload_kg * robot.PAYLOAD_SIDE**2 / 6 * np.eye(3)
        trunk = self._trunk
        self.model.inertias[_TRUNK] = pin.Inertia(trunk.mass + payload_kg, trunk.lever, trunk.inertia + cube)
        self._payload_kg = payload_kg
        self._standing_moments = _diagonal(self.standing_inertia(payload_kg))

    def dynamics(self, state: RobotState) -> Dynamics:
        """Evaluate everything at one state."""
        self._carry(state.payload_kg)
        model, data = self.model, self.data
        q, v = to_pinocchio(state)
        pin.computeAllTerms(model, data, q, v)
        # Once more with vdot = 0: the feet's accelerations are then what Jdot v is.
        pin.forwardKinematics(model, data, q, v, self._no_acceleration)
        pin.updateFramePlacements(model, data)
        jacobian = np.empty((12, model.nv))
        drift = np.empty((4, 3))
        feet_w = np.empty((4, 3))
        for leg, frame in enumerate(self._feet):
            jacobian[3 * leg : 3 * leg + 3] = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[:3]
            drift[leg] = pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL_WORLD_ALIGNED).linear
            feet_w[leg] = data.oMf[frame].translation
        mass_matrix = data.M.copy()
        # Pinocchio fills the upper triangle only.
        mass_matrix.T[self._upper] = mass_matrix[self._upper]
        # Ig, hg and Ag are the centroidal inertia, momentum and momentum matrix; [3:] of Ag is its angular part.
        inertia = data.Ig.inertia.copy()
        turning = np.column_stack([data.hg.angular, data.Ag[3:, 6:] @ (state.q - robot.HOME_POSE)])
        mean_omega, lean = np.linalg.solve(inertia, turning).T
        return Dynamics(
            v=v,
            mass_matrix=mass_matrix,
            bias=data.nle + self._damping * v,
            jacobian=jacobian,
            drift=drift,
            feet_w=feet_w,
            feet_velocity_w=(jacobian @ v).reshape(4, 3),
            com_w=data.com[0].copy(),
            com_velocity_w=data.vcom[0].copy(),
            inertia_w=inertia,
            mass=robot.MASS + state.payload_kg,
            mean_omega_w=mean_omega,
            lean_w=lean,
        )


def _diagonal(inertia: np.ndarray) -> tuple[float, float, float]:
    xx, yy, zz = np.diag(inertia).tolist()
    return xx, yy, zz
