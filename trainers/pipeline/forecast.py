"""How long the stages of the main job will take: a guess from what they consist of, corrected by those done."""

from collections.abc import Mapping

from trainers.pipeline.config import JobConfig

# Core seconds on the machine of docs/results/main_job.md, from the wall times there; the guess wants no more precision
# than that, since the first stages correct it for the machine at hand.
EXPERT_S, POLICY_S, ROUND_S = 0.13, 0.065, 0.16
"""Per second of robot time: the expert drives, a policy does, both do in a round (all gaits side by side)."""
STEP_S, PHASE_STEP_S = 0.018, 0.016
"""Per gradient step of a network of `STEP_WIDTH` units with a batch of `STEP_BATCH`; of the phase estimator."""
STEP_WIDTH, STEP_BATCH = 256, 1024
FILM_S, SMALL_FILM_S = 0.5, 0.3
"""Per second of film, and of a small one."""
BEGIN_S = 3.0
"""Of every stage: processes begin, files are read."""
AGENTS = 5
"""The expert and four policies are evaluated."""

Parts = dict[str, tuple[int, float]]
"""Kind of part -> how many there are, and how long each takes [s]."""


def parts(config: JobConfig) -> dict[str, Parts]:
    """Stage -> its parts, in order; a stage that there will not be is left out."""
    gaits, workers = len(config.tasks), max(1, config.n_envs)
    hands = 2 if config.operator is not None else 1
    rate = 0.5 + 0.5 * config.control_hz / 50
    robot_s = config.clean_s + config.perturbed_s + config.hard_push_s + config.randomized_s + config.held_out_s
    step_s = STEP_S * (config.batch_size / STEP_BATCH) * max(0.2, config.width / STEP_WIDTH)
    episodes_s = POLICY_S * rate * config.episode_s / workers
    out: dict[str, Parts] = {
        "demonstrations": {"collect": (1, BEGIN_S + EXPERT_S * rate * gaits * robot_s / workers)},
        "clone": {"clone": (1, BEGIN_S + step_s * config.clone_steps)},
    }
    if config.rounds:
        out["dagger"] = {
            "evaluate": ((config.rounds + 1) * gaits, config.round_episodes * episodes_s),
            "collect": (config.rounds, BEGIN_S + ROUND_S * rate * gaits * config.dagger_s),
            "clone": (config.rounds, step_s * config.round_steps),
            "film": (config.rounds + 1, SMALL_FILM_S * gaits * config.round_video_s),
        }
    if config.phase_free_s and config.has_clock:
        watched_s = POLICY_S * rate * gaits * config.phase_free_s
        out["phase_free"] = {"watch": (1, BEGIN_S + watched_s), "phase": (1, PHASE_STEP_S * config.phase_free_steps)}
    steps = config.clone_steps + config.rounds * config.round_steps
    if not config.is_any_gait:
        out["baselines"] = {"baselines": (1, BEGIN_S + step_s * steps * (1 if workers > 1 else 2))}
    agents = 2 if config.is_any_gait else AGENTS
    out["evaluation"] = {"evaluate": (agents * gaits * hands, 1.2 * config.episodes * episodes_s)}
    out["pictures"] = {"videos": (1, BEGIN_S + FILM_S * gaits * config.video_s)}
    return out


def seconds_of(stage: Parts) -> float:
    """How long a stage takes [s]."""
    return sum(count * each for count, each in stage.values())


def left_s(expected: Mapping[str, float], measured: Mapping[str, float], remaining: list[str]) -> float:
    """How long the remaining stages will take [s].

    Args:
        expected: stage -> guess [s].
        measured: stage -> wall time of those that are done [s].
        remaining: the other stages.
    """
    known = [name for name in measured if expected.get(name)]
    total = sum(expected[name] for name in known)
    slowness = sum(measured[name] for name in known) / total if total else 1.0
    return slowness * sum(expected[name] for name in remaining)


def spoken(seconds: float) -> str:
    """A duration as people say it: "40 s", "12 min", "3.5 h"."""
    if seconds < 90:
        return f"{max(5, round(seconds / 5) * 5)} s"
    return f"{seconds / 60:.0f} min" if seconds < 90 * 60 else f"{seconds / 3600:.1f} h"
