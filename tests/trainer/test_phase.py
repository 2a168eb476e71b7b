"""The phase estimator: what it answers, what it learns, how its errors are counted."""

import dataclasses

import numpy as np
import pytest
import torch

from go1_mtl_gym import Go1Env
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout
from trainers import Demonstrations, PhaseConfig, PhaseEstimator, phase_errors, train_phase
from trainers.policies.phase_estimator import CLIP_SD, unit

TASKS = ("trot", "walk")
SEEN = ObservationLayout(TASKS, ("command",))
WHOLE = ObservationLayout(TASKS, ("command", "phase"), 2)
CONTRACT = Go1Env("trot", tasks=TASKS, channels=WHOLE.channels, history=WHOLE.history).contract
QUICK = PhaseConfig(steps=300, batch_size=256)


def rows(phase: np.ndarray, task: np.ndarray, seed: int = 0) -> Demonstrations:
    """Rows of `WHOLE` whose first two joints are functions of the phase [cycles], in the walk the other way round."""
    obs = np.zeros((len(phase), WHOLE.size))
    obs[:, WHOLE.slices["command"]] = np.random.default_rng(seed).normal(size=(len(phase), 3))
    sign = np.where(task == 0, 1.0, -1.0)
    q = WHOLE.slices["q"].start
    obs[:, q] = 0.3 + 0.2 * np.sin(2 * np.pi * phase)
    obs[:, q + 1] = sign * 0.2 * np.cos(2 * np.pi * phase)
    obs[:, WHOLE.slices["phase"]] = np.stack([np.sin(2 * np.pi * phase), np.cos(2 * np.pi * phase)], axis=1)
    obs[:, WHOLE.slices["task"]] = np.eye(2)[task]
    starts = np.arange(len(phase)) == 0
    return Demonstrations(obs, np.zeros((len(phase), 12)), starts, CONTRACT)


def drawn(count: int = 2000, seed: int = 0) -> Demonstrations:
    rng = np.random.default_rng(seed)
    return rows(rng.uniform(size=count), rng.integers(2, size=count), seed)


class Off(PhaseEstimator):
    """Answers the true phase plus `off` cycles, where the joints of `rows` show it in a trot."""

    off = 0.0

    def estimate(self, obs: np.ndarray) -> np.ndarray:
        q = self.layout.slices["q"].start
        turns = np.arctan2(obs[:, q] - 0.3, obs[:, q + 1]) / (2 * np.pi) + self.off
        return np.stack([np.sin(2 * np.pi * turns), np.cos(2 * np.pi * turns)], axis=1)


def test_unit_vectors_by_hand():
    vectors = unit(np.array([[3.0, 4.0], [0.0, -0.5], [0.0, 0.0], [1e-30, 0.0]]))
    np.testing.assert_allclose(vectors, [[0.6, 0.8], [0, -1], [0, 1], [1, 0]], atol=1e-7)
    assert vectors.dtype == np.float32


def test_answers_are_unit_vectors_and_far_outliers_are_clipped():
    estimator = PhaseEstimator(SEEN, width=16)
    obs = np.random.default_rng(0).normal(size=(50, SEEN.size)).astype(np.float32)
    answers = estimator.estimate(obs)
    assert answers.shape == (50, 2) and answers.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(answers, axis=1), 1.0, atol=1e-6)
    edge, beyond = (np.full((1, SEEN.size), factor * CLIP_SD, dtype=np.float32) for factor in (1, 100))
    np.testing.assert_array_equal(estimator.estimate(edge), estimator.estimate(beyond))


def test_weights_depend_on_the_seed_alone():
    before = torch.random.get_rng_state()
    one, same, other = (PhaseEstimator(SEEN, width=8, seed=seed).network[0].weight for seed in (1, 1, 2))
    assert torch.equal(one, same) and not torch.equal(one, other)
    assert torch.equal(torch.random.get_rng_state(), before)


def test_it_learns_the_phase_of_each_task():
    estimator = PhaseEstimator(SEEN, width=32)
    held_out = drawn(seed=1)
    train_phase(estimator, drawn(), QUICK)
    errors = phase_errors(estimator, held_out)
    assert list(errors) == list(TASKS)
    assert all(own["median"] < 0.02 and own["p99"] < 0.1 for own in errors.values()), errors
    q = SEEN.slices["q"].start
    assert estimator.normalizer.shift[q].item() == pytest.approx(0.3, abs=0.02)
    assert estimator.normalizer.scale[q].item() == pytest.approx(0.2 / np.sqrt(2), abs=0.01)


def test_training_is_a_function_of_its_arguments():
    def weights(seed: int) -> torch.Tensor:
        estimator = PhaseEstimator(SEEN, width=8)
        train_phase(estimator, drawn(100), PhaseConfig(steps=5, seed=seed))
        return estimator.network[0].weight

    before = torch.random.get_rng_state()
    assert torch.equal(weights(0), weights(0)) and not torch.equal(weights(0), weights(1))
    assert torch.equal(torch.random.get_rng_state(), before)


@pytest.mark.parametrize(("off", "error"), [(0.0, 0.0), (0.1, 0.1), (-0.1, 0.1), (0.9, 0.1), (0.5, 0.5)])
def test_errors_are_counted_the_short_way_round(off, error):
    estimator = Off(SEEN, width=8)
    estimator.off = off
    phase = np.array([0.0, 0.05, 0.3, 0.97])
    errors = phase_errors(estimator, rows(phase, np.zeros(4, dtype=int)))
    assert list(errors) == ["trot"], "there are no rows of the walk"
    assert errors["trot"]["median"] == pytest.approx(error, abs=1e-6)
    assert errors["trot"]["p99"] == pytest.approx(error, abs=1e-6)


def test_median_and_p99_by_hand():
    phase = np.arange(101) / 1000  # errors 0, .001 ... .1 against an answer that stands still
    estimator = Off(SEEN, width=8)
    estimator.estimate = lambda obs: np.tile([0.0, 1.0], (len(obs), 1))
    errors = phase_errors(estimator, rows(phase, np.zeros(101, dtype=int)))
    assert errors["trot"] == {"median": pytest.approx(0.05, abs=1e-6), "p99": pytest.approx(0.099, abs=1e-6)}


def test_a_layout_with_the_phase_is_refused():
    with pytest.raises(InvalidInputError, match="without the phase"):
        PhaseEstimator(WHOLE)


@pytest.mark.parametrize("width", [0, -1, 2.5, "8"])
def test_bad_width(width):
    with pytest.raises(InvalidInputError, match="width"):
        PhaseEstimator(SEEN, width)


@pytest.mark.parametrize("figure", ["steps", "batch_size", "learning_rate", "weight_decay"])
def test_bad_config(figure):
    with pytest.raises(InvalidInputError, match=f"{figure}=-1"):
        PhaseConfig(**{figure: -1})


def test_rows_that_do_not_fit_are_refused():
    estimator, known = PhaseEstimator(SEEN, width=8), drawn(10)
    others = dataclasses.replace(known, contract=known.contract.with_tasks(("trot", "pace")))
    for rows_that_do_not, message in (
        (known.select(("command",), 2), "rows with the phase"),
        (known.take(np.zeros(10, dtype=bool)), "got 0"),
        (known.select(("phase",)), "got also.*command"),
        (others, "tasks"),
    ):
        for use in (train_phase, phase_errors):
            with pytest.raises(InvalidInputError, match=message):
                use(estimator, rows_that_do_not)
