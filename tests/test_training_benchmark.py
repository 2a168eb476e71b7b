"""The benchmark of the training: its parts by hand, and a quick run of everything."""

import itertools
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from go1_mtl_gym.errors import InvalidInputError
from trainers import BCConfig, BCTrainer, TensorBatches
from trainers.utils.report import training_table

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "benchmarks"))

import training  # noqa: E402
from training_parts import loops as benchmark_loops  # noqa: E402
from training_parts import rows as benchmark_rows  # noqa: E402
from training_parts import settings as benchmark_settings  # noqa: E402
from training_parts import steps as benchmark_steps  # noqa: E402
from training_parts import timing as benchmark_timing  # noqa: E402

QUICK = benchmark_settings.Settings(**benchmark_settings.QUICK)


# -- Taking turns ------------------------------------------------------------------------------------------------------


def test_turns_alternate_and_are_kept_by_round():
    calls, rounds = [], []

    def contestant(name):
        def turn(i):
            calls.append(name)
            return {"samples_per_s": 10.0 * i + (name == "b")}

        return turn

    turns = {name: contestant(name) for name in "ab"}
    values = benchmark_timing.interleaved(turns, 3, lambda: rounds.append(len(calls)))
    assert calls == ["a", "b", "b", "a", "a", "b"] and rounds == [2, 4, 6]
    assert values == {"a": {"samples_per_s": [0.0, 10.0, 20.0]}, "b": {"samples_per_s": [1.0, 11.0, 21.0]}}


def test_ratios_are_taken_within_rounds():
    """The machine is ten times slower in the second round; the ratio is 2, 2, 4 all the same."""
    values = {"fast": {"rate": [20.0, 2.0, 40.0]}, "slow": {"rate": [10.0, 1.0, 10.0]}}
    fast, slow = benchmark_timing.summary(values, ("slow",))
    assert fast["figures"]["rate"] == {"median": 20.0, "low": 11.0, "high": 30.0}
    assert fast["over"] == {"slow": {"rate": {"median": 2.0, "low": 2.0, "high": 3.0}}}
    assert slow["contestant"] == "slow" and slow["over"] == {}


def test_the_stopwatch_leaves_out_the_first_steps(monkeypatch):
    now = itertools.count()
    monkeypatch.setattr(benchmark_timing.time, "perf_counter", lambda: 4.0 * next(now))
    watch = benchmark_timing.Stopwatch(QUICK)
    for _ in range(benchmark_timing.WARM_UP + 6):
        watch()
    assert watch.rate(10) == pytest.approx(6 * 10 / 4.0)


def test_a_heat_sets_threads_and_gives_them_back():
    before, seen = torch.get_num_threads(), []

    def contestants(folder):
        assert folder.is_dir()
        return {"only": lambda i: {"samples_per_s": float(seen.append(torch.get_num_threads()) is None)}}

    heat = benchmark_timing.Heat("2 threads", 2, contestants, ())
    rows = benchmark_timing.run(heat, 2, lambda: None)
    assert seen == [2, 2] and torch.get_num_threads() == before
    assert [row["setting"] for row in rows] == ["2 threads"]


# -- Contestants -------------------------------------------------------------------------------------------------------


def test_made_up_experts_differ_by_task_and_not_by_seed():
    data, other = (benchmark_loops.made_up(3000, 3, seed, episode=10) for seed in (0, 1))
    assert np.bincount(data.task).tolist() == [1000] * 3 and len(list(data.episodes())) == 300
    fits = {}
    for name, train, test in (("seeds", data, other), ("tasks", data, data)):
        own, asked = train.task == 0, test.task == (0 if name == "seeds" else 1)
        solution = np.linalg.lstsq(train.obs[own, :34], np.arcsin(train.acts[own] / 0.5), rcond=None)[0]
        fits[name] = np.abs(0.5 * np.sin(test.obs[asked, :34] @ solution) - test.acts[asked]).mean()
    assert fits["seeds"] < 0.9 * fits["tasks"]


