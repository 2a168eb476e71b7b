"""Three ways to clone a behavior: ours, a bare loop of PyTorch, and `imitation`'s own."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Box
from imitation.algorithms import bc as imitation_bc
from imitation.data.types import Transitions
from stable_baselines3.common.policies import ActorCriticPolicy

from experiments.benchmarks.turns import RATE, WARM_UP, Stopwatch, TrainingOptions, Turn
from go1_mtl_gym.contract import ObservationTerm, PolicyContract
from go1_mtl_gym.sensing.observation import FRAME_SIZE
from trainers import BCConfig, BCTrainer, Demonstrations, MultiHeadPolicy, make_logger

JOINTS = 12


def made_up(rows: int, n_tasks: int, seed: int, episode: int = 1000) -> Demonstrations:
    """Demonstrations of a smooth expert that is another one for each task; random observations, equally many per task.

    Args:
        rows: n.
        n_tasks: K; an observation has 34 + K entries.
        seed: of observations; the experts are always the same.
        episode: rows in a row of one task.
    """
    rng, experts = np.random.default_rng(seed), np.random.default_rng(0)
    task = np.arange(rows) // episode % n_tasks
    frames = rng.standard_normal((rows, FRAME_SIZE), dtype=np.float32)
    mixing = experts.standard_normal((n_tasks, FRAME_SIZE, JOINTS)).astype(np.float32) / FRAME_SIZE**0.5
    acts = np.empty((rows, JOINTS), dtype=np.float32)
    for k in range(n_tasks):
        acts[task == k] = 0.5 * np.sin(2 * frames[task == k] @ mixing[k])
    contract = PolicyContract(
        tasks=tuple(f"task {k}" for k in range(n_tasks)),
        gaits=(),
        terms=(ObservationTerm("frame", FRAME_SIZE),),
        control_hz=50.0,
        kp=50.0,
        kd=2.0,
        default_q=np.zeros(JOINTS),
        action_scale=np.linspace(0.5, 1.6, JOINTS),
    )
    obs = np.hstack([frames, np.eye(n_tasks, dtype=np.float32)[task]])
    return Demonstrations(obs, acts, np.arange(rows) % episode == 0, contract)


def student(data: Demonstrations, width: int, amounts: TrainingOptions, seed: int = 0) -> MultiHeadPolicy:
    """An untrained multi-head policy on the device, its normalization fitted."""
    spaces = _spaces(data)
    policy = MultiHeadPolicy(*spaces, contract=data.contract, width=width, seed=seed)
    policy.fit_normalization(data.obs, data.acts)
    return policy.to(torch.device(amounts.device))


def ours(data: Demonstrations, width: int, amounts: TrainingOptions, **options: Any) -> Turn:
    """`trainers.BCTrainer`, with some options of its configuration."""
    config = BCConfig(steps=amounts.steps + WARM_UP, batch_size=amounts.batch_size, seed=amounts.data_seed, **options)

    def turn(_: int) -> dict[str, float]:
        watch = Stopwatch(amounts)
        BCTrainer(student(data, width, amounts), config).fit(data, on_batch_end=watch)
        return {RATE: watch.rate(config.batch_size)}

    return turn


def bare(data: Demonstrations, width: int, amounts: TrainingOptions) -> Turn:
    """The same arithmetic and nothing else, as one would write it down for this one purpose."""
    config = BCConfig(steps=amounts.steps + WARM_UP, batch_size=amounts.batch_size)

    def turn(i: int) -> dict[str, float]:
        watch = Stopwatch(amounts)
        batches = blocks(data, amounts.batch_size, amounts.data_seed + i, amounts.device)
        bare_loop(student(data, width, amounts), batches, data.half_range, config, watch)
        return {RATE: watch.rate(config.batch_size)}

    return turn


def blocks(
    data: Demonstrations, batch_size: int, seed: int, device: str
) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
    """Batches without end, of equally many rows per task, sorted by task."""
    generator = torch.Generator(device).manual_seed(seed)
    obs, acts = torch.from_numpy(data.obs).to(device), torch.from_numpy(data.acts).to(device)
    rows_of = [torch.from_numpy(np.flatnonzero(data.task == k)).to(device) for k in range(len(data.tasks))]
    share = batch_size // len(rows_of)
    while True:
        shuffled = [
            rows_of_task[torch.randperm(len(rows_of_task), generator=generator, device=device)]
            for rows_of_task in rows_of
        ]
        for i in range(min(map(len, shuffled)) // share):
            index = torch.cat([rows_of_task[i * share : (i + 1) * share] for rows_of_task in shuffled])
            yield obs.index_select(0, index), acts.index_select(0, index)


def bare_loop(
    policy: MultiHeadPolicy,
    batches: Iterable[tuple[torch.Tensor, torch.Tensor]],
    half_range: np.ndarray,
    config: BCConfig,
    after_step: Callable[[], Any],
) -> None:
    """Train a policy's actor on batches that hold equally many rows of every task, sorted by task."""
    inputs, outputs, n_tasks = policy.obs_normalizer, policy.act_normalizer, policy.n_tasks
    radians = torch.as_tensor(half_range, dtype=torch.float32, device=policy.device)
    weights = list(policy.actor.parameters())
    optimizer = torch.optim.AdamW(weights, lr=config.learning_rate, weight_decay=config.weight_decay, fused=True)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, config.learning_rate, total_steps=config.steps + 1, pct_start=config.warmup, cycle_momentum=False
    )
    for obs, acts in itertools.islice(batches, config.steps):
        x = ((obs[:, :-n_tasks] - inputs.shift) / inputs.scale).clamp(-policy.clip_sd, policy.clip_sd)
        features = policy.actor.trunk(x).chunk(n_tasks)
        y = torch.cat([head(part) for head, part in zip(policy.actor.heads, features)])
        error = (outputs.shift + outputs.scale * y - acts) * radians
        error.square().view(n_tasks, -1).mean(dim=1).sum().backward()
        torch.nn.utils.clip_grad_norm_(weights, config.max_grad_norm)
        optimizer.step()
        optimizer.zero_grad()
        schedule.step()
        after_step()


