"""The text of a disassembled program, and the table of its writes to the RAM."""

import collections
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ocjax.console.ram import RAM_SIZE, RamMap
from ocjax.evaluation.tables import Table
from ocjax.ramtools.disassembly import code, registers
from ocjax.ramtools.disassembly.cartridge import Cartridge
from ocjax.ramtools.disassembly.code import Instruction
from ocjax.ramtools.disassembly.opcodes import CHANGES, LEAVES, STORES
from ocjax.ramtools.disassembly.tracing import TIMES, Trace, Writes

HEADING = """\
; {name}: {size} bytes, cartridge {kind}
; {count:,} instructions, of which {run:,} ran, in {frames:,} frames of play.
; Columns: {place}bytes, instruction; the cycle of the scan line at which it begins.
; If that differs, the earliest and the latest cycle. For instructions that did not run, +n is the
; number of cycles since the last store to WSYNC, if the program does not branch between them."""
OPERANDS = {  # text of an operand by the addressing mode
    "implied": "",
    "accumulator": "A",
    "immediate": "#${0:02X}",
    "zero,x": "{1},X",
    "zero,y": "{1},Y",
    "(zero,x)": "({1},X)",
    "(zero),y": "({1}),Y",
    "absolute,x": "{1},X",
    "absolute,y": "{1},Y",
    "(absolute)": "({1})",
}
SHOWN_ADDRESSES = 6  # of writes, per cell


@dataclass(frozen=True)
class Program:
    """A disassembled program: reachable instructions by offset, and the names of RAM bytes."""

    name: str
    cartridge: Cartridge
    instructions: Mapping[int, Instruction]
    trace: Trace
    fields: Mapping[int, str]


def program(name: str, cartridge: Cartridge, trace: Trace, ram: type[RamMap] | None) -> Program:
    """Disassemble a program from the reset and all executed instructions.

    Args:
        ram: the game's names of its bytes, if it has a decoder.
    """
    ran = sorted((v.address, v.slots) for v in trace.visits.values())
    instructions = code.reachable(cartridge, [code.start(cartridge), *ran])
    return Program(name, cartridge, instructions, trace, field_names(ram) if ram else {})


def field_names(ram: type[RamMap]) -> dict[int, str]:
    """The names of the bytes that a game's `Ram` declares. Several names are joined by /.

    Numbers of several bytes are "score.0", "score.1", ..., the most significant byte first.
    """
    names: dict[int, dict[str, None]] = collections.defaultdict(dict)
    for field in ram.fields().values():
        for label, place in field.labelled():
            for k, address in enumerate(place):
                names[address][f"{label}.{k}" if len(place) > 1 else label] = None
    return {address: "/".join(labels) for address, labels in names.items()}


