"""Rows: read from disk, shuffled, collected."""

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from experiments.benchmarks.loops import made_up
from experiments.benchmarks.turns import N_TASKS, RATE, Heat, TrainingOptions, Turn, seconds
from go1_mtl_gym.actuation import PDGains
from go1_mtl_gym.robot import HOME_POSE
from go1_mtl_gym.sim.simulation import Simulation
from trainers import Demonstrations, TensorBatches, collect, make_env
from trainers.data.environments import derive_seed

SHARDS = 12
TASK = "trot"
CONTROL_HZ = 1000


def reading(amounts: TrainingOptions) -> Iterator[Heat]:
    """Shards from disk to one set of demonstrations, against numpy doing that with the arrays alone."""

    def contestants(folder: Path) -> Mapping[str, Turn]:
        data = made_up(amounts.stored_rows, N_TASKS, amounts.data_seed)
        paths = _write(data, folder)
        rate = functools.partial(_rate, amounts, len(data))
        return {"ours": rate(lambda: _read(paths)), "numpy": rate(lambda: _read_arrays(paths))}

    yield Heat(f"{amounts.stored_rows} rows, {SHARDS} files", 1, contestants, ("numpy",))


def shuffling(amounts: TrainingOptions) -> Iterator[Heat]:
    """Passes over all rows in a new order, batch by batch, against numpy doing that on the same arrays."""

    def contestants(_: Path) -> Mapping[str, Turn]:
        data = made_up(amounts.stored_rows, N_TASKS, amounts.data_seed)
        batch = functools.partial(TensorBatches, data, amounts.batch_size, amounts.data_seed, amounts.device)
        made = batch()
        rng = np.random.default_rng(amounts.data_seed)
        rate = functools.partial(_rate, amounts, len(made) * amounts.batch_size)
        return {
            "ours": rate(lambda: _exhaust(made)),
            "ours, first pass": rate(lambda: _exhaust(batch())),
            "numpy": rate(lambda: _exhaust(_numpy_batches(data, amounts.batch_size, rng))),
        }

    yield Heat(f"{amounts.stored_rows} rows, batches of {amounts.batch_size}", 1, contestants, ("numpy",))


def collection(amounts: TrainingOptions) -> Iterator[Heat]:
    """Rows from the expert at 1 kHz on one core, against the same walk without the expert, and physics alone."""

    def contestants(_: Path) -> Mapping[str, Turn]:
        record = functools.partial(
            collect, TASK, seed=amounts.data_seed, seconds=amounts.collect_s, env_kwargs={"control_hz": CONTROL_HZ}
        )
        walked = record()
        rate = functools.partial(_rate, amounts, len(walked))
        env = make_env(TASK, control_hz=CONTROL_HZ, episode_s=1e6)
        simulation = Simulation(PDGains())
        return {
            "expert and environment": rate(record),
            "environment alone": rate(lambda: _replay(env, walked, amounts.data_seed)),
            "MuJoCo alone": rate(lambda: _physics(simulation, walked)),
        }

    yield Heat(f"{TASK}, {CONTROL_HZ} Hz, one core", 1, contestants, ("environment alone", "MuJoCo alone"))


def _rate(amounts: TrainingOptions, rows: int, call: Callable[[], Any]) -> Turn:
    return lambda _: {RATE: rows / seconds(call, amounts)}


def _write(data: Demonstrations, folder: Path) -> list[Path]:
    paths = []
    for i, rows in enumerate(np.array_split(np.arange(len(data)), SHARDS)):
        paths.append(folder / f"{i}.npz")
        data.take(rows).save(paths[-1])
    return paths


def _read(paths: Sequence[Path]) -> Demonstrations:
    return Demonstrations.concatenate([Demonstrations.load(path) for path in paths])


def _read_arrays(paths: Sequence[Path]) -> dict[str, np.ndarray]:
    parts: dict[str, list[np.ndarray]] = {"obs": [], "acts": [], "starts": []}
    for path in paths:
        with np.load(path) as archive:
            for name, arrays in parts.items():
                arrays.append(archive[name])
    return {name: np.concatenate(arrays) for name, arrays in parts.items()}


def _numpy_batches(data: Demonstrations, batch_size: int, rng: np.random.Generator) -> Iterator[Any]:
    order = rng.permutation(len(data))
    for i in range(len(data) // batch_size):
        rows = order[i * batch_size : (i + 1) * batch_size]
        yield data.obs.take(rows, axis=0), data.acts.take(rows, axis=0)


def _exhaust(batches: Any) -> None:
    for _ in batches:
        pass


def _replay(env: Any, walked: Demonstrations, seed: int) -> None:
    """The expert's walk again, from its actions: `collect` begins its first episode with this seed."""
    env.reset(seed=derive_seed("collect", TASK, seed, 0))
    for action in walked.acts:
        env.step(action)


def _physics(simulation: Simulation, walked: Demonstrations) -> None:
    simulation.reset(HOME_POSE)
    model, data = simulation.model, simulation.data
    for target in np.array(walked.contract.default_q) + walked.half_range * walked.acts:
        data.ctrl[:] = target
        mujoco.mj_step(model, data)
