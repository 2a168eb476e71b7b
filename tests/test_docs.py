"""README.md and docs/: their code runs, their commands, files and names exist, their numbers are the code's."""

import re
import sys
from dataclasses import fields
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import experts
import go1_mtl_gym
import trainers
from docs._ext.help_text import help_of
from docs._ext.tables import TABLES, described, markdown
from experiments.catalog import STUDIES
from experts import MPCConfig
from go1_mtl_gym import EnvConfig, PhysicsParams, episode, gaits
from go1_mtl_gym.rendering import why_no_pictures
from trainers.cli.program import COMMANDS as CLI_COMMANDS
from trainers.evaluation import scoring

ROOT = Path(__file__).resolve().parents[1]
PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md")))
    if not path.is_relative_to(ROOT / "docs" / "results") and "_build" not in path.parts
}
"""What people wrote; docs/results is written by a program."""


def blocks(language: str, *names: str) -> list[str]:
    """Code blocks of a language, of some pages or of all."""
    pattern = rf"^```{language}\n(.*?)^```"
    return [code for name in names or PAGES for code in re.findall(pattern, PAGES[name], re.MULTILINE | re.DOTALL)]


SNIPPETS = [
    pytest.param(code, id=f"{Path(name).stem}-{number}")
    for name in PAGES
    for number, code in enumerate(blocks("python", name), 1)
]
COMMANDS = [*"\n".join(blocks("bash")).splitlines(), *re.findall("`([^`\n]+)`", "\n".join(PAGES.values()))]


def skip_without(*names: str) -> None:
    """Skip where something of a line "# needs one, two and three" is not there."""
    for name in set(names) - {"and"}:
        if name == "OpenGL":
            if why_no_pictures():
                pytest.skip(why_no_pictures())
        else:
            pytest.importorskip(name)


