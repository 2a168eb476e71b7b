"""What is not as in the paper, in words."""

from collections.abc import Mapping
from typing import Any

from experiments.results import Results
from go1_mtl_gym import EstimatorNoise


def differences(name: str, results: Results) -> str:
    """What is not as in the paper's table of some name, as a list."""
    options, env = results.options, results.more["env_kwargs"]
    loss = "the mean over rows and joints per gait, summed over gaits; the paper's is the sum over rows"
    points = [
        "Expert: the MPC of this project, not the authors' controller; another expert makes other targets.",
        f"Gains: Kp {env['kp']:g} N m/rad and Kd {env['kd']:g} N m s/rad for all gaits. Targets are q + (tau + Kd v) / "
        "Kp in both, so other gains scale them differently.",
        f"Training: AdamW, one-cycle schedule with a peak of {options['learning_rate']:g}, {options['batch_size']} "
        f"rows per step, equally many of every gait, {loss}. Optimizer, rate, batch, duration and seeds of the paper "
        "are not stated. Where a student was trained in bfloat16, weights, loss and all measurements are float32 "
        "still. A network per gait draws as many rows of its gait per step as a network of all gaits does.",
        f"Commands: {options['train_commands']} per gait for training, drawn from ± {options['span'][0]:g} m/s forward "
        f"and ± {options['span'][1]:g} m/s sideways, yaw rate 0; the authors' own lists are not published. "
        f"{clipped(results)} Held-out ones are at least {options['gap']:g} m/s from every command of the training.",
        f"Recordings: {options['seconds']:g} s per command, from a standing start, the first steps included; after a "
        "fall the end is dropped and the walk begins again.",
        f"Normalization: {options['normalization']}, contacts left as they are.",
    ]
    if name == "hardware":
        points.append(
            "World: the paper's walks are a real robot's. Ours is simulated, with the paper's rates (MPC 100 Hz, whole "
            f"body {env['control_hz']} Hz), white noise on the student's sensors, {1000 * env['action_delay_s']:g} ms "
            f"of delay, and {estimate(env)}"
        )
    else:
        points.append("World: MuJoCo with our model of the robot, flat ground, no noise, 1 kHz.")
    return "\n".join(f"- {point}" for point in points)


def estimate(env: Mapping[str, Any]) -> str:
    """What the expert knows of the state in an environment with these arguments, as the end of a sentence."""
    if env.get("state_estimator"):
        return (
            "an expert that does not know the state: a Kalman filter tells it what it can, from the inertial unit, "
            "the joints and the contacts, the very readings that the student sees. As on a robot, but there contacts "
            "are uncertain too."
        )
    return (
        "white noise and a bias per episode on the expert's estimate of the state "
        f"({noise_factor(env['estimator_noise']):g} times the environment's default). The noises of estimate and "
        "sensors are independent of each other, so a part of the expert's answer cannot be told from what the student "
        "sees; on a robot, estimate and observation come from the same readings."
    )


def noise_factor(noise: bool | Mapping[str, float]) -> float:
    """How large the estimator's noise is, in units of the default; True is the default."""
    return 1.0 if noise is True else noise["velocity"] / EstimatorNoise().velocity


def clipped(results: Results) -> str:
    """Which gaits' commands had to be clipped to what the expert survives."""
    span = [*results.options["span"], 0.0]
    gaits = [
        f"{gait} ± {' and ± '.join(f'{x:g}' for x in high[:2])}"
        for gait, high in results.more["largest"].items()
        if high != span
    ]
    return f"Clipped to what the expert survives: {'; '.join(gaits)} m/s." if gaits else "None had to be clipped."
