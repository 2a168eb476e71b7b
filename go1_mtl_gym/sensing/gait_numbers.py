"""What a policy sees of a gait: where each leg is in its cycle, and the figures of the gait."""

import numpy as np

from go1_mtl_gym.gaits import Gait

LEG_NUMBERS = 6
"""Of the term "gait" for each leg; what is of the gait as a whole stands behind them."""


def gait_numbers(gait: Gait, phase: float, standing: bool, control_s: float) -> np.ndarray:
    """The observation's term "gait", shape (29,).

    | num     | of each leg, FL FR RL RR, or of the gait                    | unit |
    |---------|-------------------------------------------------------------|------|
    | 0 - 7   | sine of the clocks, then cosine                             | -    |
    | 8 - 11  | time to the next touchdown                                  | s    |
    | 12 - 15 | time to the next lift-off                                   | s    |
    | 16 - 19 | share of the coming control period on the ground            | -    |
    | 20 - 23 | duty                                                        | -    |
    | 24      | cycles per second                                           | Hz   |
    | 25      | swing height                                                | m    |
    | 26, 27  | factors of stance width and body height                     | -    |
    | 28      | 1 while the clock rests                                     | -    |

    Args:
        gait: that is asked for.
        phase: of its clock [cycles].
        standing: whether the clock rests.
        control_s: the control period [s].
    """
    leg = gait.leg_phase(phase)
    touchdown_s = (1.0 - leg) * gait.period
    lift_off_s = np.mod(gait.duties - leg, 1.0) * gait.period
    share = np.ones(4) if standing else gait.contact_schedule(phase, control_s, 1)[0]
    figures = [1.0 / gait.period, gait.swing_height, gait.stance_width, gait.body_height, float(standing)]
    turn = 2 * np.pi * leg
    return np.concatenate([np.sin(turn), np.cos(turn), touchdown_s, lift_off_s, share, gait.duties, figures])