def test_the_bare_loop_does_the_same_arithmetic():
    data = benchmark_loops.made_up(2000, 4, seed=0, episode=10)
    config = BCConfig(steps=20, batch_size=64, max_grad_norm=0.05)
    policies = [benchmark_loops.student(data, 16, QUICK) for _ in range(2)]
    before = [p.detach().clone() for p in policies[0].actor.parameters()]
    BCTrainer(policies[0], config).fit(data)
    batches = itertools.chain.from_iterable(itertools.repeat(TensorBatches(data, 64, config.seed)))
    pairs = itertools.islice(((batch["obs"], batch["acts"]) for batch in batches), 1, None)
    steps = []
    benchmark_loops.bare_loop(policies[1], pairs, data.half_range, config, lambda: steps.append(1))
    assert len(steps) == 20
    for first, own, bare in zip(before, *(policy.actor.parameters() for policy in policies)):
        torch.testing.assert_close(own, bare, atol=2e-5, rtol=0)
        assert float((own - first).detach().abs().max()) > 1e-3


def test_bare_batches_are_sorted_and_cover_every_row():
    data = benchmark_loops.made_up(160, 4, seed=0, episode=1)
    batches = list(itertools.islice(benchmark_loops.blocks(data, 16, 0, "cpu"), 10))
    for obs, acts in batches:
        assert obs[:, -4:].argmax(1).tolist() == np.repeat(np.arange(4), 4).tolist() and acts.shape == (16, 12)
    seen = torch.cat([acts for _, acts in batches])
    np.testing.assert_array_equal(np.unique(seen.numpy(), axis=0), np.unique(data.acts, axis=0))


def test_transitions_are_the_rows_in_order():
    data = benchmark_loops.made_up(30, 3, seed=0, episode=10)
    transitions = benchmark_loops.as_transitions(data)
    np.testing.assert_array_equal(transitions.obs, data.obs)
    np.testing.assert_array_equal(transitions.next_obs[:-1], data.obs[1:])
    assert np.flatnonzero(transitions.dones).tolist() == [9, 19, 29]
    assert data.obs.flags.writeable, "imitation makes read-only what it is given"


def test_the_walk_without_the_expert_is_the_experts():
    """Replayed from the recorded actions, the environment shows the recorded observations."""
    walked = benchmark_rows.collect(
        benchmark_rows.TASK, seed=3, seconds=0.1, env_kwargs={"control_hz": benchmark_rows.CONTROL_HZ}
    )
    assert len(walked) == 100

    class Recorder:
        def __init__(self):
            self.env = benchmark_rows.make_env(benchmark_rows.TASK, control_hz=benchmark_rows.CONTROL_HZ)
            self.seen = []

        def reset(self, **kwargs):
            self.seen.append(self.env.reset(**kwargs)[0])

        def step(self, action):
            self.seen.append(self.env.step(action)[0])

    recorder = Recorder()
    benchmark_rows._replay(recorder, walked, seed=3)
    np.testing.assert_array_equal(np.array(recorder.seen[:-1]), walked.obs)


def test_numpy_reads_the_same_rows(tmp_path):
    data = benchmark_loops.made_up(500, 4, seed=0, episode=10)
    paths = benchmark_rows._write(data, tmp_path)
    arrays, ours = benchmark_rows._read_arrays(paths), benchmark_rows._read(paths)
    for name, array in arrays.items():
        np.testing.assert_array_equal(array, getattr(ours, name))
    np.testing.assert_array_equal(ours.obs, data.obs)


# -- The command -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """A quick run of every section: its file and its text."""
    out = tmp_path_factory.mktemp("benchmark") / "training.json"
    assert training.main(["--quick", "--out", str(out)]) == 0
    return out, json.loads(out.read_text(encoding="utf-8"))


def test_a_quick_run_measures_everything(quick):
    out, result = quick
    assert tuple(result["sections"]) == tuple(training.SECTIONS)
    rows = [row for section in result["sections"].values() for row in section["rows"]]
    assert all(row["figures"]["samples_per_s"]["median"] > 0 for row in rows)
    step = {row["contestant"]: row for row in result["sections"]["step"]["rows"]}
    assert set(step["ours"]["over"]) == {"bare loop", benchmark_steps.STOCK, benchmark_steps.STOCK_LOOP}
    assert [row["contestant"] for row in result["sections"]["heads"]["rows"]] == ["1 head", "4 heads"]
    losses = [row["figures"]["loss"]["median"] for row in result["sections"]["precision"]["rows"]]
    assert len(losses) == 4 and max(losses) < 1.2 * min(losses)
    assert result["command"] == "python benchmarks/training.py --quick"
    assert result["machine"]["cpu"] and result["config"]["threads"] == [1] and result["versions"]["torch"]
    assert str(out.parent) not in out.read_text(encoding="utf-8"), "no path of the machine"


