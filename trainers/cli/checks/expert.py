"""The expert: whether it answers, with its QP solver, and whether its compiled loops are kept."""

from collections.abc import Iterator
from importlib.util import find_spec

from trainers.cli.checks.finding import FAILED, NOTE, OK, WARNING, Finding, tried

_ASK = """
import gc, json, time, warnings
import gymnasium
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always", RuntimeWarning)
    env = gymnasium.make("go1_mtl_gym:Go1Trot-v0").unwrapped
    env.reset(seed=0)
    begin = time.perf_counter()
    env.step(env.expert_action())
    first = time.perf_counter() - begin
    steps = []
    for _ in range(25):
        begin = time.perf_counter()
        env.step(env.expert_action())
        steps.append(time.perf_counter() - begin)
    then = sorted(steps)[12]
stats = []
try:
    from numba.core.registry import CPUDispatcher
    stats = [each.stats for each in gc.get_objects() if isinstance(each, CPUDispatcher) and each.signatures]
except ImportError:
    pass
print(json.dumps({
    "first": first, "then": then, "warnings": [str(each.message) for each in caught if "cache" in str(each.message)],
    "folders": sorted({str(each.cache_path) for each in stats if each.cache_path}),
    "hits": sum(sum(each.cache_hits.values()) for each in stats),
    "misses": sum(sum(each.cache_misses.values()) for each in stats),
}))
"""
SOLVERS = ("daqp", "piqp")
"""Those besides OSQP, which the expert has unless told otherwise."""


def check() -> Iterator[Finding]:
    """Let it walk for twenty steps in a process of its own, as a worker would."""
    answer, reason = tried(_ASK, MUJOCO_GL=None)  # it draws nothing; OpenGL is another check's
    if reason:
        remedy = 'python -m pip install --force-reinstall "pin>=3.3" "osqp>=1.0" "numba>=0.60"'
        yield Finding("expert", FAILED, f"does not answer: {reason}", remedy)
        return
    others = [name for name in SOLVERS if find_spec(name)]
    solvers = f"solver OSQP{', also ' + ' and '.join(others) if others else ''}"
    yield Finding("expert", OK, f"a step of robot and expert takes {1e3 * answer['then']:.1f} ms ({solvers})")
    if len(others) < len(SOLVERS):
        yield Finding("expert", NOTE, "the exact solvers DAQP and PIQP are not both here", 'pip install ".[solvers]"')
    yield _cache(answer)


def _cache(answer: dict) -> Finding:
    folders, first = ", ".join(answer["folders"]), f"first answer after {answer['first']:.1f} s"
    elsewhere = "export NUMBA_CACHE_DIR=FOLDER, one that can be written to"
    if answer["warnings"]:
        return Finding("Numba cache", WARNING, answer["warnings"][0], f"rm -r {folders or 'FOLDER'}, or {elsewhere}")
    if not folders:
        return Finding("Numba cache", WARNING, f"no place for it, every process compiles anew; {first}", elsewhere)
    if answer["misses"]:
        return Finding("Numba cache", OK, f"{answer['misses']} loops compiled now and kept in {folders}; {first}")
    return Finding("Numba cache", OK, f"{answer['hits']} loops read from {folders}; {first}")
