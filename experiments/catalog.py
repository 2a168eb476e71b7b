"""Every study by name, imported when it is asked for."""

from importlib import import_module

from experiments.study import Study
from go1_mtl_gym.validation import one_of

STUDIES = {
    "student_commanded": "experiments.student.commanded:Commanded",
    "student_transitions": "experiments.student.transitions:Transitions",
    "student_robustness": "experiments.student.robustness:Robustness",
    "student_pushes": "experiments.student.pushes:Pushes",
    "student_ablation": "experiments.student.ablation:Ablation",
    "student_budget": "experiments.student.budget:Budget",
    "student_phase_free": "experiments.student.phase_free:PhaseFree",
}
"""Name -> module and class."""


def study_class(name: str) -> type[Study]:
    """The class of a study.

    Raises:
        InvalidInputError: if there is no study of that name.
    """
    module, _, cls = STUDIES[one_of(name, tuple(STUDIES), "study")].partition(":")
    return getattr(import_module(module), cls)
