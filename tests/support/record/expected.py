"""Expected objects: all objects that REM and VEM report on a game's excerpts, as text that a
reviewer reads as a diff.

    Ball usually #ececec
    [ends/Pong.npz]
    0 rem: Player 140,99,4,16; Ball 78,60,2,4; PlayerScore 116,1,12,20=0
    0 vem: Ball -
    [edited]
    0 rem: Player 140,99,4,16; Ball 78,60,2,4; PlayerScore 104,1,24,20=19
    [arbitrary]
    all rem: Player 871/9f86d081; Ball 655/60303ae2; PlayerScore 1024/d7a8fbb3

A line holds the objects of one state: for each category its slots in order, each `x,y,w,h`, then
`=value`, `@orientation` (`?` where it is unknown) and `#rgb` if it is not the category's usual
colour. `-` is a slot without an object; the line omits such slots at the end. VEM's line names only
the categories that differ from REM; without differences, it is missing. Equal texts mean equal
fields.

The section `edited` covers the edited states (`edits`), which have no frames. The last section
covers arbitrary states and frames (`arbitrary`), and frames with objects at the limits of the
vision rules (`limits`): by category the number of objects, and a checksum of all their fields.
"""

import re
import zlib
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ocjax import recordings
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.recordings import Recording
from ocjax.vision.unknown import UNKNOWN, UNKNOWN_VALUE
from tests.support.record import arbitrary, edits, excerpts, limits
from tests.support.record.deciding import in_batches

EDITED = "[edited]"  # the heading of the section of edited states
ARBITRARY = "[arbitrary]"  # the heading of the last section
ONE_METHOD = ("edited ", "arbitrary ")  # sections with states for one method only
NOTHING = "-"
ABSENT = 1000.0  # the distance of a missing box; boxes that overlap are nearer

Slots = dict[str, tuple[str, ...]]  # the texts of a state's slots by category


def path(game: Game, data: Path) -> Path:
    """The file of a game's expected objects in `tests/data`."""
    return data / "expected" / f"{game.name}.txt"


def describe(game: Game, data: Path, *, arbitrary_too: bool = True) -> str:
    """The text of a game's expected objects.

    Args:
        game: the game.
        data: the folder `tests/data`.
        arbitrary_too: whether to write the last section, which takes most of the time.
    """
    tapes = {file: recordings.read(file, game.name) for file in excerpts.paths(data, game)}
    found = {
        file: (in_batches(game.rem, tape.rams), in_batches(game.vem, _frames(tape)))
        for file, tape in tapes.items()
    }
    usual = _usual_colors(game, [objects for both in found.values() for objects in both])
    lines = [f"{category} usually {color}" for category, color in usual.items()]
    for file, (rem, vem) in found.items():
        lines.append(f"[{file.relative_to(data).as_posix()}]")
        for i in range(len(tapes[file])):
            lines += _lines_of_state(
                str(i), slots_of(game, rem[i], usual), slots_of(game, vem[i], usual)
            )
    lines += [EDITED, *_edited_states(game, data, usual)]
    if arbitrary_too:
        lines += [ARBITRARY, *_checksums(game, data)]
    return "\n".join(lines) + "\n"


def _edited_states(game: Game, data: Path, usual: Mapping[str, str]) -> Iterator[str]:
    """The lines about edited states."""
    text = edits.path(game, data).read_text(encoding="utf-8")
    rams = edits.states(text, edits.recorded(game, data))
    for i, objects in enumerate(in_batches(game.rem, rams) if len(rams) else ()):
        there = _there(slots_of(game, objects, usual))
        yield f"{i} rem: {_join(there)}".rstrip()


def _frames(tape: Recording) -> np.ndarray:
    if tape.screens is None:
        raise recordings.RecordingError(f"an excerpt of {tape.game.name} has no frames")
    return tape.screens


def arbitrary_inputs(game: Game, data: Path) -> dict[str, np.ndarray]:
    """The arbitrary states and frames by method.

    Args:
        game: the game.
        data: the folder `tests/data`.
    """
    tapes = [recordings.read(file, game.name) for file in excerpts.paths(data, game)]
    played = np.concatenate([_frames(tape) for tape in tapes])
    return {
        "rem": arbitrary.rams(game, np.concatenate([tape.rams for tape in tapes])),
        "vem": np.concatenate([arbitrary.frames(game, played), limits.read(game, data)]),
    }


def _checksums(game: Game, data: Path) -> Iterator[str]:
    """The lines about arbitrary states and frames."""
    for method, inputs in arbitrary_inputs(game, data).items():
        found = in_batches(getattr(game, method), inputs)
        yield f"all {method}: " + "; ".join(
            f"{c.name} {_checksum(found.of(c))}" for c in game.categories
        )


def _checksum(objects: Objects) -> str:
    """The number of objects, and a checksum of their fields."""
    fields = (objects.xywh, objects.valid, objects.orientation, objects.value, objects.rgb)
    checksum = 0
    for field in fields:
        checksum = zlib.crc32(np.ascontiguousarray(field, "<i4").data, checksum)
    return f"{np.count_nonzero(objects.valid)}/{checksum:08x}"


def _usual_colors(game: Game, found: list[Objects]) -> dict[str, str]:
    """The most frequent colour of each category that occurs."""
    out = {}
    for c in game.categories:
        s = game.slices[c.name]
        colors = np.concatenate([o.rgb[:, s][o.valid[:, s]] for o in found])
        if len(colors):
            distinct, counts = np.unique(colors, axis=0, return_counts=True)
            out[c.name] = _hex(distinct[counts.argmax()])
    return out


