"""Readable and tabular forms of objects."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import ocjax
from ocjax.extraction.objects import Objects
from ocjax.extraction.records import FIELDS, Fields, constant, no_objects
from ocjax.vision.unknown import UNKNOWN
from tests.support.states import excerpt

GAME = ocjax.load("Pong")


@pytest.fixture(scope="module")
def objects():
    return GAME.rem(excerpt("Pong")["rams"])


def test_fields_are_those_of_objects(objects):
    assert tuple(FIELDS) == Fields._fields == tuple(f.name for f in dataclasses.fields(Objects) if f.name != "game")
    for name, empty in no_objects(objects.valid.shape[:-1], GAME.num_slots).items():
        assert (getattr(objects, name).shape, getattr(objects, name).dtype) == (empty.shape, empty.dtype)


def test_take(objects):
    """Slots are gathered in every field; one out of range is empty."""
    slots = jnp.broadcast_to(jnp.array([2, 0, GAME.num_slots], jnp.int32), (len(objects.valid), 3))
    taken = objects.take(slots)
    assert taken.game is None
    for name in FIELDS:
        of, all_slots = np.asarray(getattr(taken, name)), np.asarray(getattr(objects, name))
        assert np.array_equal(of[:, :2], all_slots[:, [2, 0]])
        assert not of[:, 2].any()


def test_frame_has_the_records_of_the_list(objects):
    pytest.importorskip("pandas")
    frame = objects.to_frame()
    want = [(row, r) for row, state in enumerate(objects.to_list()) for r in state]
    assert len(frame) == len(want) > 0
    for line, (row, record) in zip(frame.itertuples(), want, strict=True):
        assert (line.row, line.r, line.g, line.b) == (row, *record["rgb"])
        assert all(getattr(line, key) == record[key] for key in ("category", "slot", "x", "y", "w", "h", "hud"))
        assert record.get("value", "missing") == (line.value if isinstance(line.value, int | np.integer) else "missing")


def test_frame_of_one_state_and_of_several_batch_dimensions(objects):
    pytest.importorskip("pandas")
    assert "row" not in objects[0].to_frame()
    square = jax.tree.map(lambda a: a[:6].reshape(2, 3, *a.shape[1:]), objects).to_frame()
    flat = objects[:6].to_frame()
    assert (square["row_0"] * 3 + square["row_1"]).equals(flat["row"])
    assert square["x"].equals(flat["x"])
    assert len(objects[:0].to_frame()) == 0


def test_arrow_table(objects):
    pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    table, frame = objects.to_arrow(), objects.to_frame()
    assert table.column_names == list(frame)
    assert table.column("category").to_pylist() == frame["category"].tolist()
    assert table.column("value").null_count == frame["value"].isna().sum() > 0
    assert table.column("x").to_pylist() == frame["x"].tolist()


def test_text_dict_and_logic(objects):
    state = objects[5]
    records = state.to_list()
    lines = state.to_text().split("\n")
    assert lines[0] == "Player 0: 4 x 10 at (140, 34)"
    assert lines[-1] == "EnemyScore 0: 12 x 20 at (36, 1), value 5"
    assert len(lines) == len(records)
    assert [{"category": name, **r} for name, rs in state.to_dict().items() for r in rs] == records
    atoms = state.to_logic()
    assert {"type(ball_0,ball)", "at(ball_0,37,133)", "size(ball_0,2,4)", "value(enemy_score_0,5)", "hud(enemy_score_0)"} <= set(atoms)
    assert len(atoms) == 4 * len(records) + 4


@pytest.mark.parametrize(("name", "want"), [("Player", "player"), ("YellowBlueTank", "yellow_blue_tank"), ("EndNPC", "end_npc")])
def test_constants(name, want):
    assert constant(name) == want


def test_batches_and_states_without_objects(objects):
    batch = jax.tree.map(lambda a: a[:6].reshape(2, 3, *a.shape[1:]), objects)
    for one in ("to_text", "to_dict", "to_logic"):
        nested = getattr(batch, one)()
        assert [s for rows in nested for s in rows] == [getattr(objects[i], one)() for i in range(6)]
        assert getattr(objects[:0], one)() == []
    empty = jax.tree.map(np.zeros_like, objects[0])
    assert (empty.to_text(), empty.to_dict(), empty.to_logic()) == ("", {}, [])


def test_orientation_is_named():
    game = ocjax.load("Asteroids")
    state = game.rem(excerpt("Asteroids")["rams"][0])
    record = state.to_list()[0]
    assert record["category"] == "Player"
    state = dataclasses.replace(state, orientation=jnp.full_like(state.orientation, 3))
    assert state.to_text().split("\n")[0].endswith(", facing ENE")
    assert "orientation(player_0,3)" in state.to_logic()
    pytest.importorskip("pandas")
    frame = state.to_frame()
    assert frame["orientation"][0] == 3
    unknown = dataclasses.replace(state, orientation=jnp.full_like(state.orientation, UNKNOWN))
    assert unknown.to_frame()["orientation"].isna().all()
    assert "facing" not in unknown.to_text()


def test_selected_slots_have_no_game(objects):
    for one in (Objects.to_frame, Objects.to_arrow, Objects.to_logic, Objects.to_text, Objects.to_dict):
        with pytest.raises(ValueError, match="no reference to their game"):
            one(objects.of(GAME, "Ball"))


def test_a_category_is_selected_by_its_name_or_itself():
    game = ocjax.load("Pong")
    objects = game.rem(excerpt("Pong")["rams"][:4])
    for category in game.categories:
        assert np.array_equal(objects.of(game, category).xywh, objects.of(game, category.name).xywh)
    with pytest.raises(ValueError, match="Pong has no category 'Car'; it has Player, "):
        objects.of(game, "Car")
    with pytest.raises(ValueError, match="not those of `of`"):
        objects.of(game, "Ball").to_list()
