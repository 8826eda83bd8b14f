"""Readable and tabular forms of objects."""

import dataclasses
import pickle

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import ocjax
from ocjax.extraction.objects import Objects
from ocjax.extraction.records import FIELDS, Fields, constant, no_objects
from ocjax.vision.unknown import UNKNOWN
from tests.support.record.deciding import in_batches
from tests.support.states import excerpt

GAME = ocjax.load("Pong")


@pytest.fixture(scope="module")
def objects():
    return GAME.rem(excerpt("Pong")["rams"])


def test_fields_are_those_of_objects(objects):
    assert (
        tuple(FIELDS)
        == Fields._fields
        == tuple(f.name for f in dataclasses.fields(Objects) if f.name != "game")
    )
    for name, empty in no_objects(objects.valid.shape[:-1], GAME.num_slots).items():
        assert (getattr(objects, name).shape, getattr(objects, name).dtype) == (
            empty.shape,
            empty.dtype,
        )


def test_take(objects):
    """`take` gathers slots in every field; a slot out of range is empty."""
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
        assert all(
            getattr(line, key) == record[key]
            for key in ("category", "slot", "x", "y", "w", "h", "hud")
        )
        assert record.get("value", "missing") == (
            line.value if isinstance(line.value, int | np.integer) else "missing"
        )


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
    assert {
        "type(ball_0,ball)",
        "at(ball_0,37,133)",
        "size(ball_0,2,4)",
        "value(enemy_score_0,5)",
        "hud(enemy_score_0)",
    } <= set(atoms)
    assert len(atoms) == 4 * len(records) + 4


@pytest.mark.parametrize(
    ("name", "want"),
    [("Player", "player"), ("YellowBlueTank", "yellow_blue_tank"), ("EndNPC", "end_npc")],
)
def test_constants(name, want):
    assert constant(name) == want


def test_batches_and_states_without_objects(objects):
    batch = jax.tree.map(lambda a: a[:6].reshape(2, 3, *a.shape[1:]), objects)
    for one in ("to_text", "to_dict", "to_logic"):
        nested = getattr(batch, one)()
        assert [s for rows in nested for s in rows] == [
            getattr(objects[i], one)() for i in range(6)
        ]
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


def test_objects_of_a_category_keep_game_and_category(objects):
    ball = objects.of("Ball")
    assert ball.game is not None
    assert ball.game.name == "Pong"
    assert [c.name for c in ball.game.categories] == ["Ball"]
    assert ball.to_list() == [
        [r for r in state if r["category"] == "Ball"] for state in objects.to_list()
    ]
    assert ball.to_dict() == [
        {name: found for name, found in state.items() if name == "Ball"}
        for state in objects.to_dict()
    ]
    assert ball.to_text() == [
        "\n".join(line for line in state.splitlines() if line.startswith("Ball "))
        for state in objects.to_text()
    ]
    assert ball.to_logic() == [
        [atom for atom in state if "(ball_0" in atom] for state in objects.to_logic()
    ]
    assert [o.to_list() for o in ball] == ball.to_list()
    assert len(ball) == len(objects)


def test_tables_of_a_category(objects):
    pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    table, ball = objects.to_frame(), objects.of("Ball").to_frame()
    expected = table[table["category"] == "Ball"].reset_index(drop=True)
    assert ball["category"].tolist() == expected["category"].tolist()
    assert ball.drop(columns="category").equals(expected.drop(columns="category"))
    assert objects.of("Ball").to_arrow().num_rows == len(ball)


def test_slots_of_a_category_of_several_slots_count_from_0():
    objects = ocjax.load("Asterix").rem(excerpt("Asterix")["rams"])
    enemies = objects.of("Enemy")
    assert enemies.of("Enemy").game is enemies.game
    assert enemies.to_list() == [
        [r for r in state if r["category"] == "Enemy"] for state in objects.to_list()
    ]


def test_objects_of_a_category_pass_jax_and_pickle(objects):
    ball = objects.of("Ball")
    assert jax.jit(lambda o: o.of("Ball"))(objects).game is ball.game
    assert jax.vmap(lambda o: o.of("Ball").center)(objects).shape == (len(objects), 1, 2)
    assert pickle.loads(pickle.dumps(ball)).game is ball.game
    assert ocjax.track(ball[0], ball[1]).game is ball.game


@pytest.mark.parametrize(
    "one",
    [Objects.to_frame, Objects.to_arrow, Objects.to_logic, Objects.to_text, Objects.to_dict],
)
def test_objects_without_a_game_have_no_categories(objects, one):
    with pytest.raises(ValueError, match="no reference to their game"):
        one(dataclasses.replace(objects, game=None))


def test_a_category_is_selected_by_its_name_or_itself():
    game = ocjax.load("Pong")
    objects = game.rem(excerpt("Pong")["rams"][:4])
    for category in game.categories:
        assert np.array_equal(objects.of(category).xywh, objects.of(category.name).xywh)
    with pytest.raises(ValueError, match="of Pong have no category 'Car'; they have Player, "):
        objects.of("Car")
    with pytest.raises(ValueError, match="of Pong have no category 'Player'; they have Ball"):
        objects.of("Ball").of("Player")


