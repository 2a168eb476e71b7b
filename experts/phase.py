"""The old name of `experts.phase_fitting`, for one more release."""

from experts import phase_fitting
from go1_mtl_gym.deprecation import warn_renamed


def __getattr__(name: str) -> object:
    """Look everything up in the new module."""
    value: object = getattr(phase_fitting, name)
    if not name.startswith("__"):  # the import system asks for these
        warn_renamed(f"experts.phase.{name}", f"experts.phase_fitting.{name}")
    return value
