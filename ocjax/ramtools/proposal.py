"""A proposal for a game's `Ram` class, from the results of `ocjax ram correlate`."""

import collections
import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from ocjax.ramtools.correlate import Finding
from ocjax.ramtools.fits import Fit, Source, affine_text
from ocjax.ramtools.rows import Row

LEAST = 0.5  # least fraction of samples that a proposed formula gets right
LEAST_TABLE = 0.9  # the same for tables, which fit more easily
SHOWN_VALUES = 3  # values of a table in its comment


class _Entry(NamedTuple):
    """A field of the class, or a note if it has no source."""

    name: str
    source: Source | None
    addresses: tuple[int, ...]  # of one number, most significant byte first
    meaning: str
    exact: float


def ram_class(findings: Iterable[Finding]) -> str:
    """The source of a class `Ram` with the best formula of each finding, sorted by address.

    A comment gives the byte as a function of the coordinate, such as `x + 49`, and the percentage
    of right samples. A field has several places if one formula fits several objects. Rows that do
    not move are only comments.
    """
    found = [finding for finding in findings if finding.fits]
    displays = {finding.category for finding in found if finding.field == "value"}
    groups: dict[tuple[str, str, str], list[_Entry]] = collections.defaultdict(list)
    for finding in found:
        # the box of a number follows from its value
        if finding.field == "value" or finding.category not in displays:
            for entry in _entries(finding):
                reading = entry.source.reading if entry.source else ""
                groups[entry.name, reading, entry.meaning].append(entry)
    used: collections.Counter[str] = collections.Counter()
    lines = []
    for entries in sorted(groups.values(), key=lambda group: min(e.addresses for e in group)):
        used[entries[0].name] += 1
        lines.append(_line(entries, used[entries[0].name]))
    return "\n".join(["class Ram(RamMap):", *(lines or ["    pass"])]) + "\n"


def _entries(finding: Finding) -> Iterator[_Entry]:
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|\W+", "_", finding.category).lower()
    name = f"{words}_{finding.field}"
    if finding.digits:
        # findings begin with the lowest digits
        parts = [fit for fit in reversed(finding.fits) if isinstance(fit, Fit)]
        addresses = tuple(fit.source.address for fit in parts)
        exact = min(fit.exact for fit in parts)
        yield _Entry(name, parts[0].source, addresses, finding.field, exact)
        return
    for fit in finding.fits if finding.members else finding.fits[:1]:
        if fit.exact >= (LEAST_TABLE if isinstance(fit, Fit) and fit.table else LEAST):
            addresses = (fit.source.address,) if fit.source else ()
            yield _Entry(name, fit.source, addresses, _meaning(fit, finding.field), fit.exact)


def _meaning(fit: Fit | Row, field: str) -> str:
    """The number in RAM as a function of the field."""
    if isinstance(fit, Row):
        if fit.source is None:
            return f"{field} = {fit}"
        first = _inverse(fit.scale, fit.offset, f"{field} of slot 0")
        return f"{first}; {fit.pitch} pixels from slot to slot, {fit.slots} slots"
    if fit.table:
        return f"{field}: {fit.table_text(SHOWN_VALUES)}"
    more = f"; {field} is {fit.step:+d} where {fit.bit}" if fit.bit else ""
    if abs(fit.scale) != 1:
        return f"{field} = {affine_text('this', fit.scale, fit.offset)}{more}"
    return _inverse(fit.scale, fit.offset, field) + more


def _inverse(scale: int, offset: int, field: str) -> str:
    """The byte of a field that equals `scale * byte + offset`; scale is 1 or -1."""
    return affine_text(field, 1, -offset) if scale == 1 else f"{offset % 256} - {field}"


def _line(entries: list[_Entry], number: int) -> str:
    """The line of a field, or of the `number`-th field of its name."""
    first, percent = entries[0], 100 * min(entry.exact for entry in entries)
    comment = f"{first.meaning} ({percent:.0f} %)"
    if first.source is None:
        return f"    # {first.name}: {comment}"
    name = first.name if number == 1 else f"{first.name}_{number}"
    places = sorted({entry.addresses for entry in entries})
    numbers = (("({})" if len(p) > 1 else "{}").format(", ".join(map(str, p))) for p in places)
    text = ", ".join(numbers)
    return f"    {name} = {first.source.reading.format(text)}  # {comment}"
