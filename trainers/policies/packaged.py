"""Which policies come with the package; to be read without PyTorch."""

from importlib import resources

PRETRAINED = {
    "clocked": "the student of the main job's shipped preset",
    "phase_free": "the same without a gait clock",
}
"""Name -> what it is."""
FOLDER = resources.files("trainers") / "assets"