def stock(data: Demonstrations, width: int, amounts: TrainingOptions, their_network: bool) -> Turn:
    """`imitation`'s BC with its own loader, loss and optimizer.

    Args:
        data: the demonstrations.
        width: units per hidden layer.
        amounts: how much of everything.
        their_network: whether stable-baselines3's policy with three hidden layers is trained, or our multi-head policy.
    """
    transitions = as_transitions(data)
    spaces = _spaces(data)

    def turn(i: int) -> dict[str, float]:
        layers: Sequence[int] = [width] * 3
        policy = (
            ActorCriticPolicy(*spaces, lambda _: 1e-3, net_arch=layers, activation_fn=torch.nn.ELU)
            if their_network
            else student(data, width, amounts)
        )
        trainer = imitation_bc.BC(
            observation_space=spaces[0],
            action_space=spaces[1],
            rng=np.random.default_rng(amounts.data_seed + i),
            policy=policy,
            demonstrations=transitions,
            batch_size=amounts.batch_size,
            device=amounts.device,
            custom_logger=make_logger(),
        )
        watch = Stopwatch(amounts)
        trainer.train(n_batches=amounts.steps + WARM_UP, on_batch_end=watch, progress_bar=False)
        return {RATE: watch.rate(amounts.batch_size)}

    return turn


def as_transitions(data: Demonstrations) -> Transitions:
    """All rows as `imitation` wants them; arrays are copied, for it makes its own read-only."""
    return Transitions(
        obs=data.obs.copy(),
        acts=data.acts.copy(),
        infos=np.full(len(data), {}, dtype=object),
        next_obs=np.roll(data.obs, -1, axis=0),
        dones=np.roll(data.starts, -1),
    )


def _spaces(data: Demonstrations) -> tuple[Box, Box]:
    return Box(-50, 50, (data.obs.shape[1],), np.float32), Box(-1, 1, (data.acts.shape[1],), np.float32)
