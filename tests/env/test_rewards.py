"""Reward terms against numbers worked by hand."""

import dataclasses

import numpy as np
import pytest

from go1_mtl_gym import robot
from go1_mtl_gym.env import Go1Env
from go1_mtl_gym.rewards import RewardWeights, reward_terms

LEVEL = np.array([0.0, 0.0, -1.0])
ONES = RewardWeights(velocity=1.0, yaw_rate=1.0, posture=1.0, effort=1.0, alive=1.0)


def terms(weights=ONES, command=(0, 0, 0), velocity=(0, 0, 0), gravity=LEVEL, height=robot.STANDING_HEIGHT, torque=0.0):
    return reward_terms(
        weights, np.array(command, float), np.array(velocity, float), gravity, height, np.full(12, float(torque))
    )


def test_perfect_tracking_without_effort():
    assert terms(command=(0.3, -0.1, 0.2), velocity=(0.3, -0.1, 0.2)) == pytest.approx(
        {"velocity": 1.0, "yaw_rate": 1.0, "posture": 0.0, "effort": 0.0, "alive": 1.0}
    )


def test_velocity_error_of_half_a_metre_per_second_is_worth_one_over_e():
    assert terms(command=(0.5, 0, 0))["velocity"] == pytest.approx(np.exp(-1))
    assert terms(command=(0.3, 0.4, 0))["velocity"] == pytest.approx(np.exp(-1))
    assert terms(command=(0.3, 0.4, 0))["yaw_rate"] == 1.0


def test_yaw_rate_error_of_one_radian_per_second():
    assert terms(velocity=(0, 0, 1))["yaw_rate"] == pytest.approx(np.exp(-4))
    assert terms(velocity=(0, 0, 1))["velocity"] == 1.0


def test_posture_counts_tilt_and_sag():
    tilted = np.array([0.6, 0.0, -0.8])
    assert terms(gravity=tilted)["posture"] == pytest.approx(-0.36)
    assert terms(height=robot.STANDING_HEIGHT - 0.1)["posture"] == pytest.approx(-1.0)
    assert terms(height=robot.STANDING_HEIGHT + 0.05, gravity=tilted)["posture"] == pytest.approx(-0.61)


def test_sag_saturates():
    assert terms(height=1.5)["posture"] == pytest.approx(-4.0)
    assert terms(height=-9.0)["posture"] == pytest.approx(-4.0)


def test_effort_is_the_mean_squared_share_of_the_limits():
    torque = np.zeros(12)
    torque[0], torque[2] = 23.7, -35.55 / 2
    got = reward_terms(ONES, np.zeros(3), np.zeros(3), LEVEL, robot.STANDING_HEIGHT, torque)["effort"]
    assert got == pytest.approx(-(1 + 0.25) / 12)


@pytest.mark.parametrize("name", [field.name for field in dataclasses.fields(RewardWeights)])
def test_each_weight_scales_its_own_term_only(name):
    state = {"command": (0.4, 0, 0.3), "gravity": np.array([0.6, 0, -0.8]), "torque": 5.0}
    plain, scaled = terms(**state), terms(weights=dataclasses.replace(ONES, **{name: 3.0}), **state)
    assert scaled.pop(name) == pytest.approx(3 * plain.pop(name))
    assert scaled == plain


def test_environment_returns_the_sum_of_terms_of_the_state_after_the_step():
    env = Go1Env("trot")
    env.reset(seed=3, options={"command": (0.5, 0.1, 0.2)})
    for _ in range(5):
        _, reward, _, _, info = env.step(np.full(12, 0.05))
        state = env.state
        again = reward_terms(
            env.task.reward,
            info["filtered_command"],
            state.base_velocity,
            state.gravity_b,
            state.position_w[2],
            env.simulation.data.actuator_force,
        )
        assert info["reward_terms"] == pytest.approx(again, abs=1e-12)
        assert reward == pytest.approx(sum(info["reward_terms"].values()), abs=1e-12)
        assert isinstance(reward, float)
