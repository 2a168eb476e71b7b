"""Settings for every test: one thread per process, and software OpenGL where it is to be had.

Tests that render carry ``@pytest.mark.gl`` and skip where none works.
"""

import os
from collections.abc import Iterator

import pytest

from examples.headless import choose_gl

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.setdefault("MPLBACKEND", "Agg")

NO_GL = choose_gl()


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
    if NO_GL and item.get_closest_marker("gl"):
        pytest.skip(NO_GL)
