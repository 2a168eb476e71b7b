"""Demonstrations in memory and on disk."""

import dataclasses

import numpy as np
import pytest

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout
from trainers import Demonstrations


def tiny(tasks=(0, 0, 0, 1, 1, 0), starts=(1, 0, 1, 1, 0, 1), **changes) -> Demonstrations:
    """Six rows of two tasks in four episodes; obs[:, 0] and acts[:, 0] count the rows."""
    count = np.arange(len(tasks), dtype=np.float32)
    values = {
        "obs": np.column_stack([count, count**2, np.eye(2)[list(tasks)]]),
        "acts": np.column_stack([count, -count]),
        "starts": np.array(starts, dtype=bool),
        "tasks": ("trot", "bound"),
        "center": np.array([0.1, 0.2]),
        "half_range": np.array([1.0, 2.0]),
        "control_hz": 2.0,
        "meta": {"kp": 50, "seed": 1},
    }
    return Demonstrations(**(values | changes))


def test_rows_episodes_and_tasks():
    demos = tiny()
    assert len(demos) == 6 and demos.seconds == 3.0
    assert demos.task.tolist() == [0, 0, 0, 1, 1, 0]
    assert list(demos.episodes()) == [slice(0, 2), slice(2, 3), slice(3, 5), slice(5, 6)]
    assert demos.obs.dtype == demos.acts.dtype == np.float32


def test_per_task_keeps_rows_and_marks_gaps():
    parts = tiny(starts=(1, 0, 0, 0, 0, 0)).per_task()
    assert list(parts) == ["trot", "bound"]
    assert parts["trot"].obs[:, 0].tolist() == [0, 1, 2, 5]
    assert parts["trot"].starts.tolist() == [True, False, False, True]
    assert parts["bound"].starts.tolist() == [True, False]


def test_concatenate_keeps_what_is_agreed():
    both = Demonstrations.concatenate([tiny(), tiny(meta={"kp": 50, "seed": 2})])
    assert len(both) == 12 and both.starts.sum() == 8 and both.meta == {"kp": 50}
    with pytest.raises(InvalidInputError, match="differ"):
        Demonstrations.concatenate([tiny(), tiny(half_range=np.array([1.0, 2.5]))])
    with pytest.raises(InvalidInputError, match="empty"):
        Demonstrations.concatenate([])


def wide(layout: ObservationLayout, n: int = 3) -> Demonstrations:
    """Rows whose entry j is j + 1000 times the row, but for the task ids: 0, 1, 0, ..."""
    obs = np.arange(layout.size) + 1000.0 * np.arange(n)[:, None]
    obs[:, -2:] = np.eye(2)[np.arange(n) % 2]
    return tiny(obs=obs, acts=np.zeros((n, 2)), starts=np.ones(n, dtype=bool))


def test_select_what_a_smaller_layout_sees():
    have = ObservationLayout(("trot", "bound"), ("command", "phase"), history=3)
    rows = wide(have)
    seen = rows.select(have, ObservationLayout(rows.tasks, ("phase",), history=2))
    assert seen.obs[1].tolist() == [*range(1000, 1034), 1037, 1038, *range(1039, 1073), 0, 1]
    assert seen.task.tolist() == rows.task.tolist() and seen.meta == rows.meta
    np.testing.assert_array_equal(rows.select(have, have).obs, rows.obs)
    literal = rows.select(have, ObservationLayout(rows.tasks))
    np.testing.assert_array_equal(literal.obs, rows.proprioceptive().obs)
    assert literal.obs[2].tolist() == [*range(2000, 2034), 1, 0]


def test_select_from_another_layout():
    have = ObservationLayout(("trot", "bound"), ("phase",))
    for wrong in (ObservationLayout(have.tasks), ObservationLayout(("bound", "trot"), ("phase",))):
        with pytest.raises(InvalidInputError, match="layout of these rows must have 38 entries"):
            wide(have).select(wrong, wrong)
    with pytest.raises(InvalidInputError, match="got also"):
        wide(have).select(have, ObservationLayout(have.tasks, ("command",)))


@pytest.mark.parametrize("columns", [[0, 2], [4, 2, 3], [-1, 2, 3], [[2, 3]], [0.0, 2.0, 3.0], [0, 3, 2], []])
def test_impossible_columns(columns):
    assert tiny().take_columns([1, 2, 3]).obs[2].tolist() == [4, 1, 0]
    with pytest.raises(InvalidInputError, match="columns must"):
        tiny().take_columns(columns)


def test_split_holds_out_whole_episodes_of_every_task():
    demos = Demonstrations.concatenate([tiny(), tiny(), tiny()])
    train, held_out = demos.split(0.34, seed=0)
    assert len(train) + len(held_out) == len(demos)
    assert set(held_out.task) == {0, 1}
    whole = {tuple(demos.obs[rows, 0]) for rows in demos.episodes()}
    assert {tuple(held_out.obs[rows, 0]) for rows in held_out.episodes()} <= whole
    again = demos.split(0.34, seed=0)[1]
    np.testing.assert_array_equal(held_out.obs, again.obs)
    with pytest.raises(InvalidInputError, match="one episode"):
        tiny().split(0.5, seed=0)
    with pytest.raises(InvalidInputError, match="fraction"):
        demos.split(1.0, seed=0)


def test_round_trip(tmp_path):
    demos = tiny()
    demos.save(tmp_path / "a" / "shard.npz")
    other = Demonstrations.load(tmp_path / "a" / "shard.npz")
    for field in dataclasses.fields(demos):
        one, two = getattr(demos, field.name), getattr(other, field.name)
        assert np.array_equal(one, two) and getattr(one, "dtype", None) == getattr(two, "dtype", None), field.name


def test_failed_save_leaves_the_old_shard(tmp_path, monkeypatch):
    path = tmp_path / "shard.npz"
    tiny().save(path)
    before = path.read_bytes()
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError("killed")))
    with pytest.raises(OSError, match="killed"):
        tiny(meta={}).save(path)
    assert path.read_bytes() == before and [p.name for p in tmp_path.iterdir()] == ["shard.npz"]


def test_damaged_missing_and_foreign_files(tmp_path):
    path = tmp_path / "shard.npz"
    tiny().save(path)
    path.write_bytes(path.read_bytes()[:-200])
    np.savez(tmp_path / "foreign.npz", x=np.zeros(3))
    for name in ("shard.npz", "absent.npz", "foreign.npz"):
        with pytest.raises(InvalidInputError, match=name):
            Demonstrations.load(tmp_path / name)


def test_export_to_imitation():
    trajectories = tiny().to_trajectories()
    assert [len(t) for t in trajectories] == [1, 1]
    np.testing.assert_array_equal(trajectories[1].obs[:, 0], [3, 4])
    np.testing.assert_array_equal(trajectories[1].acts[:, 0], [3])


@pytest.mark.parametrize(
    "change",
    [
        {"obs": np.full((6, 4), np.nan)},
        {"acts": np.zeros((5, 2))},
        {"starts": np.zeros(6, dtype=bool)},
        {"starts": np.ones(5, dtype=bool)},
        {"half_range": np.ones(3)},
        {"obs": np.zeros((6, 2))},
    ],
)
def test_bad_data(change):
    with pytest.raises(InvalidInputError):
        tiny(**change)
