"""The main job: settings with presets, resumable stages, and the baselines that a trained policy is compared with."""
