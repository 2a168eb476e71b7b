"""Settings for every test: one thread per process, and software OpenGL where it is to be had.

Tests that render carry ``@pytest.mark.gl`` and skip where none works.
"""

import functools
import os
from collections.abc import Iterator

import pytest

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.setdefault("MPLBACKEND", "Agg")


@functools.cache
def no_pictures() -> str:
    """Why no picture can be drawn here; empty where one can."""
    from go1_mtl_gym.rendering import why_no_pictures  # numpy must see the number of threads above

    return why_no_pictures()


@pytest.fixture
def passing_tasks() -> Iterator[None]:
    """Tasks that the test registers are forgotten after it."""
    import gymnasium

    from go1_mtl_gym.tasks import _REGISTRY

    registries = (_REGISTRY, gymnasium.registry)
    kept = [dict(registry) for registry in registries]
    yield
    for registry, before in zip(registries, kept):
        registry.clear()
        registry.update(before)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skips rendering tests, with the reason, where there is no OpenGL."""
    if item.get_closest_marker("gl") and no_pictures():
        pytest.skip(no_pictures())
