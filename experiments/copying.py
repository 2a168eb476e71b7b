"""What is published of the folders that the main job and `trainers.certify` write."""

import shutil
from pathlib import Path

import trainers
from experiments import main_job
from experiments.results import without_folders
from go1_mtl_gym.errors import InvalidInputError
from trainers import Certificate
from trainers.evaluation.agents import identity
from trainers.evaluation.certificate import FILE
from trainers.utils.files import read_object, write_atomically

COPIED = ("joint_targets.png", "gaits.gif")
"""Files of a run that are published as they are."""
FILM = "hero.webp"
"""A policy of the package on a tour through its gaits, made anew with every `SHIPPED_PRESET` run."""
POLICIES = {"policy.zip": "clocked.zip", "phase_free.zip": "phase_free.zip"}
"""Policies of a run, and their names in ``trainers/assets/``, from where `trainers.load_pretrained` reads them."""
FILMED = "policy.zip"
"""The one that `FILM` shows."""
PUBLISHED_PRESET, SHIPPED_PRESET = "default", "shipped"
"""Of the run whose metrics are published, and of the one whose policies come with the package."""
SETTINGS = "config.json"
"""File of a run that says what its settings are."""
CERTIFICATES = "certificate_*.json"
"""What `trainers.certify` found out about the policies that come with the package, and about the expert."""


def copy_run(run: Path, root: Path) -> None:
    """Copy what is published of a run; the output folder, which only its machine knows, is cut from the command.

    Of a run of the preset "default" these are the metrics and pictures, of one of "shipped" the policies, of which a
    film is made; those need not have been evaluated yet, which certificates do.

    Args:
        run: output folder of the main job.
        root: of the checkout; results go to ``docs/results``, policies to ``trainers/assets``.

    Raises:
        InvalidInputError: if files are missing (all are named), the metrics cannot be read, or the run is of neither
            preset.
        go1_mtl_gym.rendering.RenderingError: if the film cannot be drawn on this machine.
    """
    preset = read_object(run / SETTINGS, "file of settings").get("preset") if (run / SETTINGS).is_file() else None
    measured = ("metrics.json", *COPIED)
    wanted = {PUBLISHED_PRESET: measured, SHIPPED_PRESET: tuple(POLICIES)}.get(str(preset), (*measured, *POLICIES))
    missing = [name for name in (SETTINGS, *wanted) if not (run / name).is_file()]
    if missing:
        raise InvalidInputError(
            f"{run} lacks {', '.join(missing)}; expected the --out folder of a finished main job"
            + (" (gaits.gif needs OpenGL)" if "gaits.gif" in missing else "")
        )
    if preset == PUBLISHED_PRESET:
        _copy_results(run, root / "docs" / "results")
    elif preset == SHIPPED_PRESET:
        assets = root / "trainers" / "assets"
        film(run / FILMED, root)  # before they are copied: where nothing can be drawn, old policies keep their film
        assets.mkdir(parents=True, exist_ok=True)
        for name, published in POLICIES.items():
            shutil.copyfile(run / name, assets / published)
    else:
        raise InvalidInputError(
            f"a run of the preset {PUBLISHED_PRESET!r} or {SHIPPED_PRESET!r} was expected, {run} is one of {preset!r}"
        )


def film(policy: Path, root: Path) -> None:
    """Drive a policy through `trainers.save_tour`, for the pages that show it; some minutes on software OpenGL.

    Args:
        policy: its file.
        root: of the checkout.

    Raises:
        go1_mtl_gym.rendering.RenderingError: if no picture can be drawn on this machine.
    """
    trainers.save_tour(trainers.load(policy), root / "docs" / "results" / FILM)


def _copy_results(run: Path, folder: Path) -> None:
    metrics = read_object(run / "metrics.json", "file of metrics")
    results = main_job.results_of(metrics, without_folders(metrics.get("command", "")))
    results.write(folder / f"{main_job.NAME}.json")
    for name in COPIED:
        shutil.copyfile(run / name, folder / name)


def is_certificate(folder: Path) -> bool:
    """Whether a folder is one of `trainers.certify`."""
    return (folder / FILE).is_file()


def copy_certificate(folder: Path, root: Path) -> None:
    """Copy a certificate of the expert, or of a policy as it is in the package now.

    Args:
        folder: of the certificate.
        root: of the checkout; it goes to ``docs/results``.

    Raises:
        InvalidInputError: if it is of another policy, or no certificate.
    """
    certificate = Certificate.read(folder)
    name, digest = certificate.policy["name"], certificate.policy["sha256"]
    policy = root / "trainers" / "assets" / f"{name}.zip"
    packaged = identity(policy)["sha256"] if policy.is_file() else None
    if name != "expert" and digest != packaged:
        raise InvalidInputError(
            f"a certificate of the expert or of a policy in the package was expected, {folder} is one of {name!r} with "
            f"SHA-256 {digest}" + (f", the package's has {packaged}" if packaged else "")
        )
    published = root / "docs" / "results" / CERTIFICATES.replace("*", name)
    text = (folder / FILE).read_bytes()
    write_atomically(published, lambda file: file.write(text))
