"""Demonstrations in memory and on disk."""

import dataclasses

import numpy as np
import pytest

from go1_mtl_gym import GAITS, PolicyContract
from go1_mtl_gym.contract import ObservationTerm, terms_of
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import ObservationLayout
from trainers import Demonstrations

CONTRACT = PolicyContract(
    tasks=("trot", "bound"),
    gaits=(),
    terms=(ObservationTerm("count", 1), ObservationTerm("square", 1)),
    control_hz=2.0,
    kp=50.0,
    kd=2.0,
    default_q=(0.1, 0.2),
    action_scale=(1.0, 2.0),
    joints=("hip", "knee"),
)


def tiny(tasks=(0, 0, 0, 1, 1, 0), starts=(1, 0, 1, 1, 0, 1), **changes) -> Demonstrations:
    """Six rows of two tasks in four episodes; obs[:, 0] and acts[:, 0] count the rows."""
    count = np.arange(len(tasks), dtype=np.float32)
    values = {
        "obs": np.column_stack([count, count**2, np.eye(2)[list(tasks)]]),
        "acts": np.column_stack([count, -count]),
        "starts": np.array(starts, dtype=bool),
        "contract": CONTRACT,
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
    other = dataclasses.replace(CONTRACT, action_scale=(1.0, 2.5))
    with pytest.raises(InvalidInputError, match="demonstrations 0 and demonstrations 1 do not belong.*action_scale"):
        Demonstrations.concatenate([tiny(), tiny(contract=other)])
    with pytest.raises(InvalidInputError, match="empty"):
        Demonstrations.concatenate([])


def wide(layout: ObservationLayout, n: int = 3) -> Demonstrations:
    """Rows whose entry j is j + 1000 times the row, but for the task ids: 0, 1, 0, ..."""
    obs = np.arange(layout.size) + 1000.0 * np.arange(n)[:, None]
    obs[:, -2:] = np.eye(2)[np.arange(n) % 2]
    contract = CONTRACT.with_terms(terms_of(layout))
    return tiny(obs=obs, acts=np.zeros((n, 2)), starts=np.ones(n, dtype=bool), contract=contract)


def test_select_the_terms_that_a_smaller_observation_has():
    rows = wide(ObservationLayout(("trot", "bound"), ("command", "phase"), history=3))
    seen = rows.select(("phase",), history=2)
    assert seen.obs[1].tolist() == [*range(1000, 1034), 1037, 1038, *range(1039, 1073), 0, 1]
    assert seen.task.tolist() == rows.task.tolist() and seen.meta == rows.meta
    assert (seen.contract.channels, seen.contract.history) == (("phase",), 2)
    np.testing.assert_array_equal(rows.select(("phase", "command"), 3).obs, rows.obs)
    assert rows.select().obs[2].tolist() == [*range(2000, 2034), 1, 0]


def test_nothing_is_selected_that_is_not_there():
    rows = wide(ObservationLayout(("trot", "bound"), ("phase",)))
    with pytest.raises(InvalidInputError, match="got also.*command"):
        rows.select(("command",))
    with pytest.raises(InvalidInputError, match="history must be at most 1, got 2"):
        rows.select(("phase",), 2)
    with pytest.raises(InvalidInputError, match="not a Go1's: they hold .count 1, square 1"):
        tiny().select()


def test_rows_are_brought_into_the_order_of_a_policys_tasks():
    swapped = tiny().fitted_to(CONTRACT.with_tasks(("bound", "trot")))
    assert swapped.tasks == ("bound", "trot") and swapped.task.tolist() == [1, 1, 1, 0, 0, 1]
    assert tiny().fitted_to(CONTRACT.with_tasks(("walk", "bound", "trot"))).task.tolist() == [2, 2, 2, 1, 1, 2]
    with pytest.raises(InvalidInputError, match="trot"):
        tiny().fitted_to(CONTRACT.with_tasks(("walk", "bound")))
    rows = tiny()
    assert rows.fitted_to(CONTRACT) is rows and rows.fitted_to(None) is rows


def test_rows_learn_the_gaits_that_the_other_side_names():
    named = CONTRACT.with_tasks(("walk", "bound", "trot"), GAITS)
    assert tiny().fitted_to(named).contract == named
    own = [tiny(contract=CONTRACT.with_tasks(CONTRACT.tasks, {name: GAITS[name]})) for name in CONTRACT.tasks]
    assert own[0].contract.gaits == (GAITS["trot"], None)
    assert Demonstrations.concatenate(own).contract.gaits == (GAITS["trot"], GAITS["bound"])


@pytest.mark.parametrize("change", [{"control_hz": 4.0}, {"kp": 40.0}, {"joints": ("knee", "hip")}])
def test_rows_of_another_contract_are_refused(change):
    with pytest.raises(InvalidInputError, match=f"the policy and the demonstrations.*{next(iter(change))}"):
        tiny().fitted_to(dataclasses.replace(CONTRACT, **change))


def test_a_fingerprint_tells_rows_apart_that_have_equal_length():
    assert tiny().fingerprint() == tiny(meta={}).fingerprint()
    others = [tiny(acts=np.ones((6, 2))), tiny(contract=dataclasses.replace(CONTRACT, kp=1.0))]
    assert len({rows.fingerprint() for rows in (tiny(), *others)}) == 3


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


def test_a_shard_of_version_0_1_says_why_it_is_refused(tmp_path):
    manifest = np.frombuffer(b'{"tasks": ["trot"], "control_hz": 50, "rows": 1, "meta": {}}', dtype=np.uint8)
    np.savez(tmp_path / "old.npz", manifest=manifest, obs=np.ones((1, 3)), acts=np.ones((1, 2)), starts=np.ones(1))
    with pytest.raises(InvalidInputError, match="version 0.1 and does not say what its numbers mean"):
        Demonstrations.load(tmp_path / "old.npz")


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
        {"contract": dataclasses.replace(CONTRACT, terms=(ObservationTerm("count", 1),))},
        {"obs": np.zeros((6, 2))},
    ],
)
def test_bad_data(change):
    with pytest.raises(InvalidInputError):
        tiny(**change)
