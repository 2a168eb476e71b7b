"""The paper's tables: commands, shards, students, sums, page and figures by hand, and a quick run."""

import dataclasses
import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

import trainers
from go1_mtl_gym import TASKS, InvalidInputError

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))

import reproduce_paper  # noqa: E402
from paper_report import config as paper_config  # noqa: E402
from paper_report import data as paper_data  # noqa: E402
from paper_report import figures as paper_figures  # noqa: E402
from paper_report import page as paper_page  # noqa: E402
from paper_report import published as paper_published  # noqa: E402
from paper_report import students as paper_students  # noqa: E402
from paper_report import sums as paper_sums  # noqa: E402

from trainers.report import PAPER_R2  # noqa: E402

TABLE = paper_config.Table(
    "simulation", ("trot", "bound"), {"control_hz": 50}, dict.fromkeys(("trot", "bound"), (0.5, 0.2, 0.0))
)
TINY = dataclasses.replace(paper_config.QUICK, seconds=0.4, widths=(8,), steps=12, batch_size=16, curve_rows=5)


def student(kind="multi_head", width=512, seed=0, r2=0.99, mse=0.001, gait=None, use="named", steps=100):
    """What is known of a student of trot and bound; bound's R2 is 0.001 lower."""
    gaits = [gait] if gait else ["trot", "bound"]
    figures = {"mse": mse, "mae": 10 * mse}
    scores = {name: figures | {"r2": r2 - 0.001 * (name == "bound"), "r2_joint_mean": r2 - 0.01} for name in gaits}
    return {
        "kind": kind,
        "width": width,
        "seed": seed,
        "gait": gait,
        "steps": steps,
        "scores": {use: scores},
        "curve": {"steps": [50, 100], "mse": {name: [0.1, mse] for name in gaits}},
        "seconds": 30.0,
        "samples_per_s": 1000,
        "device": "cpu",
        "threads": 1,
    }


# -- What is published -------------------------------------------------------------------------------------------------


def test_the_papers_figures_are_those_of_the_other_table():
    for table, gaits in paper_published.PUBLISHED.items():
        assert set(gaits) == set(paper_config.TABLES[table].gaits) == set(paper_sums.AIMS[table])
    for gait, (multi, single, where) in PAPER_R2.items():
        own = paper_published.PUBLISHED[where][gait]
        assert own["multi_head"]["r2"] == multi and own.get("pooled", {}).get("r2") == single


def test_the_papers_errors_belong_together():
    # MSE / (1 - R2) is the variance of the held-out targets, about the same for both networks of a gait.
    own = paper_published.PUBLISHED["simulation"]
    variance = {gait: [x["mse"] / (1 - x["r2"]) for x in kinds.values()] for gait, kinds in own.items()}
    assert variance["trot"] == pytest.approx([0.00656, 0.00646], abs=1e-5)
    for values in variance.values():
        assert max(values) < 1.12 * min(values)
    assert all(x["mse"] >= x["mae"] ** 2 for kinds in own.values() for x in kinds.values())


# -- Settings ----------------------------------------------------------------------------------------------------------


def test_the_full_settings_are_the_papers():
    full, simulation, hardware = paper_config.FULL, *paper_config.TABLES.values()
    assert full.train_commands * full.seconds * simulation.env_kwargs["control_hz"] == 600_000
    assert simulation.named == {"trot": (0.7, 0.3, 0.0), "jump": (0.6, 0.3, 0.0), "bound": (0.5, 0.2, 0.0)}
    assert hardware.gaits == ("trot", "walk") and hardware.env_kwargs["control_hz"] == 500
    assert hardware.env_kwargs["estimator_noise"] and not hardware.named
    assert len(full.seeds) == 5 and full.normalization == "min_max"


@pytest.mark.parametrize(
    "change",
    [
        {"train_commands": 0},
        {"unseen_commands": 101},
        {"seconds": 31.0},
        {"seed": -1},
        {"widths": ()},
        {"widths": (8, 8)},
        {"seeds": (-1,)},
        {"steps": 0},
        {"span": (0.8, 0.0)},
        {"gap": -0.1},
        {"space": "degrees"},
        {"curve_rows": 0},
    ],
)
def test_impossible_settings_are_refused(change):
    with pytest.raises(InvalidInputError):
        dataclasses.replace(paper_config.FULL, **change)


