"""What experts and students see: the true state, and the observation with its noise and memory."""

import numpy as np

from go1_mtl_gym.episode import Episode
from go1_mtl_gym.sensing.observation import PROPRIOCEPTION, ObservationLayout
from go1_mtl_gym.sensing.state import RobotState
from go1_mtl_gym.sim.simulation import Simulation


class Observer:
    """Makes states and observations.

    Args:
        layout: which parts there are.
        tasks: names in the order of the task id.
        control_s: time between two observations [s].
    """

    def __init__(self, layout: ObservationLayout, tasks: tuple[str, ...], control_s: float) -> None:
        self._layout = layout
        self._tasks = tasks
        self._control_s = control_s

    @staticmethod
    def state(simulation: Simulation, episode: Episode) -> RobotState:
        """All that an expert may read, now."""
        data = simulation.data
        return RobotState(
            position_w=data.qpos[:3].copy(),
            quat_wxyz=data.qpos[3:7].copy(),
            linear_velocity_w=data.qvel[:3].copy(),
            angular_velocity_b=data.qvel[3:6].copy(),
            q=simulation.q,
            v=simulation.v,
            contacts=simulation.contacts,
            gait=episode.task.gait,
            phase=episode.phase,
            command=episode.filtered_command,
            time_s=episode.time_s,
        )

    def observe(
        self, simulation: Simulation, state: RobotState, episode: Episode, rng: np.random.Generator
    ) -> np.ndarray:
        """The observation after a reset or step, float32, shape (layout.size,); call it once for each.

        Args:
            simulation: whose sensors are read.
            state: the robot's state now.
            episode: has the noise of the sensors; its present frame is added to `older_frames`, and its
                `state_estimator` is told what the student sees.
            rng: of the noise.
        """
        reading = simulation.read()
        turn = 2 * np.pi * episode.phase
        parts = {
            "accelerometer": reading.accelerometer,
            "gyroscope": reading.gyroscope,
            "q": state.q,
            "dq": state.v,
            "contacts": reading.contacts,
            "command": episode.filtered_command,
            "gravity": state.gravity_b,
            "phase": np.array([np.sin(turn), np.cos(turn)]),
            "last_action": episode.last_action,
        }
        if episode.sensor_noise is not None:
            episode.sensor_noise.apply(parts, rng)
        if not simulation.stable:
            parts = {name: np.nan_to_num(part) for name, part in parts.items()}
        frame = np.concatenate([parts[name] for name in PROPRIOCEPTION])
        if episode.steps == 0:
            episode.older_frames.extend([frame] * (self._layout.history - 1))
        observation = self._layout.flatten(parts, episode.older_frames, self._tasks.index(episode.task.name))
        episode.older_frames.appendleft(frame)
        if episode.state_estimator is not None and simulation.stable:
            readings = {name: observation[self._layout.slices[name]].astype(np.float64) for name in PROPRIOCEPTION}
            if episode.steps == 0:
                episode.state_estimator.begin(state, readings)
            else:
                episode.state_estimator.update(readings, self._control_s)
        return observation
