"""The command line, and the pages that are written from results."""

import hashlib
import json
from pathlib import Path

import pytest

import trainers
from experiments import copying
from experiments.__main__ import main
from experiments.catalog import STUDIES, study_class
from experiments.copying import copy_run
from experiments.main_job import results_of
from experiments.publish import publish_command, summarized
from experiments.results import Results, without_folders
from go1_mtl_gym import InvalidInputError
from go1_mtl_gym.rendering import RenderingError
from tests.experiments.published import FOLDER

README = "# A title\n\n<!-- results:summary -->\nold\n<!-- /results:summary -->\n\nThe end.\n"


def metrics(**change) -> dict:
    """What a run of the main job leaves."""
    loop = {"survival_rate": 1.0, "success_rate": 0.9, "velocity_error": 0.03, "step_rate": 2.5, "episodes": 20}
    loop |= {"success_interval": [0.7, 0.97], "survival_s": 30.0}
    step = {"mse": 1e-5, "mae": 1e-3, "r2": 0.99}
    tasks = {"trot": {"multi_head": step | loop, "expert": loop | {"success_rate": 1.0}}}
    head = {"seed": 4, "versions": {"numpy": "2"}, "seconds": {"clone": 60.0}, "config": {"preset": "default"}}
    return {"tasks": tasks, "command": "python examples/dagger.py --out runs/a --seed 4", **head} | change


@pytest.fixture
def run(tmp_path) -> Path:
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "metrics.json").write_text(json.dumps(metrics()))
    (folder / "config.json").write_text(json.dumps({"preset": "default"}))
    for name in (*copying.COPIED, *copying.POLICIES):
        (folder / name).write_bytes(name.encode())
    return folder


@pytest.fixture
def root(tmp_path) -> Path:
    folder = tmp_path / "root"
    folder.mkdir()
    (folder / "README.md").write_text(README)
    return folder


def test_what_is_committed_is_up_to_date():
    publish_command(["--check"])


def test_a_run_becomes_records_a_page_and_the_summary(run, root):
    publish_command([str(run)], root)
    results = Results.read(root / "docs" / "results" / "main_job.json")
    assert results.command == "python examples/dagger.py --seed 4" and results.seed == 4
    (student,) = results.of(agent="multi_head")
    assert (student["trials"], student["survived"], student["succeeded"]) == (20, 20, 18)
    assert not {"success_rate", "success_interval", "episodes"} & set(student)
    page = (root / "docs" / "results" / "main_job.md").read_text()
    assert "| trot | multi-head student | 0.000010 | 0.0010 | 0.9900 | 18/20 | 20/20 |" in page
    readme = (root / "README.md").read_text()
    assert readme.startswith("# A title\n") and readme.endswith("The end.\n") and "old" not in readme
    assert "| trot | 20/20 | 18/20 | - | - | 0.030 | 0.030 | 2.50 | 2.50 | 2.50 |" in readme
    assert not (root / "trainers" / "assets").exists(), "policies come from the preset for them"
    before = {path: path.stat().st_mtime_ns for path in root.rglob("*") if path.is_file()}
    publish_command([], root)
    publish_command(["--check"], root)
    assert before == {path: path.stat().st_mtime_ns for path in root.rglob("*") if path.is_file()}
    (root / "docs" / "results" / "main_job.md").write_text("typed by hand")
    with pytest.raises(InvalidInputError, match="out of date: docs/results/main_job.md"):
        publish_command(["--check"], root)


@pytest.fixture
def filmed(monkeypatch) -> list:
    """Takes the place of the camera: (policy, file) of each film that was asked for."""
    films = []
    monkeypatch.setattr(trainers, "load", lambda path: Path(path).read_bytes())
    monkeypatch.setattr(trainers, "save_tour", lambda policy, path: films.append((policy, path)))
    return films


def test_a_run_for_the_package_becomes_its_policies_and_their_film(run, root, filmed):
    (run / "config.json").write_text(json.dumps({"preset": "shipped"}))
    (run / "metrics.json").unlink()  # certificates measure these policies
    publish_command([str(run)], root)
    assert filmed == [(b"policy.zip", root / "docs" / "results" / "hero.webp")]
    assert (root / "trainers" / "assets" / "clocked.zip").read_bytes() == b"policy.zip"
    assert (root / "trainers" / "assets" / "phase_free.zip").read_bytes() == b"phase_free.zip"
    assert not (root / "docs" / "results" / "main_job.json").exists()


def test_the_film_can_be_made_anew(root, filmed):
    assets = root / "trainers" / "assets"
    assets.mkdir(parents=True)
    (assets / "clocked.zip").write_bytes(b"in the package")
    publish_command(["--film", "--check"], root)
    assert not filmed
    publish_command(["--film"], root)
    assert filmed == [(b"in the package", root / "docs" / "results" / "hero.webp")]


def test_where_no_film_can_be_made_the_old_policies_stay(run, root, filmed, monkeypatch):
    def fail(policy, path):
        raise RenderingError("no OpenGL")

    monkeypatch.setattr(trainers, "save_tour", fail)
    (run / "config.json").write_text(json.dumps({"preset": "shipped"}))
    (run / "metrics.json").unlink()  # certificates measure these policies
    with pytest.raises(RenderingError):
        publish_command([str(run)], root)
    assert not (root / "trainers").exists()


def test_certificates_get_their_page(root, tmp_path):
    published = root / "docs" / "results" / "certificate_expert.json"
    few = {"tasks": ("trot",), "conditions": ("drawn",), "episodes": 1, "seconds": 3.0}
    certificate = trainers.certify("expert", tmp_path / "c", **few)
    publish_command([str(tmp_path / "c")], root)
    assert published.read_bytes() == (tmp_path / "c" / "certificate.json").read_bytes()
    assert published.with_suffix(".md").read_text() == certificate.markdown()


