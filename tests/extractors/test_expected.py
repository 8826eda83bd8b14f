"""Every game's objects on all of its recordings equal the objects in `tests/data/expected`."""

import pytest

from tests.support.record import excerpts, expected, history
from tests.support.states import DATA

CHECKSUM = "arbitrary state all"  # in the differences of the last section


def test_objects_are_as_expected(game, thorough):
    path = expected.path(game, DATA)
    command = f"python -m tests.support.record {game.name} expected"
    assert path.exists(), f"{path} is missing: `{command}` makes it"
    for part in ("limits", "edits"):
        assert (DATA / part / path.name).exists(), (
            f"`python -m tests.support.record {game.name} {part}` makes it"
        )
    text = path.read_text(encoding="utf-8")
    if not thorough:
        text = text[: text.index(f"{expected.ARBITRARY}\n")]
    found = expected.differences(text, expected.describe(game, DATA, arbitrary_too=thorough))
    examples = history.changed_states(game, DATA) if any(CHECKSUM in line for line in found) else []
    more = f"and {len(found) - 20} more" if len(found) > 20 else ""
    right = f"If what is new is right: `{command}`"
    assert not found, "\n".join([*found[:20], more, *examples[:20], right])


def test_all_recordings_are_compared():
    folders = {path.parent.relative_to(DATA).as_posix() for path in DATA.rglob("*.npz")}
    assert folders == {folder or "." for folder in excerpts.FOLDERS}


def test_differences_name_state_and_slot():
    old = (
        "Ball usually #ececec\n[ends/Pong.npz]\n0 rem: Player 9,9,4,9; Ball 7,6,2,4 - 1,2,3,4\n1 "
        "rem:\n"
    )
    new = (
        "Ball usually #ececed\n[ends/Pong.npz]\n0 rem: Player 9,9,4,9; Ball 7,6,2,4 5,6,7,8\n0 "
        "vem: Ball -\n1 rem:\n1 vem: Ball 1,1,1,1\n"
    )
    assert expected.differences(old, old) == []
    assert [line.partition(" (")[0] for line in expected.differences(old, new)] == [
        "usual colour of Ball: expected #ececec, got #ececed",
        "ends/Pong.npz state 0 rem Ball 1: expected -, got 5,6,7,8",
        "ends/Pong.npz state 0 rem Ball 2: expected 1,2,3,4, got -",
        "ends/Pong.npz state 0 vem Ball 0: expected 7,6,2,4, got -",
        "ends/Pong.npz state 0 vem Ball 2: expected 1,2,3,4, got -",
        "ends/Pong.npz state 1 vem Ball 0: expected -, got 1,1,1,1",
    ]


@pytest.mark.parametrize("section", ["edited", "arbitrary"])
def test_differences_of_states_without_frames_name_no_other_method(section):
    old, new = (f"[{section}]\n3 rem: Ball {text}\n" for text in ("9,9,4,9", "9,8,4,9"))
    assert expected.differences(old, new) == [
        f"{section} state 3 rem Ball 0: expected 9,9,4,9, got 9,8,4,9"
    ]


@pytest.mark.parametrize(
    ("expected_box", "box", "vem", "change"),
    [
        ("9,9,4,9", "9,8,4,9", "9,9,4,9", "VEM 9,9,4,9: further from the screen"),
        ("9,8,4,9", "9,9,4,9", "9,9,4,9", "VEM 9,9,4,9: nearer to the screen"),
        ("9,8,4,9", "9,10,4,9", "9,9,4,9", "VEM 9,9,4,9: as far from the screen"),
        ("9,9,4,9", "-", "9,9,4,9", "VEM 9,9,4,9: further from the screen"),
        ("-", "50,9,4,9", "9,9,4,9", "VEM 9,9,4,9: further from the screen"),
        ("9,9,4,9=1", "9,9,4,9=2", "9,9,4,9=2", "VEM 9,9,4,9=2: nearer to the screen"),
    ],
)
def test_differences_compare_with_the_screen(expected_box, box, vem, change):
    old, new = (
        f"[Pong.npz]\n0 rem: Ball {text}\n0 vem: Ball {vem}\n" for text in (expected_box, box)
    )
    assert expected.differences(old, new) == [
        f"Pong.npz state 0 rem Ball 0: expected {expected_box}, got {box} ({change})"
    ]