def test_a_named_command_beyond_the_limit_is_refused():
    with pytest.raises(InvalidInputError, match="jump"):
        paper_config.Table("a", ("jump",), {}, {"jump": (0.6, 0.7, 0.0)})


def test_commands_are_named_for_all_gaits_or_none():
    with pytest.raises(InvalidInputError, match="none or all"):
        paper_config.Table("a", ("jump", "trot"), {}, {"jump": (0.6, 0.3, 0.0)})


def test_a_network_of_one_gait_draws_as_many_of_its_rows():
    config = dataclasses.replace(paper_config.FULL, batch_size=900, steps=400, curve_points=40)
    assert [config.bc(3, share).batch_size for share in (1.0, 1 / 3)] == [900, 300]
    assert config.bc(3, 1.0).log_interval == 10 and config.bc(3, 1.0).seed == 3


def test_commands_are_drawn_within_what_the_expert_survives(passing_tasks):
    assert paper_config.FULL.largest("jump").tolist() == [0.8, 0.5, 0.0]
    wide = dataclasses.replace(paper_config.FULL, span=(0.8, 1.5))
    assert wide.largest("jump").tolist() == [0.8, TASKS["jump"].command_limit[1], 0.0]


# -- Commands and shards -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("table", paper_config.TABLES.values(), ids=lambda table: table.name)
def test_held_out_commands_keep_away_from_all_others(table):
    config = dataclasses.replace(paper_config.FULL, gap=0.12)
    for gait in table.gaits:
        own = paper_data.commands(table, gait, config)
        assert [len(own[use]) for use in ("train", "named", "unseen")] == [20, gait in table.named, 10]
        train, held = np.array(own["train"]), np.array(own["named"] + own["unseen"])
        assert np.linalg.norm(train[:, None] - held, axis=2).min() >= 0.12
        drawn = np.abs([*own["train"], *own["unseen"]])
        assert (drawn <= config.largest(gait)).all() and (drawn[:, :2].max(axis=0) > [0.6, 0.35]).all()


def test_commands_come_from_the_seed():
    first, same = (paper_data.commands(TABLE, "trot", TINY) for _ in range(2))
    other = paper_data.commands(TABLE, "trot", dataclasses.replace(TINY, seed=1))
    assert first == same and first["train"] != other["train"] and first["unseen"] != other["unseen"]
    assert first["train"] != paper_data.commands(TABLE, "bound", TINY)["train"]


def test_more_commands_than_there_is_room_for_are_refused():
    rng = np.random.default_rng(0)
    with pytest.raises(InvalidInputError, match="room"):
        paper_data.draw_apart(rng, 1, np.array([0.1, 0.1, 0.0]), [(0.0, 0.0, 0.0)], 0.2)


