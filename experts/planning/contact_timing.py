"""When feet touch down and lift off within the time for which one answer is held."""

from itertools import pairwise

import numpy as np

from go1_mtl_gym.sensing.state import RobotState

SHORTEST_PIECE_S = 1e-3
"""Contact changes closer than this to each other or to the ends of a hold are taken as one [s]."""


def swing_middle(state: RobotState, hold_s: float) -> np.ndarray:
    """Time until the middle of what a hold contains of each leg's swing [s], shape (4,); its end if it has none."""
    gait = state.gait
    leg = gait.leg_phase(state.phase)
    lift_off, touchdown = (gait.duties - leg) * gait.period, (1.0 - leg) * gait.period
    # A leg in the air lifted off before the hold began, which counts as at its beginning.
    return (np.clip(lift_off, 0.0, hold_s) + np.minimum(touchdown, hold_s)) / 2


def contact_pieces(state: RobotState, hold_s: float) -> list[tuple[float, float]]:
    """The parts of a hold between which feet touch down or lift off: middle [s] and fraction of the hold of each."""
    gait = state.gait
    leg = gait.leg_phase(state.phase)
    # Times to the next lift-off and touchdown of each leg.
    edges = np.concatenate([(gait.duties - leg) % 1.0, 1.0 - leg]) * gait.period
    cuts = [0.0]
    for edge in sorted(edges[edges < hold_s - SHORTEST_PIECE_S].tolist()):
        if edge > cuts[-1] + SHORTEST_PIECE_S:
            cuts.append(edge)
    cuts.append(hold_s)
    return [((a + b) / 2, (b - a) / hold_s if hold_s else 1.0) for a, b in pairwise(cuts)]