def _hex(rgb: Any) -> str:
    return "#" + bytes(rgb.tolist()).hex()


def slots_of(game: Declaration, state: Objects, usual: Mapping[str, str]) -> Slots:
    """The texts of a state's slots, by category."""
    out = {}
    for c in game.categories:
        s = game.slices[c.name]
        texts = [_text(state, k, c.attributes, usual.get(c.name)) for k in range(s.start, s.stop)]
        while texts and texts[-1] == NOTHING:
            texts.pop()
        out[c.name] = tuple(texts) or (NOTHING,)
    return out


def _text(state: Objects, k: int, attributes: tuple[str, ...], usual: str | None) -> str:
    if not state.valid[k]:
        return NOTHING
    text = ",".join(map(str, state.xywh[k].tolist()))
    for name, sign, unknown in (("value", "=", UNKNOWN_VALUE), ("orientation", "@", UNKNOWN)):
        number = int(getattr(state, name)[k])
        if name in attributes or number:
            text += sign + ("?" if number == unknown else str(number))
    color = _hex(state.rgb[k])
    return text if color == usual else text + color


def _lines_of_state(number: str, rem: Slots, vem: Slots) -> Iterator[str]:
    yield f"{number} rem: {_join(_there(rem))}".rstrip()
    different = {c: texts for c, texts in vem.items() if texts != rem[c]}
    if different:
        yield f"{number} vem: {_join(different)}"


def _there(slots: Slots) -> Slots:
    """The categories that have objects."""
    return {category: texts for category, texts in slots.items() if texts != (NOTHING,)}


def _join(slots: Slots) -> str:
    return "; ".join(f"{category} {' '.join(texts)}" for category, texts in slots.items())


def differences(expected: str, got: str) -> list[str]:
    """The differences of two texts of `describe`, one line a slot.

    A line with another box also gives the other method's boxes in this state, and whether the
    change moves the box towards them. VEM's boxes come from the screen. Edited and arbitrary states
    have no frames, and arbitrary frames no RAM.
    """
    a, b = _entries(expected), _entries(got)
    boxes: dict[str, list[str]] = defaultdict(list)  # by state, method and category
    for key, text in b.items():
        if _is_box(text):
            boxes[key.rpartition(" ")[0]].append(text)
    return [
        f"{key}: expected {a.get(key, NOTHING)}, got {b.get(key, NOTHING)}"
        f"{_compared(key, a.get(key, NOTHING), b.get(key, NOTHING), boxes)}"
        for key in a | b
        if a.get(key, NOTHING) != b.get(key, NOTHING)
    ]


def _compared(key: str, expected: str, got: str, boxes: Mapping[str, Sequence[str]]) -> str:
    """The comparison of a slot's old and new text, if they are boxes, with the other method's
    boxes."""
    if key.startswith(ONE_METHOD) or not (_is_box(expected) or _is_box(got)):
        return ""
    slot = key.rpartition(" ")[0]
    is_rem = " rem " in slot
    other, target = ("VEM", "the screen") if is_rem else ("REM", "REM")
    near = boxes.get(re.sub(" (rem|vem) ", f" {other.lower()} ", slot), ())
    before, after = _distance(expected, near), _distance(got, near)
    change = f"as far from {target}"
    if after < before:
        change = f"nearer to {target}"
    elif after > before:
        change = f"further from {target}"
    return f" ({other} {' '.join(near) or NOTHING}: {change})"


def _is_box(text: str) -> bool:
    return text.count(",") == 3


def _numbers(text: str) -> list[int]:
    """Left, top, width and height of a slot's text."""
    return [int(number) for number in re.findall(r"-?\d+", text)[:4]]


def _distance(text: str, others: Sequence[str]) -> float:
    """The distance of a slot's text from the nearest of others.

    Overlapping boxes differ by the sum of the differences of their numbers, and by a half if
    their value or colour differs. A missing box is further away than any box that overlaps
    another, and a box that overlaps none is further away than a missing one.
    """
    if text == NOTHING:
        return ABSENT if others else 0.0
    near = [
        sum(abs(a - b) for a, b in zip(_numbers(text), _numbers(other), strict=True))
        + (text != other) / 2
        for other in others
        if _overlap(_numbers(text), _numbers(other))
    ]
    return min(near, default=2 * ABSENT)


def _overlap(a: Sequence[int], b: Sequence[int]) -> bool:
    return all(
        a[axis] < b[axis] + b[axis + 2] and b[axis] < a[axis] + a[axis + 2] for axis in (0, 1)
    )


def _entries(text: str) -> dict[str, str]:
    """The entries of a text, by state, method, category and slot."""
    out: dict[str, str] = {}
    states: dict[str, dict[str, list[str]]] = {}
    section = ""
    for line in text.splitlines():
        if line.startswith("["):
            section = line.strip("[]")
        elif " usually " in line:
            category, _, color = line.partition(" usually ")
            out[f"usual colour of {category}"] = color
        else:
            state, method, *rest = line.split(" ", 2)
            slots = {
                category: texts
                for part in "".join(rest).split("; ")
                if part
                for category, *texts in [part.split(" ")]
            }
            own = f"{section} state {state}"
            if method == "rem:" or f"{section} ".startswith(ONE_METHOD):
                states[f"{own} {method.rstrip(':')}"] = slots
            if not f"{section} ".startswith(ONE_METHOD):
                states[f"{own} vem"] = states[f"{own} rem"] | slots
    return out | {
        f"{s} {c} {k}": t
        for s, slots in states.items()
        for c, texts in slots.items()
        for k, t in enumerate(texts)
    }