def test_no_two_shards_share_a_seed():
    jobs = paper_data.shard_jobs(paper_config.SIMULATION, paper_config.FULL)
    other = paper_data.shard_jobs(paper_config.SIMULATION, dataclasses.replace(paper_config.FULL, seed=1))
    names = [job.name for table in (jobs, other) for own in table.values() for job in own]
    assert len(set(names)) == len(names) == 2 * 3 * (20 + 1 + 10)
    assert all(job.perturbation is None and job.seconds == 30.0 for job in jobs["train"])
    assert [job.command for job in jobs["named"]] == [
        paper_config.SIMULATION.named[gait] for gait in ("trot", "jump", "bound")
    ]


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Demonstrations of `TABLE` at 50 Hz."""
    return paper_data.collect(TABLE, TINY, tmp_path_factory.mktemp("paper"), 1, progress=False)


def test_shards_are_sorted_by_use_and_made_once(data):
    assert {use: len(paths) for use, paths in data.paths.items()} == {"train": 4, "named": 2, "unseen": 2}
    assert data.tests == ("named", "unseen") and list(data.rows("named").per_task()) == ["trot", "bound"]
    assert data.rows("train").obs.shape == (4 * 20, 34 + 2)
    before = {path: path.stat().st_mtime_ns for own in data.paths.values() for path in own}
    assert paper_data.collect(TABLE, TINY, data.folder.parent, 1, progress=False) == data
    assert before == {path: path.stat().st_mtime_ns for path in before}
    more = paper_data.shard_jobs(TABLE, dataclasses.replace(TINY, seconds=0.5))
    assert more != paper_data.shard_jobs(TABLE, TINY)


def test_falls_are_counted(data, tmp_path):
    def shard(name, gait, starts):
        own = data.rows("train").per_task()[gait].take(np.arange(10))
        marks = np.zeros(10, dtype=bool)
        marks[starts] = True
        path = tmp_path / f"{name}.npz"
        dataclasses.replace(own, starts=marks, meta={"job": {"task": gait}}).save(path)
        return path

    paths = {"train": (shard("a", "trot", [0, 4, 9]), shard("b", "trot", [0])), "named": (shard("c", "bound", [0, 1]),)}
    assert paper_data.PaperData(tmp_path, paths).account() == {
        "train": {"trot": {"seconds": pytest.approx(0.4), "falls": 2}},
        "named": {"bound": {"seconds": pytest.approx(0.2), "falls": 1}},
    }


# -- Students ----------------------------------------------------------------------------------------------------------


def test_every_network_is_asked_for_once():
    config = dataclasses.replace(TINY, widths=(8, 16), seeds=(3, 4))
    own = paper_students.students(TABLE, ("pooled", "per_gait"), config)
    assert len(own) == len({each.name for each in own}) == 2 * 2 * (1 + 2)
    assert [each.width for each in own] == [8] * 6 + [16] * 6
    assert {each.gait for each in own if each.kind == "per_gait"} == {"trot", "bound"}


@pytest.mark.parametrize("change", [{"kind": "a"}, {"gait": "trot"}, {"kind": "per_gait"}, {"width": 0}, {"seed": -1}])
def test_impossible_students_are_refused(change):
    with pytest.raises(InvalidInputError):
        paper_students.Student(**({"kind": "pooled", "width": 8, "seed": 0} | change))


def test_a_folder_is_named_by_what_makes_its_students(data):
    def folder(**change):
        return paper_students.School(TABLE, dataclasses.replace(TINY, **change), data).folder

    for unused in ({"steps": 5}, {"seeds": (7,)}, {"widths": (9,)}, {"curve_points": 1}):
        assert folder(**unused) == folder()
    used = ({"batch_size": 32}, {"learning_rate": 1e-3}, {"normalization": "none"}, {"space": "normalized"})
    assert len({folder(), *(folder(**own) for own in used)}) == 5


def test_thinned_rows_are_spread_over_the_gait(data):
    rows = data.rows("train")
    own = paper_students.thinned(rows, 15)
    assert {gait: len(part) for gait, part in own.per_task().items()} == {"trot": 15, "bound": 15}
    assert len(paper_students.thinned(rows, 1000)) == len(rows) == 80
    np.testing.assert_array_equal(own.obs, paper_students.thinned(rows, 15).obs)
    places = [np.flatnonzero((rows.obs == row).all(axis=1))[0] for row in own.per_task()["trot"].obs]
    assert places == sorted(places) and len(set(np.diff(places))) > 2


@pytest.fixture(scope="module")
def school(data):
    """A school whose students of one seed are taught."""
    own = paper_students.School(TABLE, TINY, data)
    threads = torch.get_num_threads()
    for each in paper_students.students(TABLE, tuple(paper_published.KINDS), dataclasses.replace(TINY, seeds=(1,))):
        own.teach(each)
    assert torch.get_num_threads() == threads
    return own


def test_a_student_is_measured_on_what_was_held_out(school, data):
    for own in school.finished(("multi_head", "pooled", "per_gait")):
        path = school.file(paper_students.Student(own["kind"], own["width"], own["seed"], own["gait"]))
        policy = trainers.load(path.with_suffix(".zip"))
        rows = paper_students.thinned(data.rows("unseen"), 10**6)
        found = trainers.offline_metrics(policy, rows)
        gaits = [own["gait"]] if own["gait"] else ["trot", "bound"]
        assert list(own["scores"]["unseen"]) == gaits
        for gait in gaits:
            assert own["scores"]["unseen"][gait] == pytest.approx(found[gait], rel=1e-4)
        assert policy.pooled == (own["kind"] != "multi_head") and policy.width == 8
        rate = own["steps"] * (8 if own["gait"] else 16) / own["seconds"] if own["seconds"] > 1 else None
        assert rate is None or own["samples_per_s"] == pytest.approx(rate, rel=0.1)


def test_the_curve_ends_at_the_error_of_the_finished_student(school, data):
    multi, *_ = school.finished(("multi_head",))
    policy = school.widest("multi_head")
    shown = trainers.Demonstrations.concatenate([data.rows("named"), data.rows("unseen")])
    found = trainers.offline_metrics(policy, paper_students.thinned(shown, TINY.curve_rows))
    assert multi["curve"]["steps"] == [4, 8, 12]
    for gait, values in multi["curve"]["mse"].items():
        assert len(values) == 3 and values[-1] == pytest.approx(found[gait]["mse"], rel=1e-4)


def test_networks_of_one_gait_learn_nothing_of_the_other(school):
    trot = next(own for own in school.finished(("per_gait",)) if own["gait"] == "trot")
    policy = trainers.load(school.file(paper_students.Student("per_gait", 8, 1, "trot")).with_suffix(".zip"))
    rows = school.data.rows("train").per_task()
    low, high = rows["trot"].acts.min(0), rows["trot"].acts.max(0)
    np.testing.assert_allclose(policy.act_normalizer.shift.numpy(), (low + high) / 2, atol=1e-6)
    assert list(trot["curve"]["mse"]) == ["trot"]


def test_students_are_taught_once_and_wider_ones_are_added(school, monkeypatch):
    kept = {path: path.stat().st_mtime_ns for path in school.folder.iterdir()}
    wider = dataclasses.replace(school, config=dataclasses.replace(TINY, widths=(8, 12), seeds=(1,), steps=4))
    assert wider.folder == school.folder
    paper_students.teach_all(wider, [paper_students.Student("pooled", 12, 1)], 1)
    monkeypatch.setattr(trainers, "train_bc", None)
    paper_students.teach_all(school, [paper_students.Student("pooled", 8, 1)], 1)
    assert kept == {path: path.stat().st_mtime_ns for path in kept}
    assert [(own["width"], own["steps"]) for own in school.finished(("pooled",))] == [(8, 12), (12, 4)]
    assert school.widest("pooled").width == 12 and school.widest("multi_head").width == 8


# -- Sums --------------------------------------------------------------------------------------------------------------


def test_intervals_are_students_t():
    # n = 5: mean 3, s = sqrt(2.5), t = 2.776: half width 1.963. n = 2: t = 12.706, s = sqrt(2) / 2.
    assert paper_sums.estimate([1, 2, 3, 4, 5]) == pytest.approx((3.0, 2.776445 * math.sqrt(2.5 / 5), 5), rel=1e-6)
    assert paper_sums.estimate([0.0, 1.0]) == pytest.approx((0.5, 12.706205 * 0.5, 2), rel=1e-6)
    single = paper_sums.estimate([0.7])
    assert single.mean == 0.7 and math.isnan(single.half) and single.count == 1


def test_students_of_one_width_and_duration_are_one_learner():
    own = [student(seed=0, r2=0.98), student(seed=1, r2=0.99), student(width=2560), student(steps=7)]
    own += [student("per_gait", gait="trot", seed=s) for s in (0, 1, 2)] + [student("pooled")]
    names = [(learner.width, learner.steps, learner.kind) for learner in paper_sums.learners(own)]
    assert names == [
        (512, 7, "multi_head"),
        (512, 100, "multi_head"),
        (512, 100, "pooled"),
        (512, 100, "per_gait"),
        (2560, 100, "multi_head"),
    ]
    trot, bound = (paper_sums.scores(own, gait, "named") for gait in ("trot", "bound"))
    assert [each["r2"].count for each in trot.values()] == [1, 2, 1, 3, 1]
    assert [learner.kind for learner in bound] == ["multi_head", "multi_head", "pooled", "multi_head"]
    assert trot[paper_sums.Learner(512, 100, 0)]["r2"].mean == pytest.approx(0.985)
    assert paper_sums.scores(own, "trot", "unseen") == {}


def test_a_verdict_needs_more_than_the_aim_and_every_figure():
    own = [student(r2=0.991, mse=0.001), student("pooled", r2=0.9905, mse=0.001)]
    trot, bound = paper_sums.verdicts("simulation", own)[0], paper_sums.verdicts("simulation", own)[-1]
    assert (trot["gait"], trot["r2"], trot["reached"]) == ("trot", 0.991, True)
    assert trot["worse"] == ["mse", "mae"]
    assert (bound["gait"], bound["reached"]) == ("bound", False)  # 0.990 is not above 0.99
    assert paper_sums.verdicts("simulation", own[:1])[0]["worse"] is None
    better = [student(mse=0.0009, r2=0.995), student("pooled", r2=0.9905, mse=0.001)]
    assert [each["worse"] for each in paper_sums.verdicts("simulation", better)] == [[], []]
    wide = [student(width=2560), student("pooled", width=512)]
    assert all(each["worse"] is None for each in paper_sums.verdicts("simulation", wide))


# -- Page and figures --------------------------------------------------------------------------------------------------


def test_scores_stand_beside_the_papers():
    own = [student(seed=seed, r2=0.99 + 0.001 * seed) for seed in (0, 1, 2)]
    lines = paper_page.score_table("simulation", own, "named", paper=True).splitlines()
    assert lines[2].startswith("| trot | paper, multi-task | 2560 | - | - | 0.000528 | 0.01764 | 0.91954 | - |")
    # s = 0.001, n = 3: half width 4.303 * 0.001 / sqrt(3).
    assert "| trot | multi-head | 512 | 100 | 3 | 0.001000 ± 0.000000 |" in lines[4]
    assert lines[4].endswith("| 0.99100 ± 0.00248 | 0.98100 ± 0.00248 |")
    assert len(lines) == 2 + 3 * 2 + 2  # jump is not measured, so it has the paper's rows alone
    assert "paper" not in paper_page.score_table("simulation", own, "named", paper=False)


def test_what_misses_is_bold():
    own = [student(r2=0.9905, mse=0.002), student("pooled", r2=0.98, mse=0.001)]
    trot, bound = paper_page.verdict_table("simulation", own).splitlines()[2:]
    assert "| 0.99050 | **all but MSE [rad^2], MAE [rad]** |" in trot and "| **0.98950** |" in bound
    assert paper_page.verdict_table("simulation", own[:1]).splitlines()[2].endswith("| 0.99050 | - |")


def table_of(*students, name="simulation"):
    config, table = paper_config.FULL, paper_config.TABLES[name]
    account = {gait: {"seconds": 600.0, "falls": 1} for gait in table.gaits}
    return {
        "students": list(students),
        "data": {"train": account, "unseen": account},
        "config": dataclasses.asdict(config),
        "env_kwargs": table.env_kwargs,
        "largest": {gait: config.largest(gait).tolist() for gait in table.gaits},
        "seed": 0,
        "command": "python examples/reproduce_paper.py",
    }


def test_the_page_shows_both_tables_and_names_the_differences():
    tables = {"simulation": table_of(student()), "hardware": table_of(student(use="unseen"), name="hardware")}
    page = paper_page.paper_page({"tables": tables}, ["paper_hardware_loss.png"])
    simulation, hardware = page.split("## Hardware")
    assert "None had to be clipped" in page and "no noise, 1 kHz" in simulation and "4 ms of delay" in hardware
    assert "(paper_hardware_loss.png)" in hardware and ".png" not in simulation
    assert "| trot | 600 | 600 | 2 |" in hardware and "0.97101" in hardware
    assert "the authors' held-out command:" in simulation and "the authors' held-out command:" not in hardware


def test_clipped_commands_are_named():
    own = table_of(student())
    own["largest"]["jump"] = [0.8, 0.4, 0.0]
    assert paper_page.clipped(own) == "Clipped to what the expert survives: jump ± 0.8 and ± 0.4 m/s."


def test_stances_are_runs_of_contact():
    assert paper_figures.stances(np.array([1, 1, 0, 1, 0, 0, 1], dtype=bool)) == [(0, 2), (3, 1), (6, 1)]
    assert paper_figures.stances(np.zeros(3, dtype=bool)) == []
    assert paper_figures.stances(np.ones(3, dtype=bool)) == [(0, 3)]


def test_the_contact_figure_shows_the_end_of_the_first_episode(data):
    rows = data.rows("train")
    figure = paper_figures.contact_figure(rows, seconds=0.2)
    assert [ax.get_title() for ax in figure.axes] == ["trot", "bound"]
    shown = rows.per_task()["trot"]
    episode = next(shown.episodes())
    contacts = shown.obs[episode.stop - 10 : episode.stop, 30:34]
    widths = [[path.get_extents().width for path in bars.get_paths()] for bars in figure.axes[0].collections]
    np.testing.assert_allclose([sum(own) for own in widths], contacts.sum(axis=0) / 50.0, atol=1e-9)


def test_the_loss_figure_has_a_line_per_student():
    own = [student(), student(seed=1), student("pooled", width=64), student("per_gait", gait="trot")]
    figure = paper_figures.loss_figure(own, ("trot", "bound"))
    for ax in figure.axes:
        assert len(ax.lines) == 3 and ax.get_yscale() == "log"
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), [0.1, 0.001])
    assert [line.get_linestyle() for line in figure.axes[0].lines] == ["-", "-", "--"]
    assert len(figure.legends[0].get_texts()) == 2


# -- The run -----------------------------------------------------------------------------------------------------------


def run(folder, *arguments):
    folders = ["--parts", str(folder / "parts"), "--out-dir", str(folder / "out")]
    return reproduce_paper.main([*arguments, "--quick", "--n-jobs", "1", *folders])


def test_a_quick_run_writes_both_tables_and_adds_to_them(tmp_path, monkeypatch, capsys):
    world = {"control_hz": 50, "action_delay_s": 0.004}
    hardware = dataclasses.replace(TABLE, name="hardware", named={}, gaits=("trot", "walk"), world=world)
    tables = {"simulation": TABLE, "hardware": hardware}
    monkeypatch.setattr(reproduce_paper, "TABLES", tables)
    monkeypatch.setattr(reproduce_paper, "QUICK", TINY)
    assert run(tmp_path, "hardware", "--kinds", "multi_head") == 0
    assert run(tmp_path, "simulation", "--seeds", "0") == 0
    out = tmp_path / "out"
    first = json.loads((out / "paper.json").read_text())["tables"]
    assert list(first) == ["simulation", "hardware"] and len(first["hardware"]["students"]) == 2
    assert "--parts" not in first["hardware"]["command"] and first["hardware"]["versions"]["mujoco"]
    pictures = {f"paper_{name}_{what}.png" for name in tables for what in ("loss", "targets", "contacts")}
    assert {path.name for path in out.glob("*.png")} == pictures
    page = (out / "paper.md").read_text()
    assert all(f"({name})" in page for name in pictures) and page == paper_page.paper_page(
        {"tables": first}, sorted(pictures)
    )
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").rglob("*") if path.is_file()}
    assert run(tmp_path, "simulation", "--kinds", "pooled", "--widths", "12", "--seeds", "1") == 0
    second = json.loads((out / "paper.json").read_text())["tables"]
    assert second["hardware"] == first["hardware"]
    assert [(own["width"], own["seed"]) for own in second["simulation"]["students"]] == [(8, 0), (12, 1)]
    assert kept == {path: path.stat().st_mtime_ns for path in kept}
    assert "paper.json" in capsys.readouterr().out


def test_students_do_not_depend_on_processes(data):
    own = paper_students.School(TABLE, TINY, data)
    two = dataclasses.replace(own, config=dataclasses.replace(TINY, steps=7))
    wanted = [paper_students.Student("multi_head", 8, seed) for seed in (0, 1)]
    paper_students.teach_all(two, wanted, 2)
    found = [two.file(each) for each in wanted]
    scores = [json.loads(path.read_text())["scores"] for path in found]
    for path in found:
        path.unlink()
    paper_students.teach_all(two, wanted, 1)
    assert scores == [json.loads(path.read_text())["scores"] for path in found] and scores[0] != scores[1]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["simulation", "simulation"], "twice"),
        (["simulation", "--kinds", "pooled", "pooled"], "twice"),
        (["simulation", "--seeds", "1", "1"], "different"),
        (["simulation", "--widths", "0"], "widths"),
        (["simulation", "--steps", "0"], "steps"),
        (["simulation", "--device", "tpu"], "device"),
        (["simulation", "--threads", "0"], "threads"),
    ],
)
def test_impossible_arguments_are_refused_before_anything_is_made(arguments, reason, tmp_path, capsys):
    assert run(tmp_path, *arguments) == 2
    assert reason in capsys.readouterr().err and not list(tmp_path.iterdir())
