"""The layout of the flat observation: slices, order, bounds, one-hot, history and clipping."""

import copy
import itertools
import pickle

import numpy as np
import pytest

from go1_mtl_gym import robot
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import CHANNELS, PROPRIOCEPTION, ObservationLayout, SensorNoise

TASKS = ("trot", "bound", "jump", "walk")
ALL = tuple(CHANNELS)


def parts(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Random values within the bounds for every part."""
    layout = ObservationLayout(TASKS, ALL)
    sizes = PROPRIOCEPTION | CHANNELS
    return {
        name: rng.uniform(0, 1, size) * layout.high[layout.slices[name]].clip(max=1) for name, size in sizes.items()
    }


def test_default_is_the_papers_34_numbers_and_the_task():
    layout = ObservationLayout(TASKS)
    assert layout.size == 34 + 4
    assert {name: (where.start, where.stop) for name, where in layout.slices.items()} == {
        "accelerometer": (0, 3), "gyroscope": (3, 6), "q": (6, 18), "dq": (18, 30), "contacts": (30, 34),
        "task": (34, 38),
    }  # fmt: skip


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda layout: pickle.loads(pickle.dumps(layout))])
def test_copies_are_equal(duplicate):
    layout = ObservationLayout(TASKS, ("phase", "command"), 3)
    other = duplicate(layout)
    assert (other.tasks, other.channels, other.history) == (layout.tasks, layout.channels, layout.history)
    assert other.slices == layout.slices and np.array_equal(other.high, layout.high)


@pytest.mark.parametrize("count", range(5))
def test_slices_tile_the_observation_for_every_choice_of_channels(count):
    for channels in itertools.combinations(ALL, count):
        for history, tasks in itertools.product((1, 2, 5), (TASKS, TASKS[:1])):
            layout = ObservationLayout(tasks, channels, history)
            edges = [0] + [where.stop for where in layout.slices.values()]
            assert [where.start for where in layout.slices.values()] == edges[:-1]
            expected = 34 * history + sum(CHANNELS[name] for name in channels) + len(tasks)
            assert layout.size == edges[-1] == expected == len(layout.low) == len(layout.high)
            assert list(layout.slices)[-1] == "task"


def test_order_in_which_channels_are_named_does_not_matter():
    for order in itertools.permutations(ALL):
        assert dict(ObservationLayout(TASKS, order).slices) == dict(ObservationLayout(TASKS, ALL).slices)


def test_every_part_lands_in_its_slice():
    rng = np.random.default_rng(0)
    layout, values = ObservationLayout(TASKS, ALL, history=3), parts(rng)
    older = [rng.uniform(0, 1, 34), rng.uniform(0, 1, 34)]
    flat = layout.flatten(values, older, task=2)
    assert flat.dtype == np.float32 and flat.shape == (layout.size,)
    for name, value in values.items():
        np.testing.assert_array_equal(flat[layout.slices[name]], value.astype(np.float32))
    np.testing.assert_array_equal(flat[layout.slices["history"]], np.concatenate(older).astype(np.float32))
    assert flat[layout.slices["task"]].tolist() == [0, 0, 1, 0]


def test_parts_that_were_not_asked_for_are_left_out():
    values = parts(np.random.default_rng(1))
    flat = ObservationLayout(TASKS, ("phase",)).flatten(values, [], task=0)
    np.testing.assert_array_equal(flat[34:36], values["phase"].astype(np.float32))
    assert len(flat) == 34 + 2 + 4


@pytest.mark.parametrize(
    ("channels", "history"), [((), 1), (("phase",), 2), (("last_action", "command"), 3), (ALL, 1), (ALL, 4)]
)
def test_columns_see_the_same_state_in_a_smaller_layout(channels, history):
    rng = np.random.default_rng(5)
    values, older = parts(rng), list(rng.uniform(0, 1, (3, 34)))
    large, small = ObservationLayout(TASKS, ALL, history=4), ObservationLayout(TASKS, channels, history)
    columns = large.columns(small)
    assert columns.shape == (small.size,) and columns.dtype.kind == "i"
    seen = large.flatten(values, older, task=3)[columns]
    np.testing.assert_array_equal(seen, small.flatten(values, older[: history - 1], task=3))


def test_columns_by_hand():
    have, want = ObservationLayout(TASKS, ("command", "phase"), 2), ObservationLayout(TASKS, ("phase",))
    assert have.columns(want).tolist() == [*range(34), 37, 38, *range(73, 77)]
    assert have.columns(have).tolist() == list(range(77))


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (ObservationLayout(TASKS, ("phase", "gravity"), 2), "'phase',.*got also .'gravity'"),
        (ObservationLayout(TASKS, (), 3), "history must be at most 2, got 3"),
        (ObservationLayout(TASKS[::-1]), "tasks.*'trot'.*has.*'walk'"),
    ],
)
def test_columns_of_what_is_not_there(other, words):
    with pytest.raises(InvalidInputError, match=words):
        ObservationLayout(TASKS, ("phase",), 2).columns(other)


def test_values_saturate_at_the_documented_bounds():
    layout = ObservationLayout(TASKS, ALL, history=2)
    huge = {name: np.full_like(value, 1e6) for name, value in parts(np.random.default_rng(2)).items()}
    flat = layout.flatten(huge, [np.full(34, -1e6)], task=0)
    assert (flat[: layout.slices["history"].start] == layout.high[: layout.slices["history"].start]).all()
    assert (flat[layout.slices["history"]] == layout.low[layout.slices["history"]]).all()
    assert flat[layout.slices["accelerometer"]].tolist() == [160.0] * 3
    assert flat[layout.slices["gyroscope"]].tolist() == [35.0] * 3
    np.testing.assert_allclose(flat[layout.slices["dq"]], 3 * robot.SPEED_LIMIT, rtol=1e-6)


def test_bounds_are_finite_ordered_and_zero_to_one_for_flags():
    layout = ObservationLayout(TASKS, ALL, history=3)
    assert np.isfinite(layout.low).all() and (layout.low < layout.high).all()
    for name in ("contacts", "task"):
        assert set(layout.low[layout.slices[name]]) == {0.0} and set(layout.high[layout.slices[name]]) == {1.0}
    history = layout.slices["history"]
    np.testing.assert_array_equal(layout.low[history], np.tile(layout.low[:34], 2))
    joints = layout.slices["q"]
    assert (layout.low[joints] < robot.JOINT_LOWER).all() and (layout.high[joints] > robot.JOINT_UPPER).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"channels": ("comand",)}, "channel must be one of 'command', .*; got 'comand'"),
        ({"channels": "command"}, "sequence of names.*got 'command'"),
        ({"channels": ("phase", "phase")}, "differ"),
        ({"history": 0}, "history.*1 to 50.*got 0"),
        ({"history": 51}, "history.*51"),
        ({"history": 2.5}, "history.*2.5"),
    ],
)
def test_impossible_layouts_are_refused(arguments, words):
    with pytest.raises(InvalidInputError, match=words):
        ObservationLayout(TASKS, **arguments)


@pytest.mark.parametrize("name", ["accelerometer", "gyroscope", "q", "dq", "gravity"])
@pytest.mark.parametrize("sigma", [-0.1, 11.0, float("nan"), "loud"])
def test_impossible_noise_is_refused(name, sigma):
    with pytest.raises(InvalidInputError, match=f"sensor noise of {name}.*got"):
        SensorNoise(**{name: sigma})


def test_noise_touches_only_sensors_and_depends_on_the_generator_alone():
    clean = parts(np.random.default_rng(3))
    noisy = [dict(clean) for _ in range(2)]
    for one in noisy:
        SensorNoise().apply(one, np.random.default_rng(4))
    for name in clean:
        np.testing.assert_array_equal(noisy[0][name], noisy[1][name])
        touched = name in ("accelerometer", "gyroscope", "q", "dq", "gravity")
        assert (noisy[0][name] != clean[name]).all() if touched else noisy[0][name] is clean[name]