def test_going_on_keeps_what_the_same_command_measured(quick, monkeypatch, tmp_path):
    out, result = quick
    copy = tmp_path / "training.json"
    part = {name: own for name, own in result["sections"].items() if name != "shuffling"}
    copy.write_text(json.dumps(result | {"sections": part}), encoding="utf-8")
    measured = []

    def section(name, settings):
        measured.append(name)
        return result["sections"][name]

    monkeypatch.setattr(training, "_section", section)
    assert training.main(["--quick", "--resume", "--out", str(copy)]) == 0
    assert measured == ["shuffling"] and set(json.loads(copy.read_text())["sections"]) == set(training.SECTIONS)
    assert training.main(["--quick", "--resume", "--rounds", "1", "--out", str(copy)]) == 0
    assert measured[1:] == list(training.SECTIONS), "another command, all anew"
    del measured[:]
    assert training.main(["--quick", "--sections", "heads", "--out", str(copy)]) == 0
    assert measured == ["heads"] and list(json.loads(copy.read_text())["sections"]) == ["heads"]


def test_options_reach_the_settings(monkeypatch):
    options = training.parse(["--quick", "--widths", "16", "64", "--rounds", "3"])
    assert (options.settings.widths, options.settings.rounds, options.settings.rows) == ((16, 64), 3, 4000)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    settings = training.parse(["--device", "cuda", "--steps", "7"]).settings
    assert (settings.batch_size, settings.rows, settings.steps) == (65_536, 1_800_000, 7)
    assert [heat.setting for heat in benchmark_steps.step(settings)] == ["512 wide, 1 thread", "2560 wide, 1 thread"]


def test_the_published_command_names_no_file():
    words = ["--rounds", "3", "--out", "some/file.json", "--resume", "--sections", "step"]
    assert training.published(words) == "python benchmarks/training.py --rounds 3 --sections step"
    assert training.published(["--out=some/file.json"]) == "python benchmarks/training.py"


@pytest.mark.parametrize(
    "wrong", [{"rounds": 0}, {"batch_size": 1022}, {"rows": 100}, {"device": "tpu"}, {"threads": (0,)}, {"seed": -1}]
)
def test_impossible_settings(wrong):
    with pytest.raises(InvalidInputError, match=next(iter(wrong))):
        benchmark_settings.Settings(**wrong)


def test_an_impossible_number_ends_the_command():
    command = [sys.executable, str(ROOT / "benchmarks" / "training.py"), "--rounds", "0"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2 and "error: rounds must lie in" in done.stderr


def test_the_table():
    def figure(median):
        return {"median": median, "low": 0.9 * median, "high": 1.1 * median}

    fast = {"samples_per_s": figure(200.0), "loss": figure(1e-3)}
    slow = {"samples_per_s": figure(100.0), "loss": figure(2e-3)}
    rows = [
        {"setting": "here", "contestant": "a", "figures": fast, "over": {"b": {"samples_per_s": figure(2.0)}}},
        {"setting": "here", "contestant": "b", "figures": slow, "over": {}},
    ]
    assert training_table({"sections": {"step": {"meaning": "steps", "rows": rows}}}).splitlines() == [
        "**steps**",
        "",
        "| setting | contestant | samples/s | x b | loss |",
        "| :-- | :-- | --: | --: | --: |",
        "| here | a | 200 | 2.00 (1.80 ... 2.20) | 1.00e-03 (9.00e-04 ... 1.10e-03) |",
        "| here | b | 100 | - | 2.00e-03 (1.80e-03 ... 2.20e-03) |",
    ]
    with pytest.raises(InvalidInputError, match="at least one section"):
        training_table({"sections": {}})
