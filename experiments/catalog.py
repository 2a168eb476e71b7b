"""Every study by name, imported when it is asked for."""

import inspect
from importlib import import_module
from typing import Any

from experiments.study import Study
from go1_mtl_gym.validation import one_of

STUDIES = {
    "expert_commands": "experiments.expert.commands:Commands",
    "expert_limits": "experiments.expert.limits:Limits",
    "expert_pushes": "experiments.expert.limits:Pushes",
    "expert_steady": "experiments.expert.steady:Steady",
    "expert_transitions": "experiments.expert.transitions:Transitions",
    "expert_labels": "experiments.expert.labels:Labels",
    "expert_settings": "experiments.expert.timing:Settings",
    "expert_timing": "experiments.expert.timing:Timing",
    "expert_long_walk": "experiments.expert.transitions:LongWalk",
    "student_commanded": "experiments.student.commanded:Commanded",
    "student_transitions": "experiments.student.transitions:Transitions",
    "student_robustness": "experiments.student.robustness:Robustness",
    "student_pushes": "experiments.student.pushes:Pushes",
    "student_hands": "experiments.student.hands:Hands",
    "student_ablation": "experiments.student.ablation:Ablation",
    "student_budget": "experiments.student.budget:Budget",
    "student_ppo": "experiments.student.ppo:ReinforcementLearning",
    "student_phase_free": "experiments.student.phase_free:PhaseFree",
    "any_gait_expert": "experiments.any_gait.expert_map:ExpertMap",
    "any_gait_student": "experiments.any_gait.student:Student",
    "paper_simulation": "experiments.paper.study:Simulation",
    "paper_hardware": "experiments.paper.study:Hardware",
    "paper_hardware_half_noise": "experiments.paper.study:HalfNoise",
    "paper_hardware_estimator": "experiments.paper.study:Estimator",
    "driving_times": "experiments.driving.times:Times",
    "driving_page": "experiments.driving.page:Page",
    "benchmark_expert": "experiments.benchmarks.expert:ExpertBenchmark",
    "benchmark_training": "experiments.benchmarks.training:TrainingBenchmark",
    "new_gaits": "experiments.new_gaits.study:NewGaits",
}
"""Name -> module and class."""


def resolve(place: str) -> Any:
    """What "module:name" stands for."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def study_class(name: str) -> type[Study]:
    """The class of a study.

    Raises:
        InvalidInputError: if there is no study of that name.
    """
    return resolve(STUDIES[one_of(name, tuple(STUDIES), "study")])


def summary_line(study: type[Study]) -> str:
    """What a study is about: the first line of its docstring."""
    return (inspect.getdoc(study) or study.title).splitlines()[0]
