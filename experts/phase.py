"""The old name of `experts.phase_fitting`; goes with the next release."""

import warnings

from experts import phase_fitting


def __getattr__(name: str) -> object:
    value = getattr(phase_fitting, name)
    warnings.warn("experts.phase is now experts.phase_fitting", DeprecationWarning, stacklevel=2)
    return value
