"""Figures of merit against numbers worked by hand."""

import json
import math

import numpy as np
import pytest

from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.test_dataset import tiny
from trainers import offline_metrics
from trainers.evaluation.metrics import (
    exact_interval,
    lower_bound,
    mcnemar,
    regression_metrics,
    touchdowns,
    tracking_error,
)
from trainers.utils.files import json_ready


def test_regression_by_hand():
    target = np.array([[0.0, 10.0], [2.0, 10.2], [4.0, 10.4]])
    predicted = target + np.array([[0.3, 0.0], [0.0, 0.0], [0.0, 0.2]])
    scores = regression_metrics(predicted, target)
    assert scores["mse"] == pytest.approx((0.09 + 0.04) / 6)
    assert scores["mae"] == pytest.approx(0.5 / 6)
    assert scores["r2"] == pytest.approx(1 - 0.13 / 8.08)
    assert scores["r2_joint_mean"] == pytest.approx(1 - (0.09 / 8 + 0.04 / 0.08) / 2)


def test_predicting_each_joints_mean_explains_nothing():
    target = np.random.default_rng(0).normal(size=(100, 3)) + [0, 0.9, -1.8]
    scores = regression_metrics(np.broadcast_to(target.mean(0), target.shape), target)
    assert scores["r2"] == pytest.approx(0, abs=1e-9) and scores["r2_joint_mean"] == pytest.approx(0, abs=1e-9)


def test_joint_that_never_moves_is_left_out():
    target = np.column_stack([np.arange(4.0), np.ones(4)])
    assert regression_metrics(target + [0, 0.1], target)["r2_joint_mean"] == 1.0
    assert math.isnan(regression_metrics(np.ones((3, 2)), np.ones((3, 2)))["r2"])


def test_offline_metrics_are_in_radians_per_task():
    class Zero:
        def predict(self, obs, deterministic):
            assert deterministic
            return np.zeros((len(obs), 2)), None

    scores = offline_metrics(Zero(), tiny())
    assert list(scores) == ["trot", "bound"]
    assert scores["bound"]["mse"] == pytest.approx((3**2 + 6**2 + 4**2 + 8**2) / 4)
    assert offline_metrics(Zero(), tiny(), half_range=np.array([1.0, 1.0]))["bound"]["mae"] == pytest.approx(3.5)


def test_tracking_error_averages_the_stride_out():
    n, window = 200, 20
    oscillation = 0.4 * np.sin(2 * np.pi * np.arange(n) / window)
    wanted = np.tile([0.5, 0.0, 0.2], (n, 1))
    measured = wanted + np.column_stack([0.03 + oscillation, np.full(n, 0.04), np.full(n, -0.1)])
    measured[:50] += 9.0
    error, yaw = tracking_error(measured, wanted, window, skip=50)
    assert error == pytest.approx(0.05) and yaw == pytest.approx(0.1)
    assert tracking_error(measured, wanted, window, skip=49)[0] > 0.05
    assert all(math.isnan(value) for value in tracking_error(measured[:60], wanted[:60], window, 50))


def test_tracking_error_is_the_mean_of_norms_not_the_norm_of_means():
    measured = np.zeros((4, 3))
    measured[:, 0] = [1, 1, -1, -1]
    assert tracking_error(measured, np.zeros((4, 3)), 1, 0)[0] == 1.0
    assert tracking_error(measured, np.zeros((4, 3)), 2, 0)[0] == pytest.approx(2 / 3)


def test_touchdowns_ignore_bounces_and_the_start():
    leg = [1, 0, 0, 1, 0, 1, 0, 0, 0, 1, 1]
    contacts = np.column_stack([leg, np.ones(11), np.zeros(11), np.roll(leg, 0)])
    assert touchdowns(contacts, min_air=2, skip=0).tolist() == [2, 0, 0, 2]
    assert touchdowns(contacts, min_air=1, skip=0).tolist() == [3, 0, 0, 3]
    assert touchdowns(contacts, min_air=2, skip=4).tolist() == [1, 0, 0, 1]


def test_the_exact_interval_by_hand():
    # all of n: P(n of n) = p^n is 2.5 % at the lower bound; none: the mirror image
    assert exact_interval(20, 20) == pytest.approx((0.025 ** (1 / 20), 1.0))
    assert exact_interval(0, 20) == pytest.approx((0.0, 1 - 0.025 ** (1 / 20)))
    # one of two: P(1 or 2) = 1 - (1 - p)^2 is 2.5 % at the lower bound
    assert exact_interval(1, 2) == pytest.approx((1 - math.sqrt(0.975), math.sqrt(0.975)))
    assert lower_bound(1, 2) == pytest.approx(1 - math.sqrt(0.95)) and lower_bound(0, 3) == 0.0
    with pytest.raises(InvalidInputError):
        exact_interval(3, 2)


@pytest.mark.parametrize(("trials", "failures"), [(299, 0), (473, 1)])
def test_ninety_nine_percent_take_that_many_episodes(trials, failures):
    assert lower_bound(trials - failures, trials) >= 0.99 > lower_bound(trials - failures - 1, trials - 1)


def test_mcnemars_test_by_hand():
    assert mcnemar(0, 0) == mcnemar(3, 3) == 1.0
    assert mcnemar(0, 5) == mcnemar(5, 0) == pytest.approx(2 / 32)  # five coins on one side
    assert mcnemar(1, 4) == pytest.approx(12 / 32)


def test_json_ready():
    value = {"a": np.float32(1.5), "b": (np.int64(2), math.nan), "c": np.array([True, False]), "d": np.inf}
    assert json.dumps(json_ready(value), allow_nan=False) == '{"a": 1.5, "b": [2, null], "c": [true, false], "d": null}'
