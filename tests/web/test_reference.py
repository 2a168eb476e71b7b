"""What the page's tests compare with is what Python's robot does."""

import dataclasses

import numpy as np
import pytest

import trainers
from go1_mtl_gym import InvalidInputError
from trainers.evaluation.agents import identity
from trainers.evaluation.cells import ALL_GAITS, Settings
from trainers.evaluation.certificate import Certificate
from trainers.evaluation.conditions import CONDITIONS
from web.reference import SEED, TOUR_S, drive, drives, outcomes_of, tour

CERTIFICATE = "docs/results/certificate_clocked.json"


@pytest.fixture(scope="module")
def policy():
    return trainers.load_pretrained()


def test_a_drive_is_written_down_step_by_step(policy):
    script = trainers.Script(((0.0, "trot"), (0.1, "walk", (0.2, 0.0, 0.1))), 0.3)
    driven = drive(policy, script)
    assert len(driven["states"]) == len(driven["observations"]) == len(driven["actions"]) == 15
    assert [move[0] for move in driven["moves"]] == [0, 5]
    np.testing.assert_array_equal(driven["states"][0]["qpos"][7:], driven["start"])
    for obs, action in zip(driven["observations"], driven["actions"], strict=True):
        np.testing.assert_array_equal(policy.predict(obs, deterministic=True)[0], action)


def test_there_is_a_drive_per_gait_and_one_through_all(policy):
    named = dict(drives(policy.tasks))
    assert tuple(named)[:-1] == policy.tasks
    assert named["all gaits"].task_names == policy.tasks


def test_hands_of_a_tour_are_a_certificates(policy):
    settings = Settings(0.99, 0.95, 1, None, TOUR_S, 1, TOUR_S, SEED, False, policy.tasks, {})
    setup = dataclasses.replace(settings.setup(CONDITIONS["tour"], ALL_GAITS, 0), seconds=1.0)
    driven, known = tour(policy, setup), tour(policy, setup, "f")
    assert (driven["fallen"], known["fallen"], known["qpos"]) == (False, True, None)
    assert driven["segments"] == known["segments"]
    np.testing.assert_array_equal(driven["start"], known["start"])


def test_verdicts_come_from_the_same_policys_certificate_alone(tmp_path):
    certificate = dataclasses.replace(Certificate.read(CERTIFICATE), policy=identity("clocked"))
    assert outcomes_of(certificate, "clocked")
    with pytest.raises(InvalidInputError, match="the certificate is of"):
        outcomes_of(certificate, "phase_free")