@pytest.mark.parametrize("code", SNIPPETS)
def test_python_runs(code, tmp_path, monkeypatch, capsys, passing_tasks):
    monkeypatch.chdir(tmp_path)
    for name in ("MINARI_DATASETS_PATH", "WANDB_MODE", "WANDB_SILENT"):
        monkeypatch.setenv(name, "")  # set back after the test
    skip_without(*re.findall(r"\w+", "".join(re.findall(r"\A# needs (.*)", code))))
    exec(compile(code, "snippet", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out or "print(" not in code


def test_the_readme_is_short():
    assert len(PAGES["README.md"].splitlines()) <= 200
    assert len(PAGES["README.md"].split()) <= 1500


@pytest.mark.parametrize("name", PAGES)
def test_links_lead_somewhere(name):
    folder = (ROOT / name).parent
    targets = set(re.findall(r"\]\(([^)#:]+)[)#]", PAGES[name]))
    assert not [target for target in sorted(targets) if not (folder / target).exists()]


def test_named_files_exist():
    pattern = r"(?<![\w/.])((?:examples|experts|experiments|trainers|go1_mtl_gym|constraints|tests)/[\w/.-]+\.\w+)"
    named = set(re.findall(pattern, "\n".join(PAGES.values())))
    assert len(named) > 5
    assert not [name for name in sorted(named) if not (ROOT / name).is_file()]


@pytest.mark.parametrize(
    "use_old_name",
    [
        lambda: trainers.PerturbationConfig(kick=0.1, kick_interval=2.0, corner_share=0.2),
        lambda: go1_mtl_gym.PerturbationWrapper(go1_mtl_gym.Go1Env(), kick=0.1),
        lambda: go1_mtl_gym.DomainRandomization(share=0.3),
        lambda: import_module("go1_mtl_gym.realism").Realism,
        lambda: go1_mtl_gym.Go1Env().realism,
        lambda: experts.NMPCConfig(linearisation="shifted"),
        lambda: import_module("experts.phase").fit_phase,
        lambda: trainers.ClocklessPolicy,
        lambda: trainers.learn_without_clock,
        lambda: trainers.evaluate_switch,
        lambda: trainers.load_pretrained("clockless"),
    ],
)
def test_names_of_the_version_before_work_as_the_page_on_migrating_says(use_old_name):
    sys.modules.pop("experts.phase", None)  # it warns when it is imported
    with pytest.warns(DeprecationWarning):
        assert use_old_name() is not None


def test_named_studies_exist():
    lines = "\n".join(COMMANDS)
    named = set(re.findall(r"\b(?:experiments run|study) ([a-z]\w+)", lines))
    assert len(named) > 5
    assert named <= set(STUDIES)


def test_named_commands_and_their_options_exist():
    lines = [line.split("#")[0] for line in COMMANDS if re.match(r"(\.venv/bin/)?go1-mtl-gym [a-z]", line)]
    assert {line.split()[1] for line in lines} >= {"list", "doctor", "play", "train", "evaluate", "certify"}
    for line in lines:
        command = line.split()[1]
        known = help_of(command) if command in CLI_COMMANDS else ""
        assert known, line
        assert not [option for option in re.findall(r" (--[a-z.-]+)", line) if option not in known], line


def test_make_targets_exist():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = {target for command in COMMANDS for target in re.findall(r"\bmake ([a-z][a-z-]+)", command)}
    assert {"dagger", "test", "test-newest", "docs"} <= targets
    assert not [target for target in targets if not re.search(rf"^{target}[: ]", makefile, re.MULTILINE)]


@pytest.mark.parametrize("package", [go1_mtl_gym, experts, trainers])
def test_the_api_reference_has_every_public_name(package):
    page = PAGES[f"docs/api/{package.__name__}.md"]
    assert set(re.findall(r"^\.\. auto\w+:: (\w+)$", page, re.MULTILINE)) == set(package.__all__)


@pytest.mark.parametrize("config", [EnvConfig, PhysicsParams])
def test_every_argument_of_the_environment_is_described(config):
    assert set(described(config)) == {each.name for each in fields(config)}


def test_a_docstring_is_read_entry_by_entry():
    class Owner:
        """Something.

        Args:
            first, second: of two
                lines, ``code``.
            third: one.

        Raises:
            fourth: never.
        """

    assert described(Owner) == {"first": "of two lines, `code`.", "second": "of two lines, `code`.", "third": "one."}


def test_a_table_sets_numbers_right():
    assert markdown(("a", "b"), [("x", 1), ("y", "± 2.5")]).splitlines() == [
        "| a | b |",
        "| :-- | --: |",
        "| x | 1 |",
        "| y | ± 2.5 |",
    ]


@pytest.mark.parametrize("name", TABLES)
def test_tables_are_whole(name):
    header, rule, *rows = TABLES[name]().splitlines()
    assert rows
    assert {line.count("|") for line in (rule, *rows)} == {header.count("|")}


@pytest.mark.parametrize("name", TABLES)
def test_tables_hold_no_tags_that_a_browser_would_swallow(name):
    text = re.sub(r"`[^`]*`|\$[^$]*\$", "", TABLES[name]())
    assert not re.findall(r"(?<!\\)<\w+>?", text)


def test_pages_ask_for_tables_that_exist():
    asked = set(re.findall(r"```\{code-table\} (\w+)", "\n".join(PAGES.values())))
    assert asked == set(TABLES)


def test_numbers_in_the_text_are_the_codes():
    text = " ".join(" ".join(PAGES.values()).split())
    assert f"N = {MPCConfig().steps} intervals" in text
    assert f"at most {scoring.VELOCITY_TOLERANCE} m/s" in text
    assert f"within {100 * scoring.STEP_RATE_TOLERANCE:.0f} % of the gait's" in text
    assert f"after the first {scoring.SETTLE_S:g} s" in text
    assert scoring.MIN_AIR_SHARE == 0.5 and "at least half of its planned swing" in text
    assert f"trunk below {episode.FALLEN_HEIGHT} m" in text
    assert f"tilted by more than {np.degrees(np.arccos(episode.FALLEN_COSINE)):.0f} degrees" in text
    assert f"time constant is {episode.COMMAND_FILTER_S} s" in text
    assert f"at most {episode.COMMAND_SLEW[0]:g} m/s and {episode.COMMAND_SLEW[2]:g} rad/s per second" in text
    assert f"below {gaits.STAND_COMMAND[0]} m/s and {gaits.STAND_COMMAND[2]} rad/s" in text
