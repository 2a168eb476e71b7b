"""The conditions that a policy is certified under: what drives, and in which world."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import SensorNoise
from go1_mtl_gym.sensing.state_noise import EstimatorNoise
from go1_mtl_gym.validation import number_in, one_of
from trainers.data.operator import OperatorConfig
from trainers.utils.files import json_form
from trainers.utils.validation import positive

COMMAND_INTERVAL_S = 5.0
"""Time between drawn commands [s]."""
HARD_PUSHES_S = 5.0
"""Mean time between hard pushes [s]."""
HARD_PUSH = 0.6
"""Largest of them, as a share of the largest that the expert bears at an even pace: here hands jerk meanwhile."""
WORLD_CLAIM = 0.95
"""Success rate that is claimed of everything but an operator in the nominal world."""
DRAWN_CLAIM = 0.90
"""The same where everything is drawn at once from the ranges of `DomainRandomization`."""
TOUR_CLAIM = 0.9704
"""What 100 tours without a fall show at 95 %: the 100th root of 5 %, rounded down."""
UNTOUCHED = OperatorConfig(starts_released=1.0).of_moves("release", "stand").of_one_gait()
"""A stick that nobody touches; a push comes now and then, as it does to every operator."""


@dataclasses.dataclass(frozen=True)
class Condition:
    """One way to be driven in one world.

    Attributes:
        name: a word, such as "operator".
        title: what a table calls it.
        operator: whose hands drive; None: commands are drawn. Hands that change the gait make the condition one of all
            gaits together: its episodes are tours.
        command_interval: time between drawn commands [s], without an operator.
        env_kwargs: of the environment, as JSON has them.
        claim: success rate that is claimed; None: the certificate's.
        judged_by: "success" (survived, tracked and stepped) or "survival".

    Raises:
        InvalidInputError: if something is not as described.
    """

    name: str
    title: str
    operator: OperatorConfig | None = dataclasses.field(default_factory=lambda: OperatorConfig().of_one_gait())
    command_interval: float = COMMAND_INTERVAL_S
    env_kwargs: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    claim: float | None = None
    judged_by: str = "success"

    def __post_init__(self) -> None:
        """Check everything, and bring it into the form that comes back from a file."""
        if not isinstance(self.name, str) or not self.name.replace("_", "").isalnum():
            raise InvalidInputError(
                f"the name of a condition must be letters, digits and underscores, got {self.name!r}"
            )
        operator = OperatorConfig(**self.operator) if isinstance(self.operator, Mapping) else self.operator
        if not (operator is None or isinstance(operator, OperatorConfig)):
            raise InvalidInputError(
                f"the operator of {self.name!r} must be an OperatorConfig or None, got {operator!r}"
            )
        one_of(self.judged_by, ("success", "survival"), "judged_by")
        if self.claim is not None:
            number_in(self.claim, 0.0, 1.0, "claim")
        positive(self.command_interval, "command_interval")
        object.__setattr__(self, "operator", operator)
        object.__setattr__(self, "env_kwargs", json_form(dict(self.env_kwargs), f"env_kwargs of {self.name!r}"))

    @property
    def is_tour(self) -> bool:
        """Whether its episodes lead through all gaits."""
        return self.operator is not None and self.operator.task_interval is not None

    def as_dict(self) -> dict[str, Any]:
        """JSON values; ``Condition(**values)`` is the inverse."""
        return json_form(self, self.name)


def world(name: str, title: str, **env_kwargs: Any) -> Condition:
    """The nominal hands in another world."""
    return Condition(name, title, env_kwargs=env_kwargs, claim=WORLD_CLAIM)


_TWICE = {"noise": SensorNoise().scaled(2.0), "estimator_noise": EstimatorNoise().scaled(2.0)}
"""Each is noticed by one of policy and expert."""
_ALL_DRAWN = {"randomization": True}
_PUSHING = OperatorConfig(hard_push=HARD_PUSH, hard_push_interval=HARD_PUSHES_S).of_one_gait()
CONDITIONS = {
    each.name: each
    for each in (
        Condition("operator", "operator"),
        Condition("drawn", "drawn commands", operator=None, claim=WORLD_CLAIM),
        # A robot that is pushed steps to keep its balance, which success would not allow it.
        Condition("standing", "nobody touches the stick", UNTOUCHED, claim=WORLD_CLAIM, judged_by="survival"),
        world("delay", "delay 20 ms", action_delay_s=0.02),
        world("payload", "payload 3 kg", payload_kg=3.0),
        world("friction", "friction 0.4", friction=0.4),
        world("joint_friction", "joint friction 1 N m", joint_friction=1.0),
        world("noise", "twice the noise", **_TWICE),
        world("joint_damping", "joint damping 1 N m s/rad", joint_damping=1.0),
        world("soft_feet", "soft feet (0.16 s)", contact_time_s=0.16),
        world("encoders", "encoders off by up to 0.06 rad", sensors={"encoder_offset": 0.06}),
        world("late_sensors", "readings 20 ms late", sensors={"delay_s": 0.02}),
        world("settled", "half a second of standing before the clock", settle_s=0.5),
        Condition("all_drawn", "all of these drawn at once", env_kwargs=_ALL_DRAWN, claim=DRAWN_CLAIM),
        # What a push does to the velocity would count as a tracking error.
        Condition("hard_pushes", "hard pushes", _PUSHING, claim=WORLD_CLAIM, judged_by="survival"),
        Condition("tour", "tours of all gaits", OperatorConfig(), claim=TOUR_CLAIM, judged_by="survival"),
    )
}
"""What `trainers.certify` knows by name, in the order of its tables."""
