"""The reverse-engineering tools find the known bytes of games with finished decoders."""

import contextlib
import dataclasses
import json
import re

import jax
import numpy as np
import pytest
from PIL import Image

import ocjax
from ocjax import authoring, recordings
from ocjax.emulators import progress
from ocjax.envs import AlePool, Settings
from ocjax.play import rollouts
from ocjax.ramtools import (
    causes,
    correlate,
    fits,
    proposal,
    ram_map,
    residual,
    rows,
    twins,
    watch,
)
from ocjax.ramtools.watch import GLOW, Session
from ocjax.vision.unknown import UNKNOWN_VALUE
from tests.support.command import run
from tests.support.states import DATA


@pytest.fixture(scope="module")
def pong():
    return rollouts.rollout(ocjax.load("Pong"), 1600, seed=3)


@pytest.fixture(scope="module")
def pong_findings(pong):
    return {(f.object, f.field): f for f in correlate.correlate(pong)}


def formula(finding, i=0):
    return str(finding.fits[i]), finding.fits[i].exact


@pytest.mark.parametrize(
    ("at", "pattern", "share"),
    [
        (("Ball", "x"), r"byte\(49\) - 49", 0.99),
        (("Ball", "y"), r"byte\(54\) - 14", 0.75),  # it is one row lower on one side of the beam
        (("Enemy", "y"), r"byte\((50|21)\) - 15", 0.98),
        (
            ("Player", "y"),
            r"byte\(51\) - 14, \+1 where bits\(51, first=0, count=1\)",
            0.75,
        ),  # the rest is cut off at the walls
    ],
)
def test_correlate_finds_pong(pong_findings, at, pattern, share):
    text, exact = formula(pong_findings[at])
    assert re.fullmatch(pattern, text)
    assert exact >= share


