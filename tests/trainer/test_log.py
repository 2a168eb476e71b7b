"""TensorBoard log and figures."""

import io
import json

import numpy as np
import pytest
from PIL import Image
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.hparams.plugin_data_pb2 import HParamsPluginData

import trainers
from go1_mtl_gym.errors import InvalidInputError
from tests.trainer.stub_env import make_stub
from trainers import evaluate, joint_target_figure, log_figure, log_round, log_text, make_logger, offline_metrics
from trainers.utils.gif import Gif
from trainers.utils.logging import log_film, log_settings


def test_round_text_and_figure_reach_tensorboard(policy, demos, tmp_path):
    logger = make_logger(tmp_path)
    result = evaluate("expert", "trot", 1, 3.0, make_env=make_stub)
    log_round(logger, 2, {"trot": result.as_dict()}, offline_metrics(policy, demos), {"lower_bound": 0.5})
    log_text(logger, "config", {"seed": 1, "nan": float("nan")})
    log_figure(logger, "joint_targets", joint_target_figure(policy, demos), 2)
    logger.close()
    gaits = {task: EventAccumulator(str(tmp_path / task)).Reload() for task in ("trot", "walk")}
    assert {"closed_loop/success_rate", "closed_loop/velocity_error"} <= set(gaits["trot"].Tags()["scalars"])
    assert "offline/r2" in gaits["walk"].Tags()["scalars"], "the gaits of a figure share its card"
    scalar = gaits["trot"].Scalars("closed_loop/success_rate")[0]
    assert (scalar.step, scalar.value) == (2, 1.0)
    tags = EventAccumulator(str(tmp_path)).Reload().Tags()
    assert tags["scalars"] == ["certificate/lower_bound"]
    assert tags["images"] == ["joint_targets"] and "config/text_summary" in tags["tensors"]


def moving_picture() -> Gif:
    file = io.BytesIO()
    images = [Image.new("RGB", (24, 16), (40 * i, 0, 0)) for i in range(3)]
    images[0].save(file, format="GIF", save_all=True, append_images=images[1:], duration=100)
    return Gif(file.getvalue())


def test_a_film_is_a_moving_picture_of_tensorboard(tmp_path):
    logger, film = make_logger(tmp_path), moving_picture()
    log_film(logger, "film", film, 3)
    log_film(logger, "film", film, 5)
    logger.close()
    events = EventAccumulator(str(tmp_path)).Reload()
    assert [each.step for each in events.Images("film")] == [3, 5]
    shown = events.Images("film")[0]
    assert (shown.width, shown.height) == (24, 16)
    with Image.open(io.BytesIO(shown.encoded_image_string)) as image:
        assert image.n_frames == 3


def test_settings_and_results_are_what_runs_are_compared_by(tmp_path):
    logger = make_logger(tmp_path)
    log_settings(logger, {"seed": 1, "operator": {"hold": 2.0}, "tasks": ["trot"], "none": None}, {"result/r2": 0.9}, 7)
    logger.close()
    events = EventAccumulator(str(tmp_path)).Reload()
    assert [(each.step, round(each.value, 6)) for each in events.Scalars("result/r2")] == [(7, 0.9)]
    begin = events.summary_metadata["_hparams_/session_start_info"].plugin_data.content
    given = HParamsPluginData.FromString(begin).session_start_info.hparams
    assert (given["seed"].number_value, given["operator.hold"].number_value) == (1, 2)
    assert given["tasks"].string_value == '["trot"]' and "none" not in given


def test_silent_logger_writes_nothing(capsys):
    logger = make_logger()
    logger.record("a", 1.0)
    logger.dump(0)
    assert capsys.readouterr() == ("", "")


def test_figure_shows_both_in_radians(policy, demos, tmp_path):
    figure = joint_target_figure(policy, demos, seconds=2.0)
    axes = np.array(figure.axes).reshape(4, 3)
    expert, predicted = axes[0, 1].lines
    trot = demos.per_task()["trot"]
    episode = next(trot.episodes())
    rows = slice(episode.stop - 100, episode.stop)
    np.testing.assert_allclose(expert.get_ydata(), 0.9 + trot.half_range[1] * trot.acts[rows, 1], rtol=1e-6)
    wanted = 0.9 + trot.half_range[1] * policy.predict(trot.obs[rows], deterministic=True)[0][:, 1]
    np.testing.assert_allclose(predicted.get_ydata(), wanted, rtol=1e-5)
    figure.savefig(tmp_path / "f.png")
    assert (tmp_path / "f.png").stat().st_size > 1000
    with pytest.raises(InvalidInputError, match="nothing to draw"):
        joint_target_figure(policy, {})


def test_public_names():
    assert set(trainers.__all__) == set(trainers._HOME)
    assert all(getattr(trainers, name) is not None for name in trainers.__all__)
    assert set(trainers.__all__) <= set(dir(trainers))
    with pytest.raises(AttributeError, match="has no attribute 'nonsense'"):
        _ = trainers.nonsense


def test_weights_and_biases_gets_numbers_pictures_and_settings(policy, demos, tmp_path, monkeypatch):
    monkeypatch.setenv("WANDB_SILENT", "true")
    datastore = pytest.importorskip("wandb.sdk.internal.datastore")
    from wandb.proto.wandb_internal_pb2 import Record

    monkeypatch.setenv("WANDB_MODE", "offline")
    logger = make_logger(tmp_path, ("wandb",))
    logger.record("closed_loop/success_rate/trot", 0.5)
    logger.record("dagger/rounds", 3, exclude="tensorboard")
    logger.dump(7)
    log_text(logger, "configuration", {"preset": "smoke"})
    log_figure(logger, "joint_targets", joint_target_figure(policy, demos), 7)
    log_film(logger, "film", moving_picture(), 8)
    log_settings(logger, {"seed": 1}, {"result/r2": 0.9}, 9)
    logger.close()
    first = (tmp_path / "wandb_run_id").read_text()
    again = make_logger(tmp_path, ("wandb",))
    again.close()
    assert (tmp_path / "wandb_run_id").read_text() == first, "a log that goes on is the same run"

    (written, *_) = sorted(tmp_path.rglob("*.wandb"))
    store = datastore.DataStore()
    store.open_for_scan(str(written))
    records = []
    while (data := store.scan_data()) is not None:
        records.append(Record.FromString(data))
    history = [
        {item.key or "/".join(item.nested_key): json.loads(item.value_json) for item in record.history.item}
        for record in records
        if record.HasField("history")
    ]
    assert any(row.get("closed_loop/success_rate/trot") == 0.5 and row["step"] == 7 for row in history)
    assert any(row.get("result/r2") == 0.9 and row["step"] == 9 for row in history)
    assert not any("dagger/rounds" in row for row in history)
    assert list(tmp_path.rglob("media/images/*.png")) and list(tmp_path.rglob("media/videos/*.gif"))
    config = {item.key: item.value_json for record in records for item in record.config.update}
    config |= {item.key: item.value_json for record in records for item in record.run.config.update}
    assert config["seed"] == "1" and "smoke" in config["configuration"]


def test_weights_and_biases_are_asked_for_before_a_run_begins(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InvalidInputError, match="pip install"):
        make_logger(tmp_path, ("wandb",))
    with pytest.raises(InvalidInputError, match="pip install"):
        trainers.Job(trainers.JobConfig.from_preset("smoke", wandb=True), tmp_path / "run")
    assert not (tmp_path / "run").exists()
