"""The robot in MuJoCo: stepping, reading and writing its state. Knows nothing of tasks, gaits or rewards."""

import copy

import mujoco
import numpy as np

from go1_mtl_gym import robot
from go1_mtl_gym.actuation import PHYSICS_HZ, PDGains
from go1_mtl_gym.rotations import matrix_from_quat
from go1_mtl_gym.sensing.sensor_faults import Reading
from go1_mtl_gym.sim import robot_file
from go1_mtl_gym.sim.physics_params import CHANGED_ARRAYS, INERTIAL_ARRAYS, ActionDelay, PhysicsParams

CONTACT_FORCE = 2.0
"""A foot counts as on the ground when it presses with more than this [N]."""
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION
_UNSTABLE = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)


class Simulation:
    """One Go1 on flat ground with PD actuators that run inside MuJoCo at 1 kHz.

    Args:
        gains: of the PD actuators.
        physics_params: what is different about the physics.
        robot_path: MJCF file of another Go1 (`go1_mtl_gym.sim.robot_file.load`), or None.

    Attributes:
        model: the MuJoCo model; private to this simulation, so it may be changed (friction, masses). Copies of an
            environment begin with the unchanged model, and `set_physics_params` overwrites what it is about.
        data: the MuJoCo data.
        physics_params: what is different about the physics now.
    """

    def __init__(
        self, gains: PDGains, physics_params: PhysicsParams | None = None, robot_path: str | None = None
    ) -> None:
        """Load the model; the robot's state is whatever the file says until `reset`."""
        if robot_path is None:
            self.model = mujoco.MjModel.from_xml_path(robot.SCENE_PATH)
        else:
            self.model = robot_file.load(robot_path)
        self.data = mujoco.MjData(self.model)
        self._scratch: mujoco.MjData | None = None
        self.model.opt.timestep = 1.0 / PHYSICS_HZ
        self.model.actuator_gainprm[:, 0] = gains.kp
        self.model.actuator_biasprm[:, 1] = -gains.kp
        self.model.actuator_biasprm[:, 2] = -gains.kd
        self._plain = {name: getattr(self.model, name).copy() for name in CHANGED_ARRAYS}
        self.set_physics_params(physics_params or PhysicsParams())
        self._sensor = {
            name: slice(start, start + size)
            for name, start, size in (
                (self.model.sensor(i).name, self.model.sensor_adr[i], self.model.sensor_dim[i])
                for i in range(self.model.nsensor)
            )
        }
        self._touch = np.array([self._sensor[f"{leg}_touch"].start for leg in robot.LEGS])
        joints = [self.model.joint(name) for name in robot.JOINTS]
        self._q_index = np.array([joint.qposadr[0] for joint in joints])
        self._v_index = np.array([joint.dofadr[0] for joint in joints])
        self._foot_geom = np.array([self.model.geom(f"{leg}_foot").id for leg in robot.LEGS])

    def reset(self, q: np.ndarray, yaw: float = 0.0) -> None:
        """Stand still at the world's origin in a joint position, the lowest foot touching the ground.

        Args:
            q: joint positions [rad], shape (12,); also the actuators' first target.
            yaw: heading [rad].
        """
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:7] = [0.0, 0.0, robot.STANDING_HEIGHT, np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)]
        self.data.qpos[self._q_index] = q
        self.data.ctrl[:] = q
        self._delay.reset(q)
        mujoco.mj_kinematics(self.model, self.data)
        self.data.qpos[2] -= (self.feet_w[:, 2] - self.model.geom_size[self._foot_geom, 0]).min()
        mujoco.mj_forward(self.model, self.data)

    def set_physics_params(self, physics_params: PhysicsParams) -> None:
        """Let something else be different about the physics, from the next step on.

        The figures are those of the model on disk, changed by `physics_params` alone. Targets on their way are
        forgotten: the actuators go on holding what they hold.
        """
        before = [getattr(self.model, name).copy() for name in INERTIAL_ARRAYS]
        for name, value in self._plain.items():
            getattr(self.model, name)[:] = value
        physics_params.apply(self.model)
        if not all(np.array_equal(getattr(self.model, name), old) for name, old in zip(INERTIAL_ARRAYS, before)):
            mujoco.mj_setConst(self.model, mujoco.MjData(self.model))
        self._delay = ActionDelay(physics_params.delay_steps)
        self._delay.reset(self.data.ctrl)
        self.physics_params = physics_params

    def step(self, target: np.ndarray, physics_steps: int) -> None:
        """Command joint targets [rad], shape (12,), for a number of 1 ms steps; the delay decides when they are held.

        Sensors, contacts and torques read afterwards belong to the state after the step: `mj_step` leaves those of
        the state before it, so the forward pass is run once more.
        """
        self._hold(target, physics_steps)
        mujoco.mj_forward(self.model, self.data)

    def step_and_read(self, target: np.ndarray, physics_steps: int, early: int) -> Reading:
        """Do what `step` does, to the bit, and read the sensors meanwhile.

        Args:
            target: of the joints [rad], shape (12,).
            physics_steps: for how long.
            early: physics steps between the reading that is returned and the end, less than `physics_steps`.
        """
        if not early:
            self.step(target, physics_steps)
            return self.read()
        self._hold(target, physics_steps - early)
        guess = self.data.qacc_warmstart.copy()  # that the solver begins with; the only state that `mj_forward` changes
        mujoco.mj_forward(self.model, self.data)
        reading = self.read()
        self.data.qacc_warmstart[:] = guess
        self.step(target, early)
        return reading

    def settle(self, target: np.ndarray, physics_steps: int) -> None:
        """Let a robot that was reset give way under its weight; its time begins afterwards.

        Args:
            target: of the joints meanwhile [rad], shape (12,).
            physics_steps: for how long; 0 changes nothing.
        """
        if physics_steps:
            self.step(target, physics_steps)
            self.data.time = 0.0

    def _hold(self, target: np.ndarray, physics_steps: int) -> None:
        self._run(self._delay.send(target, physics_steps))

    def _run(self, targets: list[tuple[np.ndarray, int]]) -> None:
        for held, steps in targets:
            self.data.ctrl[:] = held
            mujoco.mj_step(self.model, self.data, nstep=steps)

    def ahead(self) -> "Simulation":
        """The simulation at the time when a target that is commanded now will take effect.

        It shares the model with this one, which stays as it is; the next call overwrites it. Without a delay it is this
        one.
        """
        pending = self._delay.pending()
        if not pending:
            return self
        if self._scratch is None:  # to make it takes as long as the steps
            self._scratch = mujoco.MjData(self.model)
        later = copy.copy(self)
        later.data = self._scratch
        mujoco.mj_setState(self.model, later.data, self._integration_state(), _STATE)
        later._delay = ActionDelay(0)
        later._run(pending)
        mujoco.mj_forward(self.model, later.data)
        return later

    def push(self, delta_velocity_w: np.ndarray) -> None:
        """Add to the trunk's linear velocity [m/s], world frame, shape (3,), at once."""
        self.data.qvel[:3] += delta_velocity_w
        mujoco.mj_forward(self.model, self.data)

    @property
    def q(self) -> np.ndarray:
        """Joint positions [rad], shape (12,)."""
        return self.data.qpos[self._q_index]

    @property
    def v(self) -> np.ndarray:
        """Joint velocities [rad/s], shape (12,)."""
        return self.data.qvel[self._v_index]

    @property
    def torque(self) -> np.ndarray:
        """Joint torques of the actuators [N m], shape (12,)."""
        return self.data.actuator_force.copy()

    @property
    def feet_w(self) -> np.ndarray:
        """Centres of the feet in the world [m], shape (4, 3)."""
        return self.data.geom_xpos[self._foot_geom].copy()

    @property
    def contacts(self) -> np.ndarray:
        """Which feet press on the ground, bool, shape (4,)."""
        return self.data.sensordata[self._touch] > CONTACT_FORCE

    @property
    def joint_resistance(self) -> tuple[float, float]:
        """Mean dry friction [N m] and mean damping [N m s/rad] of the joints, beyond those of the model on disk."""
        friction, damping = (
            float((getattr(self.model, name)[6:] - self._plain[name][6:]).mean())
            for name in ("dof_frictionloss", "dof_damping")
        )
        return friction, damping

    @property
    def foot_sink(self) -> float:
        """How much deeper than the model's the feet of the standing robot sink into the ground [m], by estimate.

        A contact of time constant T and impedance d whose point has the inverse inertia A yields r = d (1 - d) T^2 A f
        to a force f (MuJoCo's documentation, "Solver parameters"), here a quarter of the weight.
        """
        body, d = self.model.geom_bodyid[self._foot_geom], self.model.geom_solimp[self._foot_geom, 1]
        time, own = (array[self._foot_geom, 0] for array in (self.model.geom_solref, self._plain["geom_solref"]))
        quarter = self.model.body_mass.sum() * robot.GRAVITY / 4
        yielding = d * (1.0 - d) * self.model.body_invweight0[body, 0] * quarter
        return max(float((yielding * (time**2 - own**2)).mean()), 0.0)

    @property
    def stable(self) -> bool:
        """False once the physics has diverged (a non-finite or huge position, velocity or acceleration)."""
        warned = any(self.data.warning[kind].number for kind in _UNSTABLE)
        return not warned and bool(np.isfinite(self.data.qpos).all() and np.isfinite(self.data.qvel).all())

    def read(self) -> Reading:
        """The sensors' readings, without noise and faults."""
        values = self.data.sensordata
        return Reading(
            accelerometer=values[self._sensor["accelerometer"]].copy(),
            gyroscope=values[self._sensor["gyroscope"]].copy(),
            q=self.q,
            dq=self.v,
            contacts=self.contacts,
            gravity=-matrix_from_quat(self.data.qpos[3:7])[2],
        )

    def snapshot(self) -> np.ndarray:
        """Everything needed to continue to the bit, as one vector: state, targets on their way, physics_params."""
        return np.concatenate([self._integration_state(), self._delay.waiting.ravel(), self.physics_params.as_vector()])

    def _integration_state(self) -> np.ndarray:
        state = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        mujoco.mj_getState(self.model, self.data, state, _STATE)
        return state

    def restore(self, snapshot: np.ndarray) -> None:
        """Return to a snapshot of a simulation with the same gains; its physics_params comes with it."""
        size = mujoco.mj_stateSize(self.model, _STATE)
        state, waiting, physics_params = np.split(
            snapshot, [size, len(snapshot) - len(self.physics_params.as_vector())]
        )
        if PhysicsParams.from_vector(physics_params) != self.physics_params:
            self.set_physics_params(PhysicsParams.from_vector(physics_params))
        mujoco.mj_setState(self.model, self.data, state, _STATE)
        mujoco.mj_forward(self.model, self.data)
        mujoco.mj_setState(self.model, self.data, state, _STATE)
        self._delay.waiting = waiting.reshape(-1, 12).copy()