def test_correlate_finds_values_and_presence(pong_findings):
    score = pong_findings["EnemyScore", "value"].fits
    assert [f.source.address for f in score] == [13]
    assert score[0].exact > 0.95
    present = pong_findings["Ball", "present"].fits[0]
    assert present.source.address in (54, 49, 12)
    assert present.exact > 0.95


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("span", [3, 90, 100_000, 2**31 - 1])
def test_values_that_are_unknown_in_some_samples(share, span):
    """The search drops unknown values, and large values take no memory."""
    rng = np.random.default_rng(0)
    rams = rng.integers(0, 256, (400, 128), np.uint8)
    tape = recordings.Recording(ocjax.load("Pong"), rams, resets=np.arange(400) % 100 == 0)
    value = rams[:, 7].astype(np.int32) * max(1, span // 256)
    unknown = rng.random(400) < share
    value[unknown] = UNKNOWN_VALUE
    target = correlate.Target(
        "Score",
        True,
        np.ones((400, 1, 4), int),
        np.ones((400, 1), bool),
        value[:, None],
        np.zeros((400, 1), int),
    )
    found = [
        f
        for f in correlate._explain_slot(tape, target, 0, fits.halves(tape.episode))
        if f.field == "value"
    ]
    assert [f.samples for f in found] == ([] if share == 1 else [400 - unknown.sum()])
    if span <= 256 and found:
        assert (found[0].fits[0].source.address, found[0].fits[0].exact) == (7, 1)


def test_values_that_are_unknown_for_some_values_of_a_byte():
    game = ocjax.load("Pong")
    category = next(c for c in game.categories if "value" in c.attributes)
    slot, tried = game.slices[category.name].start, np.arange(256)
    one = jax.tree.map(np.asarray, game.rem(np.zeros(128, np.uint8)))
    many = jax.tree.map(np.asarray, game.rem(np.zeros((256, 128), np.uint8)))
    value, valid = np.array(many.value), np.array(many.valid)
    valid[:, slot], value[:, slot] = True, np.where(tried % 3 == 0, UNKNOWN_VALUE, tried)
    after = dataclasses.replace(many, value=value, valid=valid)
    effect = causes._effect(game, category, tried, after, one)
    formula = effect.formulas["value"]
    assert (formula.scale, formula.offset, formula.share) == (1, 0, 1)


@pytest.mark.slow
def test_correlate_of_tennis():
    """The score of Tennis is unknown while the screen hides it."""
    result = run("ram", "correlate", "Tennis", "--samples", 400)
    assert result.exit_code == 0, result.output


@pytest.mark.slow
def test_correlate_finds_freeway():
    tape = rollouts.rollout(ocjax.load("Freeway"), 1200, seed=3)
    found = {(f.object, f.field): f for f in correlate.correlate(tape)}
    text, exact = formula(found["Chicken 0", "y"])
    assert text == "-byte(14) + 193"
    assert exact > 0.95
    cars = found["Car, one of", "x"].fits
    assert {f.source.address for f in cars if f.exact > 0.4} >= set(range(108, 118))
    assert {f.offset for f in cars if f.scale == 1 and 108 <= f.source.address < 118} <= {-3, -2}


@pytest.mark.slow
def test_correlate_with_what_the_chip_drew():
    """The search needs no vision rules; the ball is the only drawn object of this recording."""
    game = ocjax.load("Pong")
    tape = rollouts.rollout(game, 800, seed=4)
    ball = game.rem(tape.rams).of("Ball")
    shown = np.zeros(tape.screens.shape, np.uint8)
    for i, ((x, y, w, h),) in enumerate(np.asarray(ball.xywh).astype(int)):
        shown[i, y : y + h, x : x + w] = 16
    chip = recordings.Recording(game, tape.rams, tape.screens, shown=shown, resets=tape.resets)
    found = {(f.object, f.field): f for f in correlate.correlate(chip, "sprites")}
    assert formula(found["Ball 0", "x"])[0] == "byte(49) - 49"
    with pytest.raises(ValueError, match="lacks the video chip's sprites"):
        list(correlate.correlate(tape, "sprites"))


def test_digits():
    """Three bytes hold six decimal digits of a score; all others hold noise."""
    rng = np.random.default_rng(0)
    rams = rng.integers(0, 256, (600, 128), dtype=np.uint8)
    score = rng.integers(0, 1_000_000, 600)
    for address, power in ((70, 0), (20, 1), (9, 2)):
        two = score // 100**power % 100
        rams[:, address] = two // 10 * 16 + two % 10
    parts = fits.digits(rams, score, fits.halves(np.zeros(600, int)))
    assert [(str(p.source), p.offset) for p in parts] == [
        ("bcd(70)", 0),
        ("bcd(20)", 1),
        ("bcd(9)", 2),
    ]


def test_affine_finds_what_is_there():
    rng = np.random.default_rng(1)
    rams = rng.integers(0, 256, (500, 128), dtype=np.uint8)
    half = fits.halves(np.arange(500) // 50)
    target = 4 * (rams[:, 77].astype(int) >> 3 & 15) + 7 - 5 * (rams[:, 30] >> 6 & 1)
    best = fits.affine(rams, target, half)[0]
    assert str(best) == "4 * bits(77, first=3, count=4) + 7, -5 where bits(30, first=6, count=1)"
    assert best.exact == 1
    assert np.array_equal(best.predict(rams), target)
    noise = fits.affine(rams, rng.integers(0, 160, 500), half)
    assert noise[0].exact < 0.1
    table = fits.tables(rams, np.array([9, 2, 200, 5])[rams[:, 5] >> 6], half)[0]
    assert str(table) == "bits(5, first=6, count=2): 0 -> 9, 1 -> 2, 2 -> 200, 3 -> 5"
    assert table.exact == 1


def formation(pitch, rng, samples=400, slots=5, byte=77):
    """RAM, and the coordinates of a row of objects in it; some objects are missing."""
    rams = rng.integers(0, 256, (samples, 128), np.uint8)
    rams[:, byte] = rng.integers(10, 40, samples)
    at = pitch * np.arange(slots) + rams[:, byte, None].astype(int) - 7
    present = np.zeros((samples, 256), bool)
    n, k = np.nonzero(rng.random((samples, slots)) < 0.7)
    present[n, at[n, k]] = True
    return rams, present, fits.halves(np.arange(samples) // 50)


@pytest.mark.parametrize("pitch", [9, 16, 30])
def test_rows_of_objects_that_move_together(pitch):
    found = rows.rows(*formation(pitch, np.random.default_rng(0)))
    assert str(found[0]) == f"{pitch} * slot + byte(77) - 7, slots 0-4"
    assert found[0].exact == found[0].near == 1


def test_rows_that_do_not_move():
    rams, present, half = formation(12, np.random.default_rng(0), byte=5)
    still = np.zeros_like(present)
    still[:, 20:60:12] = present[:, 20:60:12].any(axis=1, keepdims=True)
    still[::3, 32] = False
    (row,) = rows.rows(rams, still, half)
    assert str(row) == "12 * slot + 20, slots 0-3"


def test_no_row_in_noise():
    rams, present, half = formation(9, np.random.default_rng(1))
    noise = np.random.default_rng(2).permuted(present[:, :160], axis=1)
    assert rows.rows(rams, noise, half) == []
    assert rows.rows(rams, present & (np.arange(256) == 9), half) == [], "one object each"


def test_proposed_class():
    """The class has every type of field, and Python accepts it."""
    byte, part = fits.Source, fits.Fit
    moving = rows.Row(16, 6, byte(26), 1, -1, 0.99, 1)
    found = [
        correlate.Finding("Ball", "Ball", "x", 99, 0.1, (part(byte(49), 0.994, 1, 1, -49),)),
        correlate.Finding("Chicken 0", "Chicken", "y", 99, 0.1, (part(byte(14), 1, 1, -1, 193),)),
        correlate.Finding("Chicken 1", "Chicken", "y", 99, 0.1, (part(byte(15), 1, 1, -1, 193),)),
        correlate.Finding("Alien, all", "Alien", "x", 99, 0.1, (moving,)),
        correlate.Finding(
            "BigScore",
            "BigScore",
            "value",
            99,
            0.1,
            tuple(part(byte(a, decimal=True), 1, 1, 1, i) for i, a in enumerate((70, 20))),
            digits=True,
        ),
        correlate.Finding("BigScore", "BigScore", "w", 99, 0.1, (part(byte(70), 1, 1, 8, 0),)),
        correlate.Finding("Ball", "Ball", "y", 99, 0.1, (part(byte(50), 0.4, 1),)),
        correlate.Finding(
            "Car, one of",
            "Car",
            "x",
            99,
            0.1,
            (part(byte(3), 1, 1, 1, -3), part(byte(2), 0.9, 1, 1, -3), part(byte(9), 0.8, 1)),
            members=True,
        ),
    ]
    text = proposal.ram_class(found)
    assert (
        text
        == """\
class Ram(RamMap):
    car_x = byte(2, 3)  # x + 3 (90 %)
    car_x_2 = byte(9)  # x (80 %)
    chicken_y = byte(14, 15)  # 193 - y (100 %)
    big_score_value = bcd((20, 70))  # value (100 %)
    alien_x = byte(26)  # x of slot 0 + 1; 16 pixels from slot to slot, 6 slots (99 %)
    ball_x = byte(49)  # x + 49 (99 %)
"""
    )
    names = vars(authoring).copy()
    exec(text, names)
    assert names["Ram"].fields()["big_score_value"].addresses == (20, 70)


def test_proposal_of_nothing():
    assert proposal.ram_class([]) == "class Ram(RamMap):\n    pass\n"


def test_residual(pong):
    """The command finds the bit that explains a wrong decoder, and nothing for a right decoder."""
    right = residual.residual(pong, "Player", "y")
    assert right.exact > 0.999
    assert right.tables == ()
    odd = np.random.default_rng(0).integers(
        2, size=len(pong)
    )  # the decoder is one column off if bit 3 of byte 127 is set
    rams = pong.rams.copy()
    rams[:, 49] += odd.astype(np.uint8)
    rams[:, 127] = 8 * odd
    tape = recordings.Recording(pong.game, rams, pong.screens, resets=pong.resets)
    wrong = residual.residual(tape, "Ball", "x")
    assert wrong.exact == pytest.approx(0.5, abs=0.05)
    assert set(wrong.errors) == {0, -1}
    best = {str(table): table.exact for table in wrong.tables}
    assert best["bits(127, first=3, count=1): 0 -> 0, 1 -> -1"] > 0.99


@pytest.mark.parametrize(
    ("shift", "message"),
    [
        (17, r"matched \d+ times .* REM's x is 17 too large in [\d,]+ and y is right in [\d,]+$"),
        (-40 & 255, r"matched \d+ times .* REM's x is 40 too small in [\d,]+ and y is right"),
    ],
)
def test_residual_of_a_constant_offset(pong, shift, message):
    """A new decoder often has this error: no box is close enough to match."""
    rams = pong.rams.copy()
    rams[:, 49] += np.uint8(shift)
    tape = recordings.Recording(pong.game, rams, pong.screens, resets=pong.resets)
    with pytest.raises(ValueError, match=message):
        residual.residual(tape, "Ball", "x")


def test_residual_of_a_decoder_without_boxes(pong):
    rams = pong.rams.copy()
    rams[:, 54] = 0  # the ball is above the court
    tape = recordings.Recording(pong.game, rams, pong.screens, resets=pong.resets)
    with pytest.raises(ValueError, match=r"REM has it in 0 samples, VEM in [\d,]+, never in the"):
        residual.residual(tape, "Ball", "x")


@pytest.fixture(scope="module")
def pong_causes():
    return causes.causes(ocjax.load("Pong"), values=32, num_envs=32, seed=1)


def test_causes_finds_pong(pong_causes):
    """Byte 49 is the ball's column and 54 its row; 13 and 14 are the scores; most bytes do
    nothing."""
    by_name = {a: {e.category: e for e in es} for a, es in pong_causes.effects.items()}
    x, y = by_name[49]["Ball"].formulas["x"], by_name[54]["Ball"].formulas["y"]
    assert x.scale == y.scale == 1
    assert x.share > 0.8
    assert y.share > 0.4, "near the walls the ball is cut off or turns around"
    for address, category in ((13, "EnemyScore"), (14, "PlayerScore")):
        value = by_name[address][category].formulas["value"]
        assert (value.scale, value.offset) == (1, 0)
    assert "EnemyScore" not in by_name[14]
    assert (pong_causes.effective == 0).sum() > 60
    assert pong_causes.pixels[14, 1:21, 100:128].any()


def test_causes_without_an_effect_say_why(pong_causes):
    assert causes.notes(pong_causes) == []
    none = dataclasses.replace(pong_causes, effective=np.zeros(128, int), shortened=True)
    early, empty = causes.notes(none)
    assert f"{pong_causes.played:,} frames after the reset" in early
    assert "No byte changes the picture, 32 values tried" in empty


def test_play_for_causes_stops_before_the_end_of_the_game():
    """After the end, the emulator restarts the game and ignores writes."""
    game, skip = ocjax.load("Breakout"), 4
    settings = Settings(frame_skip=skip, repeat_action_probability=0)
    with contextlib.closing(AlePool(game, 1, settings, num_workers=0)) as pool:
        assert causes.play_alike(pool, 0, 50) == 50, "the game does not end in 50 steps"
        played = causes.play_alike(pool, 0, 5000)
        assert not pool.terminated.any()
        end = causes._play(pool, 0, 5000)
        assert pool.terminated.all()
        assert played == end - causes.BEFORE_END // skip


def test_progress_without_a_terminal(monkeypatch, capsys):
    assert list(progress.progress(range(3), "working")) == [0, 1, 2]
    assert capsys.readouterr().err == "", "short work shows nothing"
    monkeypatch.setattr(progress, "SECONDS", 0)
    assert list(progress.progress(range(3), "working")) == [0, 1, 2]
    shown = capsys.readouterr()
    assert shown.err.splitlines() == ["working: 33 %", "working: 66 %", "working: 100 %"]
    assert shown.out == ""


@pytest.mark.slow
def test_causes_finds_freeway():
    found = causes.causes(ocjax.load("Freeway"), values=32, num_envs=32, steps=60)
    effects = {a: {e.category: e for e in es} for a, es in found.effects.items()}
    y = effects[14]["Chicken"].formulas["y"]
    assert y.scale == -1
    assert abs(y.offset % 256 - 193) <= 1
    assert y.share > 0.4
    assert {a for a in range(108, 118) if "Car" in effects[a]} == set(range(108, 118))


@pytest.mark.slow
def test_twins(monkeypatch):
    """Bytes 69 and 73 of Pong point to the picture of a digit that is drawn before the scores are
    compared with them again."""
    found = twins.twins(ocjax.load("Pong"), count=2)
    assert (found.moments, set(found.bytes), set(found.bytes["EnemyScore"])) == (
        2,
        {"EnemyScore"},
        {69, 73},
    )
    end = twins.twins(ocjax.load("Bowling"), "end", count=1)
    assert end.bytes["Pin"].total() > 10
    assert twins.to_table(end).rows[0][0] == "Pin"
    monkeypatch.setattr(twins, "MOST_FRAMES", 200)
    with pytest.raises(
        ValueError, match="does not reach the last frame of a game within 200 frames"
    ):
        twins.twins(ocjax.load("Pong"), "end", count=1)


def test_map():
    table = ram_map.ram_map(ocjax.load("Freeway"))
    rows = {row[3]: row for row in table.rows}
    assert rows["chicken_y[0]"] == ["14", "unsigned", "0-255", "chicken_y[0]", "193 - y"]
    assert rows["score[1]"][1:3] == ["BCD", "0-99"]
    assert rows["car_kind[0]"][2] == "0-7"
    for name in ocjax.games():
        assert len(ram_map.ram_map(ocjax.load(name)).rows) >= 4


def test_map_as_json():
    rows = json.loads(run("ram", "map", "Pong", "--json").stdout)
    (ball,) = [row for row in rows if row["name"] == "ball_x"]
    assert ball == {
        "bytes": [49],
        "read_as": "unsigned",
        "range": "0-255",
        "name": "ball_x",
        "meaning": ball["meaning"],
    }
    assert "--confirm needs --json" in run("ram", "map", "Pong", "--confirm").output


@pytest.mark.slow
def test_map_tells_what_an_intervention_confirmed():
    rows = {
        row["name"]: row["confirmed"]
        for row in json.loads(run("ram", "map", "Pong", "--json", "--confirm").stdout)
    }
    assert "Ball" in rows["ball_x"]
    assert "Player" not in rows["ball_x"]
    assert "EnemyScore" in rows["enemy_score"]
    assert "PlayerScore" not in rows["enemy_score"]


def test_session():
    s = Session(ocjax.load("Pong"))
    for key in ("v", "d", "\x1b[A"):
        s.key(key)
    assert s.action().name == "UPRIGHT"
    for _ in range(15):
        s.step()
    assert s.action().name == "NOOP", "a key press does not last"
    s.key("k")
    before = s.ram.copy()
    for key in ":14 0x7\r":
        s.key(key)
    assert s.ram[14] == 7
    assert "byte 14 is 7" in s.message
    assert s.changed[14] == GLOW
    s.key("p")
    s.step()
    assert s.ram[14] == 7
    s.key("l")
    assert np.array_equal(s.ram, before)
    for key in ":300 1\r":
        s.key(key)
    assert "0-127" in s.message
    for key in ":x\x7fy\r":
        s.key(key)
    assert "to poke type" in s.message
    s.key("r")
    s.key("n")
    assert s.paused
    s.key("q")
    assert s.done


def test_loading_before_saving_says_so():
    s = Session(ocjax.load("Pong"))
    s.key("l")
    assert "no state has been saved" in s.message


def test_a_step_emulates_two_frames():
    s = Session(ocjax.load("Pong"))
    s.step()
    assert s.ale.getEpisodeFrameNumber() == 2


def test_terminal_input_is_split_into_keys():
    assert watch.split_keys("a\x1b[Ad\x1b") == ["a", "\x1b[A", "d", "\x1b"]


@pytest.mark.parametrize(
    ("held", "action"),
    [
        ("", "NOOP"),
        ("w", "UP"),
        ("a ", "LEFTFIRE"),
        ("dw", "UPRIGHT"),
        (" as", "DOWNLEFTFIRE"),
        ("ws", "NOOP"),
    ],
)
def test_held_keys_make_an_action(held, action):
    s = Session(ocjax.load("Pong"))
    for key in held:
        s.key(key)
    assert s.action().name == action


def test_watch_in_terminal():
    result = run("ram", "watch", "Pong", "--policy", "random", "--frames", 3)
    assert result.exit_code == 0, result.output
    assert "▀" in result.output
    assert "PlayerScore 0" in result.output


@pytest.mark.slow
def test_commands(tmp_path):
    for args, words in (
        (
            ("correlate", DATA / "Pong.npz", "--write", "-"),
            ("present", "Constant", "class Ram(RamMap):"),
        ),
        (("residual", DATA / "SpaceInvaders.npz", "Alien", "x"), ("matched objects",)),
        (
            (
                "causes",
                "Pong",
                "--values",
                4,
                "--envs",
                8,
                "--steps",
                5,
                "--out",
                tmp_path / "c.png",
            ),
            ("Byte", "EnemyScore"),
        ),
        (("twins", "Pong", "--count", 1), ("Pong, 1 times any frame of play", "EnemyScore")),
        (("map", "Pong"), ("ball_x", "x + 49")),
    ):
        result = run("ram", *args)
        assert result.exit_code == 0, result.output
        for word in words:
            assert word in result.output
    with Image.open(tmp_path / "c.png") as picture:
        assert picture.size[0] > 500


def test_wrong_use(tmp_path):
    bare = tmp_path / "bare.npz"
    recordings.Recording(ocjax.load("Pong"), np.zeros((9, 128), np.uint8)).write(bare)
    for args, message in (
        (("correlate", "Pung"), "did you mean Pong"),
        (("correlate", bare), "has no array screens"),
        (("correlate", DATA / "Pong.npz", "--target", "sprites"), "has no array shown"),
        (("correlate", DATA / "Pong.npz", "--target", "eyes"), "vem or sprites"),
        (
            ("correlate", DATA / "Pong.npz", "--write", tmp_path / "no" / "ram.py"),
            "no folder",
        ),
        (("residual", DATA / "Pong.npz", "Car", "x"), "no category 'Car'"),
        (("residual", DATA / "Pong.npz", "Ball", "z"), "must be one of x, y, w, h"),
        (("causes", "Pong", "--mode", 99), "no mode 99"),
        (("twins", "Pong", "--moment", "birth"), "must be one of play, life, end"),
        (("watch", "Pong", "--policy", "greedy"), "no policy 'greedy'"),
        (("watch", "Pong", "--mode", 99), "no mode 99"),
    ):
        result = run("ram", *args)
        assert result.exit_code == 2, result.output
        assert message in " ".join(result.output.replace("│", " ").split()), result.output
