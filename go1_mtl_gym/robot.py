"""The Unitree Go1 as numbers: orders, names, limits and the standing pose.

Every array over joints follows `JOINTS` (leg by leg in the order of `LEGS`; hip, thigh, calf in each leg), every
array over legs follows `LEGS`. Sources of the figures are named in ``assets/NOTICE.md``.
"""

from importlib.resources import files

import numpy as np

LEGS = ("FL", "FR", "RL", "RR")
JOINTS = tuple(f"{leg}_{part}_joint" for leg in LEGS for part in ("hip", "thigh", "calf"))

MODEL_PATH = str(files("go1_mtl_gym") / "assets" / "go1.xml")
"""The robot alone; the file that MuJoCo and Pinocchio both read."""
SCENE_PATH = str(files("go1_mtl_gym") / "assets" / "scene.xml")
"""The robot on a floor, with lights and cameras."""


def _every_leg(hip: float, thigh: float, calf: float) -> np.ndarray:
    values = np.tile([hip, thigh, calf], len(LEGS)).astype(np.float64)
    values.flags.writeable = False
    return values


MASS = 12.743448
"""Total mass [kg]."""
GRAVITY = 9.81
"""[m/s^2]"""
PAYLOAD_SIDE = 0.1
"""Side of the cube that a payload is [m]; its centre is the trunk's centre of mass."""
JOINT_LOWER = _every_leg(-0.863, -0.686, -2.818)
JOINT_UPPER = _every_leg(0.863, 4.501, -0.888)
"""Joint range [rad], shape (12,)."""
TORQUE_LIMIT = _every_leg(23.7, 23.7, 35.55)
"""Largest joint torque [N m], shape (12,)."""
SPEED_LIMIT = _every_leg(30.1, 30.1, 20.06)
"""Largest joint speed [rad/s], shape (12,)."""
HOME_POSE = _every_leg(0.0, 0.9, -1.8)
"""Joint positions of the standing robot [rad], shape (12,)."""
STANDING_HEIGHT = 0.288
"""Height of the trunk's origin when the robot stands in `HOME_POSE` [m]."""
FOOT_RADIUS = 0.023
"""[m]"""
THIGH_LENGTH = CALF_LENGTH = 0.213
"""[m]"""
HIP_TO_THIGH = 0.08
"""Sideways distance from a hip (abduction) axis to the thigh's plane [m]."""
HIP_POSITION_B = np.array([[0.1881, 0.04675, 0], [0.1881, -0.04675, 0], [-0.1881, 0.04675, 0], [-0.1881, -0.04675, 0]])
HIP_POSITION_B.flags.writeable = False
"""Hip axes in the trunk frame [m], shape (4, 3)."""
LEG_SIDE = np.array([1.0, -1.0, 1.0, -1.0])
LEG_SIDE.flags.writeable = False
"""+1 for left legs, -1 for right legs, shape (4,)."""
IMU_POSITION_B = np.array([-0.01592, -0.06659, -0.00617])
IMU_POSITION_B.flags.writeable = False
"""Inertial unit in the trunk frame [m], shape (3,); its axes are the trunk's."""
NOMINAL_FOOT_B = HIP_POSITION_B + np.outer(LEG_SIDE, [0.0, HIP_TO_THIGH, 0.0])
NOMINAL_FOOT_B.flags.writeable = False
"""Points of the trunk frame under which the feet stand [m], shape (4, 3)."""