def lines(p: Program) -> Iterator[str]:
    """The listing, by bank and address."""
    yield HEADING.format(
        name=p.name,
        size=len(p.cartridge.data),
        kind=p.cartridge.kind,
        count=len(p.instructions),
        run=sum(offset in p.instructions for offset in p.trace.visits),
        frames=p.trace.frames,
        place="bank and address, " if p.cartridge.banks > 1 else "address, ",
    )
    if p.trace.failed:
        yield f"; {p.trace.failed:,} states of play could not be followed for a frame."
    reached = {offset // p.cartridge.bank for offset in p.instructions}
    for bank in sorted(set(range(p.cartridge.banks)) - reached):
        yield f"; Bank {bank} was not reached. It may hold pictures or tables alone."
    labels, before, cycles = _labels(p), None, None
    for offset in sorted(p.instructions):
        instruction = p.instructions[offset]
        follows = before is not None and before.offset + len(before.data) == offset
        if before is not None and offset > before.offset + len(before.data):
            size = offset - before.offset - len(before.data)
            yield f"\n; {size:,} bytes of data, or of code that was not reached"
        if offset in labels:
            yield f"\n{labels[offset]}:"
        cycles = _straight(before, cycles) if follows and offset not in labels else None
        yield _line(p, instruction, labels, cycles)
        before = instruction


def _labels(p: Program) -> dict[int, str]:
    out: dict[int, str] = {}
    for instruction in p.instructions.values():
        if instruction.target is not None:
            offset = _target(p, instruction)
            is_call = instruction.opcode.name == "JSR"
            if offset in p.instructions and (is_call or offset not in out):
                place = _place(p, p.instructions[offset]).replace(":", "_")
                out[offset] = f"{'sub' if is_call else 'at'}_{place}"
    address, slots = code.start(p.cartridge)
    if address & 0x1000:
        out[p.cartridge.offset(address, slots)] = "reset"
    return out


def _target(p: Program, instruction: Instruction) -> int:
    """The offset of the instruction to which one jumps."""
    slots = code.switched(p.cartridge, instruction)
    return p.cartridge.offset(instruction.operand, slots)


def _place(p: Program, instruction: Instruction) -> str:
    address = f"{instruction.address:04X}"
    bank = instruction.offset // p.cartridge.bank
    return f"{bank}:{address}" if p.cartridge.banks > 1 else address


def _straight(before: Instruction | None, cycles: int | None) -> int | None:
    """Cycles since WSYNC behind an instruction, whose own count is given."""
    if before is None or before.opcode.name in LEAVES:
        return None
    if _written(before) == "WSYNC":
        return 0
    return None if cycles is None else cycles + before.opcode.cycles


def _written(instruction: Instruction) -> str | None:
    """The name of the register that an instruction writes directly."""
    writes = instruction.opcode.name in STORES and instruction.opcode.mode in ("zero", "absolute")
    return registers.name(instruction.operand, written=True) if writes else None


def _line(
    p: Program, instruction: Instruction, labels: Mapping[int, str], straight: int | None
) -> str:
    data = instruction.data.hex(" ").upper()
    text = f"{_place(p, instruction)}  {data:<8}  {_text(p, instruction, labels):<28}"
    visit = p.trace.visits.get(instruction.offset)
    if visit is not None:
        several = visit.first != visit.last
        return f"{text} ; {visit.first}" + (f"-{visit.last}" if several else "")
    return text.rstrip() if straight is None else f"{text} ; +{straight}"


def _text(p: Program, instruction: Instruction, labels: Mapping[int, str]) -> str:
    name, mode, _ = instruction.opcode
    if instruction.target is not None:
        label = labels.get(_target(p, instruction), f"${instruction.operand:04X}")
        return f"{name} {label}"
    shown = _operand(p, instruction)
    form = OPERANDS.get(mode, "{1}")
    after = code.switched(p.cartridge, instruction)
    note = "  (switches banks)" if after != instruction.slots else ""
    return f"{name} {form.format(instruction.operand, shown)}".rstrip() + note


def _operand(p: Program, instruction: Instruction) -> str:
    """The name of an operand that is an address."""
    address, name = instruction.operand, instruction.opcode.name
    if not address & 0x1000 and registers.is_ram(address):
        byte = address & 0x7F
        return p.fields.get(byte, f"byte{byte}")
    extra = p.cartridge.extra(address)
    if extra is not None:
        return f"extra{extra}"
    register = registers.name(address, written=name in STORES or name in CHANGES)
    return register or f"${address:0{4 if len(instruction.data) > 2 else 2}X}"


def write_table(p: Program) -> Table:
    """For each byte of RAM, the instructions that write it, by the time of their writes.

    Return addresses that calls write to the stack are omitted.
    """
    found: dict[int, dict[str, list[str]]] = collections.defaultdict(
        lambda: {time: [] for time in TIMES}
    )
    for (byte, offset, time), writes in sorted(p.trace.writes.items()):
        instruction = p.instructions.get(offset)
        if instruction is None:
            where = "code in RAM"
        elif instruction.opcode.name in ("JSR", "BRK"):
            continue
        else:
            where = _place(p, instruction)
        found[byte][time].append(f"{where} ({_scan_lines(writes)})")
    rows = []
    for byte in range(RAM_SIZE):
        name, cells = p.fields.get(byte, ""), [_shortened(found[byte][time]) for time in TIMES]
        if any(cells):
            rows.append([str(byte), name, *cells])
    heads = [f"{time} drawing".capitalize() for time in TIMES]
    title = f"{p.name}: writes to RAM in {p.trace.frames:,} frames of play, with scan lines"
    return Table(title, ["Byte", "Name", *heads], rows)


def _scan_lines(writes: Writes) -> str:
    return str(writes.first) if writes.first == writes.last else f"{writes.first}-{writes.last}"


def _shortened(places: list[str]) -> str:
    more = len(places) - SHOWN_ADDRESSES
    return ", ".join(places[:SHOWN_ADDRESSES]) + (f" and {more} more" if more > 0 else "")
