"""What an environment's episodes take place under: physics, sensor noise and what the expert knows of the state."""

from dataclasses import dataclass

import numpy as np

from go1_mtl_gym.episode import Episode
from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.sensing.observation import SensorNoise
from go1_mtl_gym.sensing.state_estimator import StateEstimator, StateEstimatorConfig
from go1_mtl_gym.sensing.state_noise import EstimatorError, EstimatorNoise
from go1_mtl_gym.sim.domain_randomization import DomainRandomization
from go1_mtl_gym.sim.physics_params import PhysicsParams
from go1_mtl_gym.sim.simulation import Simulation

EXPERTS_ALONE = ("estimator_noise", "state_estimator")
"""Arguments of `go1_mtl_gym.Go1Env` that only its expert notices."""


@dataclass(frozen=True)
class Conditions:
    """The environment's own conditions, and how an episode's are drawn.

    Attributes:
        physics_params: what is different about the physics.
        sensor_noise: of the sensors, or None.
        estimator_noise: on the state that the expert sees, or None.
        state_estimator: that tells the expert the state from the sensors, or None.
        randomization: of physics and sensor noise, or None.

    Raises:
        InvalidInputError: if the randomization can draw impossible sensor noise, or the expert is to have both an
            estimator and another's noise.
    """

    physics_params: PhysicsParams
    sensor_noise: SensorNoise | None
    estimator_noise: EstimatorNoise | None
    state_estimator: StateEstimatorConfig | None
    randomization: DomainRandomization | None

    def __post_init__(self) -> None:
        if self.estimator_noise is not None and self.state_estimator is not None:
            raise InvalidInputError(
                "estimator_noise stands for the errors of an estimator and state_estimator has its own: give one of "
                f"them, got {self.estimator_noise} and {self.state_estimator}"
            )
        if self.randomization is not None and self.randomization.noise is not None:
            self._scaled_noise(self.randomization.noise[1])

    def begin(self, episode: Episode, simulation: Simulation, rng: np.random.Generator) -> None:
        """Give an episode its noise and its estimator, and the simulation its physics.

        Args:
            episode: gets `sensor_noise`, `estimator_error` and `state_estimator`.
            simulation: gets its physics_params if there is a randomization, and is left alone otherwise.
            rng: gives one number for the estimator noise and one for the randomization, whatever is drawn from them.
        """
        episode.sensor_noise = self.sensor_noise
        if self.estimator_noise is not None:
            episode.estimator_error = EstimatorError(self.estimator_noise, int(rng.integers(2**63)))
        if self.state_estimator is not None:
            episode.state_estimator = StateEstimator(self.state_estimator)
        if self.randomization is not None:
            own = np.random.default_rng(int(rng.integers(2**63)))
            physics_params, factor = self.randomization.draw(own, self.physics_params)
            simulation.set_physics_params(physics_params)
            if factor is not None:
                episode.sensor_noise = self._scaled_noise(factor)

    def _scaled_noise(self, factor: float) -> SensorNoise:
        return (self.sensor_noise or SensorNoise()).scaled(factor)