def test_only_certificates_of_what_is_in_the_package_are_published(root, tmp_path):
    values = json.loads((FOLDER / "certificate_clocked.json").read_text())
    (tmp_path / "certificate.json").write_text(json.dumps(values))
    with pytest.raises(InvalidInputError, match=f"one of 'clocked' with SHA-256 {values['policy']['sha256']}$"):
        publish_command([str(tmp_path)], root)
    assets = root / "trainers" / "assets"
    assets.mkdir(parents=True)
    (assets / "clocked.zip").write_bytes(b"another")
    with pytest.raises(InvalidInputError, match="the package's has [0-9a-f]{64}$"):
        publish_command([str(tmp_path)], root)
    values["policy"]["sha256"] = hashlib.sha256(b"another").hexdigest()
    (tmp_path / "certificate.json").write_text(json.dumps(values))
    publish_command([str(tmp_path)], root)
    assert (root / "docs" / "results" / "certificate_clocked.md").is_file()


@pytest.mark.parametrize("name", ["metrics.json", "gaits.gif", "joint_targets.png"])
def test_a_missing_file_is_named_before_anything_is_copied(run, root, name):
    (run / name).unlink()
    with pytest.raises(InvalidInputError, match=name):
        copy_run(run, root)
    assert not (root / "docs").exists()


def test_other_runs_are_refused(run, root):
    (run / "config.json").write_text(json.dumps({"preset": "smoke"}))
    with pytest.raises(InvalidInputError, match="'smoke'"):
        copy_run(run, root)
    with pytest.raises(InvalidInputError, match="metrics of a finished run"):
        results_of({"tasks": {}}, "")


@pytest.mark.parametrize("text", ["", README.replace("/results", "results"), README + README])
def test_missing_markers_are_named(text):
    with pytest.raises(InvalidInputError, match="<!-- results:summary -->"):
        summarized(text, "table")


def test_no_path_of_the_machine_is_published(tmp_path):
    command = "python -m experiments run student_pushes"
    assert without_folders(f"{command} --out {tmp_path} --cache={tmp_path} --seed 2") == f"{command} --seed 2"
    assert without_folders(f"run benchmark_expert --go2-convex-mpc {tmp_path}").endswith(" --go2-convex-mpc PATH")
    assert without_folders("python examples/dagger.py --out=a --seed 3 --out b") == "python examples/dagger.py --seed 3"


def test_published_results_have_their_studies_and_their_pictures():
    published = [name for name in STUDIES if (FOLDER / f"{name}.json").is_file()]
    certificates = {path.stem for path in FOLDER.glob(copying.CERTIFICATES)}
    assert {path.stem for path in FOLDER.glob("*.json")} == {*published, *certificates, "main_job"}
    assert len(published) > 20
    for name in published:
        cls, path = study_class(name), FOLDER / f"{name}.json"
        assert cls.name == name and Results.read(path).study == name
        for end, caption in ({"": cls.caption} | cls.more_captions).items():
            assert not caption or (FOLDER / f"{name}{end}.png").is_file()
        study = cls(cls.full)
        assert study.table(Results.read(path)).count("\n") >= 2
        assert (study.figure(Results.read(path)) is None) == (not cls.caption)


# -- The command line --------------------------------------------------------------------------------------------------


def test_every_study_is_listed(capsys):
    assert main(["list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(STUDIES)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ("no_such_study", "no_such_study"),
        ("student_budget --seed -1", "-1"),
        ("student_budget --n-jobs 0", "n_jobs"),
        ("student_budget --budgets-s 10 30", "twice"),
        ("student_pushes --policy missing.zip", "missing.zip"),
        ("student_pushes --only hop --quick", "hop"),
        ("paper_simulation --precision half", "half"),
        ("new_gaits --gaits trot", "trot"),
    ],
)
def test_impossible_commands_are_refused_in_a_sentence(arguments, reason, tmp_path, capsys):
    folders = ["--out", str(tmp_path / "out"), "--cache", str(tmp_path / "cache")]
    assert main(["run", *arguments.split(), *folders]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1 and reason in error
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_quick_run_writes_results_and_picture_and_goes_on(tmp_path, capsys):
    arguments = ["run", "student_transitions", "--quick", "--n-jobs", "1", "--only", "to walk"]
    folders = ["--out", str(tmp_path), "--cache", str(tmp_path / "cache")]
    assert main([*arguments, *folders]) == 0
    first = (tmp_path / "student_transitions.json").read_text()
    assert (
        "| expert | trot |" in capsys.readouterr().out and (tmp_path / "student_transitions.png").stat().st_size > 5000
    )
    results = Results.read(tmp_path / "student_transitions.json")
    assert len(results.records) == 10 and results.command.endswith("--quick --n-jobs 1 --only 'to walk'")
    cells = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.json")}
    assert len(cells) == 10 and main([*arguments, *folders]) == 0
    assert (tmp_path / "student_transitions.json").read_text() == first
    assert cells == {path: path.stat().st_mtime_ns for path in cells}


@pytest.mark.parametrize("option", ["--out", "--cache"])
def test_a_place_that_cannot_be_written_is_refused_before_anything_is_measured(option, tmp_path, capsys):
    (tmp_path / "file").write_text("taken")
    folders = {"--out": str(tmp_path / "out"), "--cache": str(tmp_path / "cache"), option: str(tmp_path / "file")}
    arguments = [word for pair in folders.items() for word in pair]
    assert main(["run", "student_pushes", "--quick", *arguments]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert not list(tmp_path.rglob("*.json"))
