"""What is drawn of a session: the robot and what is said about it, in the window and in films alike."""

import mujoco
import numpy as np

from go1_mtl_gym import robot
from go1_mtl_gym.rendering import annotate
from trainers.play.session import Session

GHOST_COLOR = (0.55, 0.75, 1.0, 0.35)


class Ghost:
    """The pose that the expert asks for, as a second robot through which one sees the first.

    Args:
        session: whose expert is asked.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        model = session.go1.simulation.model
        self._data = mujoco.MjData(model)
        self._joints = [model.joint(name).qposadr[0] for name in robot.JOINTS]
        trunk = model.body("trunk").id
        self._alike = {trunk, *np.flatnonzero(model.body_parentid == trunk)}  # with the hips, which hardly turn
        self._option = mujoco.MjvOption()

    def add_to(self, scene: mujoco.MjvScene) -> None:
        """Add it to a scene, with the trunk where the robot's is."""
        simulation = self._session.go1.simulation
        model, before = simulation.model, scene.ngeom
        self._data.qpos[:] = simulation.data.qpos
        self._data.qpos[self._joints] = self._session.expert_target
        mujoco.mj_kinematics(model, self._data)
        mujoco.mj_comPos(model, self._data)
        dynamic = mujoco.mjtCatBit.mjCAT_DYNAMIC
        mujoco.mjv_addGeoms(model, self._data, self._option, mujoco.MjvPerturb(), dynamic, scene)
        for geom in scene.geoms[before : scene.ngeom]:
            alike = model.geom_bodyid[geom.objid] in self._alike  # would flicker in the robot's own surface
            geom.rgba[:] = np.zeros(4) if alike else np.array(GHOST_COLOR)
            geom.matid = -1


def furnish(scene: mujoco.MjvScene, session: Session, ghost: Ghost | None) -> None:
    """Add arrows and discs to a scene of the robot, and the ghost if there is one."""
    annotate(scene, session.go1.simulation, session.go1.state)
    if ghost is not None:
        ghost.add_to(scene)
