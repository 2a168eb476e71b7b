"""The robot in a mirror."""

import dataclasses

import numpy as np
import pytest

import trainers
from go1_mtl_gym import NAMED_GAITS, TASKS, Gait, InvalidInputError
from go1_mtl_gym.gait_space import mirrored as mirrored_gait
from go1_mtl_gym.gaits import gait_of
from go1_mtl_gym.kinematics import leg_kinematics
from go1_mtl_gym.sensing.gait_numbers import gait_numbers
from trainers.data.mirror import _mirrored_gait, mirror_shift, mirrored, with_mirrored
from trainers.data.operator import OperatorConfig

CHANNELS = ("command", "gravity", "phase", "last_action", "leg_kinematics")


@pytest.fixture(scope="module")
def rows():
    perturbation = trainers.PerturbationConfig(operator=OperatorConfig(task_interval=(0.8, 1.2)))
    return trainers.collect("trot", seed=1, seconds=12.0, perturbation=perturbation, env_kwargs={"channels": CHANNELS})


@pytest.mark.parametrize(
    ("name", "shift"), [("trot", 0.5), ("bound", 0.0), ("jump", 0.0), ("walk", 0.5), ("pace", 0.5), ("gallop", None)]
)
def test_how_far_the_clock_is_ahead_in_the_mirror(name, shift):
    assert mirror_shift(TASKS[name].gait) == shift


def test_the_mirrored_contact_plan_is_the_plan_at_the_shifted_clock():
    gait = Gait("amble", 0.5, 0.7, (0.25, 0.75, 0.0, 0.5))
    phase = np.linspace(0.013, 0.987, 60)
    assert (gait.stance(phase)[:, [1, 0, 3, 2]] == gait.stance(phase + mirror_shift(gait))).all()


def test_twice_in_the_mirror_is_the_row_itself(rows):
    gallop = rows.tasks.index("gallop")
    kept = rows.take(rows.task != gallop)
    again = mirrored(mirrored(rows))
    assert again.obs == pytest.approx(kept.obs, abs=1e-6) and again.acts == pytest.approx(kept.acts, abs=1e-6)
    assert len(kept) < len(rows)


def test_leg_kinematics_of_mirrored_joints_are_the_mirrored_ones(rows):
    image, where = mirrored(rows), rows.contract.slices
    for obs in image.obs[::40]:
        anew = leg_kinematics(*(obs[where[name]].astype(float) for name in ("q", "dq", "gyroscope")))
        assert obs[where["leg_kinematics"]] == pytest.approx(anew, abs=1e-4)


def test_a_mirrored_command_goes_to_the_other_side(rows):
    image, where = mirrored(rows), rows.contract.slices["command"]
    kept = rows.take(rows.task != rows.tasks.index("gallop"))
    assert image.obs[:, where] == pytest.approx(kept.obs[:, where] * [1, -1, -1])


def test_the_clock_rests_at_phase_0_in_the_mirror_too():
    calm = trainers.collect("trot", (0.0, 0.0, 0.0), seconds=0.5)
    where = calm.contract.slices["phase"]
    assert (mirrored(calm).obs[:, where] == [0.0, 1.0]).all()
    going = trainers.collect("trot", (0.5, 0.0, 0.0), seconds=1.0)
    assert mirrored(going).obs[30:, where] == pytest.approx(-going.obs[30:, where], abs=1e-6)


def test_the_expert_answers_the_mirrored_state_with_the_mirrored_action():
    """Robot and expert are the same in the mirror but for millimeters, so an image is as good a row as any."""
    left = trainers.collect("trot", (0.4, 0.2, 0.3), seed=3, seconds=2.0)
    right = trainers.collect("trot", (0.4, -0.2, -0.3), seed=3, seconds=2.0)
    image = mirrored(left)
    # both walk steadily: compare the mean action at equal phases over the last cycles
    period = round(TASKS["trot"].gait.period * 50)
    half = period // 2
    mean = right.acts[60:].reshape(-1, period, 12).mean(0)
    seen = image.acts[60 - half : 100 - half].reshape(-1, period, 12).mean(0)
    spread = mean.std(0).mean()
    assert np.abs(seen - mean).mean() < 0.35 * spread


def test_rows_and_images_keep_their_weights(rows):
    weights = np.arange(1, len(rows) + 1)
    both, together = with_mirrored(rows, weights)
    has_image = rows.task != rows.tasks.index("gallop")
    assert len(both) == len(rows) + has_image.sum()
    assert (together == np.concatenate([weights, weights[has_image]])).all()


def test_older_frames_are_mirrored_like_the_newest():
    rows = trainers.collect("trot", seconds=0.6, env_kwargs={"history": 3})
    image, where = mirrored(rows), rows.contract.slices["history"]
    assert image.obs[1:, where][:, :34] == pytest.approx(image.obs[:-1, :34])
    assert image.obs[2:, where][:, 34:] == pytest.approx(image.obs[:-2, :34])


def test_rows_of_an_unknown_gait_have_no_image(rows):
    unknown = dataclasses.replace(rows.contract, gaits=(None,) * len(rows.tasks))
    with pytest.raises(InvalidInputError, match="whose gaits the contract names"):
        mirrored(dataclasses.replace(rows, contract=unknown))


def test_only_the_gaits_of_the_rows_need_be_known():
    rows = trainers.collect("pace", seconds=0.4, env_kwargs={"tasks": ("pace",)})
    among_others = rows.with_tasks(("hop", "pace"))
    np.testing.assert_array_equal(mirrored(among_others).obs[:, :-2], mirrored(rows).obs[:, :-1])


def test_cloning_learns_from_images_too(rows):
    env = trainers.make_env("trot", channels=CHANNELS)
    policies = []
    for mirror in (False, True):
        policy = trainers.MultiHeadPolicy(
            env.observation_space, env.action_space, contract=rows.contract, width=32, seed=0
        )
        trainers.train_bc(policy, rows, trainers.BCConfig(steps=150, batch_size=128, mirror=mirror))
        policies.append(policy)
    env.close()
    image = mirrored(rows)
    errors = [np.abs(policy.predict(image.obs, deterministic=True)[0] - image.acts).mean() for policy in policies]
    assert errors[1] < 0.8 * errors[0]


def test_rows_of_any_gait_are_those_of_the_mirrored_gait():
    rows = trainers.collect("any_gait", seed=5, seconds=1.0)
    image, where = mirrored(rows), rows.contract.slices["gait"]
    assert len(image) == len(rows)
    assert mirrored(image).obs == pytest.approx(rows.obs, abs=1e-6)
    env = trainers.make_env("any_gait")
    _, info = env.reset(seed=5)
    gait = mirrored_gait(gait_of(info["gait"], "any"))
    for phase in (0.0, 0.3):
        left, right = (gait_numbers(each, phase, False, 0.02) for each in (gait_of(info["gait"], "any"), gait))
        found = _mirrored_gait(left[None])[0]
        assert found == pytest.approx(right)
    figures = image.obs[:, where][:, 24:]
    assert figures == pytest.approx(rows.obs[:, where][:, 24:])


def test_a_limp_is_another_gait_in_the_mirror():
    assert mirror_shift(NAMED_GAITS["limp"]) is None
    assert mirror_shift(dataclasses.replace(NAMED_GAITS["limp"], duty_offsets=(0.1, 0.1, 0.0, 0.0))) == 0.5
