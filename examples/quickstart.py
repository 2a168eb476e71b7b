import sys

import gymnasium as gym

import trainers

policy = trainers.load(sys.argv[1]) if len(sys.argv) > 1 else trainers.load_pretrained()
env = gym.make("go1_mtl_gym:Go1Trot-v0", **policy.env_kwargs)
obs, info = env.reset(seed=0, options={"command": (0.5, 0.0, 0.0)})
for _ in range(250):
    action, _ = policy.predict(obs, deterministic=True)
    obs, reward, terminated, truncated, info = env.step(action)
print(f"{info['task']}, fallen: {info['fallen']}, (vx, vy, yaw rate): {info['base_velocity'].round(2)}")
