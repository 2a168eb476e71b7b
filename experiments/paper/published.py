"""What arXiv 2505.08574 publishes, and what is aimed at beside it."""

from collections.abc import Mapping
from types import MappingProxyType

MULTI_HEAD, POOLED, PER_GAIT = "multi_head", "pooled", "per_gait"
"""One network with a head per gait; one for all gaits that is not told which; one network for every gait."""
KINDS = MappingProxyType({MULTI_HEAD: "multi-head", POOLED: "pooled, no task id", PER_GAIT: "a network per gait"})
"""Kinds of policies, and what they are called in tables. The paper's multi-task and single-task are the first two."""
METRICS = ("mse", "mae", "r2")


def _errors(mse: float, mae: float, r2: float) -> Mapping[str, float]:
    return MappingProxyType(dict(zip(METRICS, (mse, mae, r2))))


PUBLISHED: Mapping[str, Mapping[str, Mapping[str, Mapping[str, float]]]] = MappingProxyType(
    {
        "simulation": {
            "trot": {MULTI_HEAD: _errors(0.000528, 0.017643, 0.919537), POOLED: _errors(0.001484, 0.030213, 0.770130)},
            "jump": {MULTI_HEAD: _errors(0.003534, 0.016015, 0.892613), POOLED: _errors(0.006990, 0.034837, 0.796875)},
            "bound": {MULTI_HEAD: _errors(0.000416, 0.011603, 0.991763), POOLED: _errors(0.005179, 0.048135, 0.906929)},
        },
        "hardware": {
            "trot": {MULTI_HEAD: _errors(0.000225, 0.007600, 0.971015)},
            "walk": {MULTI_HEAD: _errors(0.000374, 0.010179, 0.961206)},
        },
    }
)
"""Table -> gait -> kind of policy -> MSE [rad^2], MAE [rad] and R2."""
TARGETS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {"simulation": {"trot": 0.99, "jump": 0.99, "bound": 0.99}, "hardware": {"trot": 0.971, "walk": 0.961}}
)
"""Table -> gait -> the R2 that a multi-head policy is to exceed."""
