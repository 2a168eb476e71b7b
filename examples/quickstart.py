import sys

import gymnasium as gym

import trainers

policy = trainers.load(sys.argv[1]) if len(sys.argv) > 1 else None  # runs/<date>/policy.zip
env = gym.make("go1_mtl_gym:Go1Trot-v0", **(policy.env_kwargs if policy else {}))
obs, info = env.reset(seed=0, options={"command": (0.5, 0.0, 0.0)})
for _ in range(250):
    action = policy.predict(obs, deterministic=True)[0] if policy else env.unwrapped.expert_action()
    obs, reward, terminated, truncated, info = env.step(action)
print(f"{info['task']}, fallen: {info['fallen']}, (vx, vy, yaw rate): {info['base_velocity'].round(2)}")
