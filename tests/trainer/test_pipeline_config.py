"""Settings of the main job: what is normalized, what is refused, and what the command line makes of it."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from go1_mtl_gym import DomainRandomization, InvalidInputError
from trainers import JobConfig
from trainers.cli.train import parse_job
from trainers.pipeline.demonstrations import held_out_jobs, training_jobs

REFUSED = {
    "rounds": (-1, 1.5, True, "3", None),
    "seed": (-1, np.float64(2.0)),
    "n_envs": (0,),
    "threads": (0,),
    "clean_s": (-1.0, float("nan"), np.inf, "60", None),
    "shard_s": (0.0,),
    "dagger_s": (0,),
    "takeover_rad": (0.0,),
    "randomized": (1.2,),
    "corner_fraction": (-0.1, 2),
    "task_interval": ((3.0, 1.0), 4.0),
    "tasks": ((), "trot", ("trot", "trot"), ("fly",)),
    "channels": ("phase", ("colour",)),
    "normalization": ("max",),
    "device": ("tpu",),
    "held_out_s": (1.0,),
    "episodes": (0,),
    "video_s": (0.0,),
}

ROOT = Path(__file__).resolve().parents[2]


def test_numbers_of_numpy_become_pythons_and_can_be_written():
    config = JobConfig(seed=np.int64(3), rounds=np.uint8(2), clean_s=np.float32(30.0), kp=20, tasks=["walk", "trot"])
    assert type(config.seed) is int and type(config.rounds) is int
    assert type(config.clean_s) is float and type(config.kp) is float
    assert config.tasks == ("walk", "trot")
    written = json.loads(json.dumps(config.as_dict()))
    assert written["seed"] == 3 and written["clean_s"] == 30.0 and written["tasks"] == ["walk", "trot"]
    assert JobConfig(**written) == config


@pytest.mark.parametrize(("name", "value"), [(name, value) for name, values in REFUSED.items() for value in values])
def test_what_cannot_be_is_refused_at_once_in_a_sentence_about_it(name, value):
    with pytest.raises(InvalidInputError) as refusal:
        JobConfig(**{name: value})
    message = str(refusal.value)
    assert name.rstrip("s") in message and "JobConfig(" not in message and len(message) < 250


def test_a_preset_is_a_start_that_options_change():
    config = JobConfig.from_preset("smoke", seed=4, rounds=0)
    assert (config.preset, config.width, config.seed, config.rounds) == ("smoke", 64, 4, 0)
    assert config.with_options(width=32).width == 32 and config.width == 64
    with pytest.raises(InvalidInputError, match="'widht'"):
        config.with_options(widht=3)
    with pytest.raises(InvalidInputError, match="'smok'"):
        JobConfig.from_preset("smok")


def test_the_command_line_gives_the_same():
    words = (
        "--preset smoke --tasks walk trot --seed 4 --n-envs 1 --channels command --history 2 --control-hz 100 --out x"
    )
    config, out = parse_job(words.split())
    options = {"tasks": ("walk", "trot"), "seed": 4, "n_envs": 1, "channels": ("command",), "history": 2}
    assert config == JobConfig.from_preset("smoke", **options, control_hz=100)
    assert out == Path("x")
    config, out = parse_job(["--preset", "paper"])
    assert (config.rounds, config.channels, config.control_hz, out) == (0, (), 1000, None)


def test_every_shard_has_a_seed_of_its_own_and_shorter_runs_are_the_beginning_of_longer_ones():
    amounts = {"clean_s": 30.0, "perturbed_s": 45.0, "hard_push_s": 15.0, "randomized_s": 30.0, "held_out_s": 15.0}
    config = JobConfig(**amounts, tasks=("trot", "walk"), seed=2)
    train, held_out = training_jobs(config), held_out_jobs(config)
    assert len(train) == 2 * (2 + 3 + 1 + 2) and len(held_out) == 2
    assert len({(job.task, job.seed) for job in train + held_out}) == 18
    assert [job.perturbation is None for job in train] == [True] * 4 + [False] * 12
    assert ["randomization" in job.env_kwargs for job in train] == [False] * 12 + [True] * 4
    pushed_hard = [job.perturbation.operator.hard_push_interval for job in train[4:]]
    assert pushed_hard == [None] * 6 + [2.5] * 2 + [None] * 4
    assert all(job.perturbation is None for job in held_out)
    less = config.with_options(clean_s=15.0, perturbed_s=0.0, hard_push_s=0.0, randomized_s=0.0)
    assert training_jobs(less) == train[:2]
    others = training_jobs(config.with_options(seed=3))
    assert not {job.seed for job in train + held_out} & {job.seed for job in others}


def test_what_follows_for_the_stages():
    config = JobConfig(clone_steps=600, round_steps=100, rounds=3, batch_size=64, seed=5)
    assert config.bc.steps == 600 and config.round_bc.steps == 100 and config.baseline_bc.steps == 600 + 3 * 100
    assert {config.bc.seed, config.dagger.seed, config.phase.seed} == {5}
    assert config.has_clock and not config.is_literal
    assert not config.with_options(channels=("command",)).has_clock
    with pytest.raises(InvalidInputError, match="reads its 3 frames and more, got phase_free_history = 2"):
        config.with_options(phase_free_history=2)
    assert config.with_options(channels=(), history=1).is_literal
    assert config.perturbation(0.05).task_interval == (2.0, 6.0)
    assert config.operator.task_interval is not None
    assert config.perturbation(0.05).operator == dataclasses.replace(config.operator, deflection=1.2)
    assert config.with_options(margin=1.0).perturbation(0.05).operator == config.operator
    alone = config.with_options(tasks=("trot",)).perturbation(0.05)
    assert alone.task_interval is alone.operator.task_interval is None, "one gait cannot change"
    assert config.with_options(operator=None).perturbation(0.05, 4.0).operator is None
    assert config.round_perturbation.operator.hard_push_interval == 5.0
    gentle = config.with_options(hard_push_interval=None)
    assert gentle.round_perturbation.operator.hard_push_interval is None
    assert len(training_jobs(config)) - len(training_jobs(gentle)) == 6 * 6
    ranges = DomainRandomization(fraction=0.3, each=0.3, ends=0.4)
    assert config.randomization_kwargs(0.3)["randomization"] == ranges
    assert config.randomization_kwargs(0.3)["episode_s"] == config.world_s == 5.0
    assert config.randomization_kwargs(0.0) == {}
    assert config.bc.mirror and not config.with_options(mirror=False).bc.mirror


def test_the_default_preset_is_the_one_whose_results_are_published():
    published = json.loads((ROOT / "docs" / "results" / "main_job.json").read_text(encoding="utf-8"))["options"]
    assert JobConfig(**published) == JobConfig.from_preset("default")
