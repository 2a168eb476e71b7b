"""Named settings of the main job."""

import os
from typing import Any

from go1_mtl_gym import PAPER_TASKS
from go1_mtl_gym.env_config import ANY_GAIT_CHANNELS
from go1_mtl_gym.tasks import ANY_GAIT

PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "smoke": {
        "rounds": 1,
        "clean_s": 3.0,
        "perturbed_s": 6.0,
        "hard_push_s": 3.0,
        "randomized_s": 3.0,
        "held_out_s": 3.0,
        "shard_s": 3.0,
        "dagger_s": 2.0,
        "width": 64,
        "batch_size": 256,
        "clone_steps": 300,
        "round_steps": 100,
        "phase_free_s": 2.0,
        "phase_free_steps": 100,
        "episodes": 2,
        "episode_s": 5.0,
        "round_episodes": 1,
        "round_video_s": 1.0,
        "video_s": 1.0,
    },
    "shipped": {
        "clean_s": 30.0,
        "perturbed_s": 450.0,
        "hard_push_s": 600.0,
        "randomized_s": 900.0,
        "randomized": 0.6,
        "held_out_s": 30.0,
        "rounds": 6,
        "dagger_s": 120.0,
        "width": 384,
        "clone_steps": 12_000,
        "round_steps": 5000,
        "phase_free_s": 480.0,
        "phase_free_steps": 8000,
    },
    "any_gait": {
        "tasks": (ANY_GAIT,),
        "channels": ANY_GAIT_CHANNELS,
        "clean_s": 60.0,
        "perturbed_s": 1800.0,
        "hard_push_s": 300.0,
        "randomized_s": 600.0,
        "held_out_s": 300.0,
        "dagger_s": 480.0,
        "width": 384,
        "clone_steps": 10_000,
        "round_steps": 5000,
        "phase_free_s": 0.0,
        "episodes": 50,
        "round_episodes": 20,
        "round_video_s": 4.0,
        "video_s": 12.0,
    },
    # arXiv 2505.08574: 20 commands of 30 s per gait at 1 kHz, clean; min-max scaling; 2560 units; no DAgger.
    "paper": {
        "tasks": PAPER_TASKS,
        "rounds": 0,
        "channels": (),
        "history": 1,
        "control_hz": 1000,
        "clean_s": 600.0,
        "perturbed_s": 0.0,
        "hard_push_s": 0.0,
        "randomized_s": 0.0,
        "operator": None,
        "mirror": False,
        "randomized": 0.0,
        "phase_free_s": 0.0,
        "held_out_s": 60.0,
        "shard_s": 30.0,
        "width": 2560,
        "threads": os.cpu_count() or 1,
        "normalization": "min_max",
        "clone_steps": 30_000,
        "episodes": 5,
    },
}
"""Name -> what differs from the defaults of `JobConfig`."""
ABOUT = {
    "default": "about half an hour on two quiet cores",
    "smoke": "a few minutes, to see that everything works",
    "shipped": "for policies like those in the package: one to two hours (an estimate)",
    "any_gait": "one network for gaits drawn at random: half an hour to an hour (an estimate)",
    "paper": "as arXiv 2505.08574 does: a day (an estimate)",
}
"""Name -> what it is for, and how long it takes."""