def test_objects_behave_like_their_batch(objects):
    n = len(objects.valid)
    assert len(objects) == n
    assert [len(o.valid) for o in objects] == [objects.valid.shape[1]] * n
    assert np.array_equal(objects[-1].xywh, objects.xywh[-1])
    assert np.array_equal(objects[np.array([1, 0])].valid, objects.valid[np.array([1, 0])])
    for index in (n, -n - 1, np.array([0, n]), (0, 0)):
        with pytest.raises(IndexError):
            objects[index]
    state = objects[0]
    for call in (len, list, lambda o: o[0]):
        with pytest.raises(TypeError, match="objects of one state"):
            call(state)
    assert bool(state)
    assert jax.jit(lambda o, i: o[i])(objects, 1).valid.shape == state.valid.shape


def test_a_category_of_another_game_is_refused(objects):
    stripped = dataclasses.replace(objects, game=None)
    assert np.array_equal(objects.of("Ball").xywh, stripped.of("Ball", GAME).xywh)
    assert np.array_equal(objects.of(GAME.categories[0]).xywh, objects.of("Player").xywh)
    with pytest.raises(ValueError, match="objects of Pong, not of Breakout"):
        objects.of("Ball", ocjax.load("Breakout"))
    with pytest.raises(ValueError, match="give it, as in"):
        stripped.of("Ball")
    with pytest.warns(DeprecationWarning, match=r"now objects\.of\(category\)"):
        assert np.array_equal(objects.of(GAME, "Ball").xywh, objects.of("Ball").xywh)
    with pytest.raises(ValueError, match="expected a category"):
        objects.of(GAME)


def test_velocities_are_of_one_game_and_of_a_category(objects):
    moved = ocjax.velocity(objects[:-1], objects[1:])
    ball = GAME.slices["Ball"]
    assert np.array_equal(
        ocjax.velocity(objects[:-1].of("Ball"), objects[1:].of("Ball")), moved[:, ball]
    )
    with pytest.raises(ValueError, match="got Pong and Breakout"):
        ocjax.velocity(objects, ocjax.load("Breakout").rem(np.zeros((len(objects), 128), np.uint8)))
    for one, other in ((objects, objects.of("Ball")), (objects.of("Enemy"), objects.of("Ball"))):
        with pytest.raises(ValueError, match=r"the same slots in both states, got .*Enemy.* and"):
            ocjax.velocity(one, other)
    stripped = dataclasses.replace(objects, game=None)
    with pytest.raises(ValueError, match="the same slots in both states, got 5 and 1"):
        ocjax.velocity(stripped, objects.of("Ball"))


def test_objects_are_shown_in_an_interpreter_and_a_notebook(objects):
    shown = repr(objects)
    assert shown.startswith(
        f"Objects of Pong, 5 slots, batch shape [{len(objects)}]. The first state:\n"
    )
    assert objects[0].to_text().splitlines()[0] in shown
    assert len(shown.splitlines()) <= 6
    assert repr(objects[0]).startswith("Objects of Pong, 5 slots, batch shape []:\n")
    assert repr(objects.of("Ball")).startswith(
        f"Objects of Pong, category Ball, 1 slot, batch shape [{len(objects)}]. "
    )
    stripped = dataclasses.replace(objects, game=None)
    assert repr(stripped).startswith("Objects of no game, 5 slots, batch shape")
    assert repr(objects[:0]).endswith("batch shape [0], 0 valid")
    assert "no objects" in repr(jax.tree.map(np.zeros_like, objects))
    assert "xywh=" in repr(jax.eval_shape(lambda: objects))
    assert objects._repr_html_().count("<rect") == int(np.sum(objects.valid[0]))
    assert "PlayerScore" in objects._repr_html_()
    assert "<rect" not in objects[:0]._repr_html_()
    assert all(c.doc in GAME._repr_html_() for c in GAME.categories)
    assert GAME.categories[2].doc in GAME.categories[2]._repr_html_()
    assert len(repr(GAME.categories)) < 700


def test_every_state_is_shown_in_at_most_20_lines(game, truth):
    objects = in_batches(game.rem, truth["rams"])
    most = objects[int(np.argmax(objects.valid.sum(axis=1)))]
    lines = repr(most).splitlines()
    assert 2 <= len(lines) <= 20
    assert all(len(line) < 100 for line in lines)


def test_categories_with_many_objects_are_counted():
    objects = ocjax.load("MsPacman").rem(excerpt("MsPacman")["rams"])[0]
    pills = objects.of("Pill")
    assert f"  Pill: {int(pills.valid.sum())} of 204" in repr(objects).splitlines()
    assert f"  {objects.of('Player').to_text()}" in repr(objects).splitlines()


def test_long_tables_are_cut_in_a_notebook():
    game = ocjax.load("SpaceInvaders")
    objects = game.rem(excerpt("SpaceInvaders")["rams"])
    most = objects[int(np.argmax(objects.valid.sum(axis=1)))]
    number = int(most.valid.sum())
    assert number > 30
    assert f"and {number - 30} more" in most._repr_html_()
    assert most._repr_html_().count("<rect") == number
