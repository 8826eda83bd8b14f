"""Labels of AtariARI."""

import runpy
import shutil
import sys

import jax
import numpy as np
import pytest

import ocjax
from ocjax import atariari
from ocjax.extraction import names
from tests.support.states import excerpt

PATTERN = np.arange(128, dtype=np.uint8)


def test_games():
    assert len(atariari.games()) == 22
    assert len(atariari.addresses()) == 24
    assert set(atariari.addresses()) <= set(names.games())


def test_labels_are_bytes():
    assert atariari.labels("Pong", PATTERN) == {
        "player_y": 51,
        "player_x": 46,
        "enemy_y": 50,
        "enemy_x": 45,
        "ball_x": 49,
        "ball_y": 54,
        "enemy_score": 13,
        "player_score": 14,
    }
    assert atariari.labels(ocjax.load("Pong"), PATTERN) == atariari.labels("Pong", PATTERN)
    assert atariari.labels("ALE/Bowling-v5", PATTERN)["pin_existence_9"] == 66


def test_labels_of_batches_explain_the_objects():
    """The ball's bytes differ from its box by constants."""
    game, rams = ocjax.load("Pong"), excerpt("Pong")["rams"]
    labels = atariari.labels("pong", rams.reshape(2, -1, 128))
    ball = game.rem(rams).of("Ball")
    free = np.asarray(ball.valid[:, 0] & (ball.h[:, 0] == 4) & (ball.w[:, 0] == 2))
    x = labels["ball_x"].reshape(-1).astype(int)[free] - np.asarray(ball.x[:, 0])[free]
    assert free.sum() > 5
    assert np.unique(x).tolist() == [49]


def test_labels_under_jit():
    rams = excerpt("Pong")["rams"]
    got = jax.jit(lambda ram: atariari.labels("Pong", ram))(rams)
    assert all(np.array_equal(got[name], a) for name, a in atariari.labels("Pong", rams).items())


def test_misuse():
    with pytest.raises(ValueError, match="no labels for Alien; it labels Asteroids"):
        atariari.labels("Alien", PATTERN)
    with pytest.raises(TypeError, match="must be a uint8 array, got int64"):
        atariari.labels("Pong", PATTERN.astype(np.int64))
    with pytest.raises(ValueError, match=r"shape \[\.\.\., 128\], got \[100\]"):
        atariari.labels("Pong", PATTERN[:100])


@pytest.fixture
def checkout(request):
    path = request.config.getoption("--atari-ari")
    if path is None:
        pytest.skip("needs --atari-ari with the path of a checkout of AtariARI's repository")
    return path / "atariari" / "benchmark"


def test_against_its_annotations(checkout):
    for game, table in runpy.run_path(str(checkout / "ram_annotations.py"))["atari_dict"].items():
        assert atariari.labels(game, PATTERN) == table


@pytest.mark.filterwarnings("default")  # warnings of other projects
def test_its_probes_train_on_the_labels(checkout, tmp_path, monkeypatch):
    """Its linear probes read the labels from the positions of our objects.

    The test drops one argument that PyTorch no longer has.
    """
    torch = pytest.importorskip("torch")
    pytest.importorskip("sklearn")
    shutil.copytree(checkout, tmp_path / "ari")
    probe = tmp_path / "ari" / "probe.py"
    probe.write_text(probe.read_text().replace("verbose=True,", ""))
    monkeypatch.syspath_prepend(tmp_path)
    from ari.probe import ProbeTrainer

    torch.manual_seed(0)
    np.random.seed(0)  # noqa: NPY002, the probes draw samples from it
    steps = 150  # so that the training's episodes contain nearly all places of the test's episodes
    envs = ocjax.make_vec("Freeway", 12, num_workers=1, obs="ram", hud=False)
    ram, _ = envs.reset(seed=0)
    rams = []
    for t in range(steps):
        rams.append(ram)
        ram, *_ = envs.step(np.full(12, t % 16 > 2, int))
    envs.close()
    rams = np.stack(rams, axis=1)  # [episode, step, 128]
    game = ocjax.load("Freeway", hud=False)
    x = np.asarray(game.rem(rams).of("Chicken").y)[..., :1]
    features = torch.tensor(np.eye(256, dtype=np.float32)[x[..., 0]] * 255)
    labels = {"player_y": atariari.labels("Freeway", rams)["player_y"].astype(int)}
    episodes = [list(e) for e in features]
    of_steps = [[{k: v[e, t] for k, v in labels.items()} for t in range(steps)] for e in range(12)]
    trainer = ProbeTrainer(
        representation_len=256, epochs=20, lr=0.3, save_dir=str(tmp_path), patience=20
    )
    trainer.train(episodes[:6], episodes[6:9], of_steps[:6], of_steps[6:9])
    accuracy, f1 = trainer.test(episodes[9:], of_steps[9:])
    assert accuracy["player_y_acc"] > 0.9
    assert f1["player_y_f1"] > 0.5
    sys.modules.pop("ari.probe")
