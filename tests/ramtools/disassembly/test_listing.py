"""Listings of a hand-written program and of real games."""

import re

import pytest

import ocjax
from ocjax.ramtools import disassembly, roms
from ocjax.ramtools.disassembly import cartridge, code, listing, tracing
from tests.support.command import run

# One iteration of the main loop is a frame of two scan lines, with one picture and one subroutine.
PROGRAM = """
    78 A2 FF 9A
    A9 02 85 00 85 02 85 02 A9 00 85 00
    E6 80
    85 02 A9 FF 85 1B A9 00 85 1B
    20 40 F0
    C6 81
    4C 04 F0
"""


def synthetic():
    data = bytearray(b"\x02" * 4096)
    program = bytes.fromhex(PROGRAM)
    data[: len(program)] = program
    data[0x40:0x43] = bytes.fromhex("E6 82 60")
    data[0xFFC:] = bytes.fromhex("00 F0 00 F0")
    return cartridge.read(bytes(data))


@pytest.fixture(scope="module")
def program():
    rom = synthetic()
    return listing.program("Synthetic", rom, tracing.trace(rom, [bytes(128)] * 3), None)


def test_listing(program):
    text = "\n".join(listing.lines(program))
    assert (
        re.sub(r" +", " ", text[text.index("reset:") :]).strip()
        == """\
reset:
F000 78 SEI ; 0
F001 A2 FF LDX #$FF ; 2
F003 9A TXS ; 4

at_F004:
F004 A9 02 LDA #$02 ; 6-35
F006 85 00 STA VSYNC ; 8-37
F008 85 02 STA WSYNC ; 11-40
F00A 85 02 STA WSYNC ; 0
F00C A9 00 LDA #$00 ; 0
F00E 85 00 STA VSYNC ; 2
F010 E6 80 INC byte0 ; 5
F012 85 02 STA WSYNC ; 10
F014 A9 FF LDA #$FF ; 0
F016 85 1B STA GRP0 ; 2
F018 A9 00 LDA #$00 ; 5
F01A 85 1B STA GRP0 ; 7
F01C 20 40 F0 JSR sub_F040 ; 10
F01F C6 81 DEC byte1 ; 27
F021 4C 04 F0 JMP at_F004 ; 32

; 28 bytes of data, or of code that was not reached

sub_F040:
F040 E6 82 INC byte2 ; 16
F042 60 RTS ; 21"""
    )


def test_times_of_writes(program):
    """Only writes after the picture are invisible on its frame."""
    assert listing.write_table(program).rows == [
        ["0", "", "F010 (0)", "", ""],
        ["1", "", "", "", "F01F (1)"],
        ["2", "", "", "", "F040 (1)"],
    ]


def test_cycles_of_code_that_does_not_run():
    rom = synthetic()
    unseen = tracing.Trace({}, {}, 0, 0)
    text = re.sub(r" +", " ", "\n".join(listing.lines(listing.program("S", rom, unseen, None))))
    assert "F014 A9 FF LDA #$FF ; +0\nF016 85 1B STA GRP0 ; +2\n" in text
    assert "F004 A9 02 LDA #$02\n" in text, "unknown before the first WSYNC"


def test_code_in_several_banks():
    """A store to a hotspot continues in the other bank."""
    data = bytearray(b"\x02" * 8192)
    data[0x1000:0x1003] = bytes.fromhex("8D F8 FF")  # bank 1, at the reset
    data[0x0003:0x0006] = bytes.fromhex("4C 03 F0")  # bank 0
    data[0x1FFC:] = bytes.fromhex("00 F0 00 F0")
    rom = cartridge.read(bytes(data))
    assert sorted(code.reachable(rom, [code.start(rom)])) == [0x0003, 0x1000]
    blind = listing.program("S", rom, tracing.Trace({}, {}, 0, 1), None)
    text = "\n".join(listing.lines(blind))
    assert "1:F000  8D F8 FF  STA $FFF8  (switches banks)" in text
    assert "1 states of play could not be followed" in text


def test_unreached_bank():
    data = bytearray(b"\x02" * 8192)
    data[0x1000:0x1003] = bytes.fromhex("4C 00 F0")
    data[0x1FFC:] = bytes.fromhex("00 F0 00 F0")
    rom = cartridge.read(bytes(data))
    blind = listing.program("S", rom, tracing.Trace({}, {}, 0, 0), None)
    assert "; Bank 0 was not reached." in "\n".join(listing.lines(blind))


def test_pong():
    found = disassembly.disassemble("Pong", states=20)
    text = [re.sub(r" +", " ", line) for line in listing.lines(found)]
    start = text.index("\nreset:")
    assert text[start + 1 : start + 7] == [
        "F000 78 SEI ; 0",
        "F001 D8 CLD ; 2",
        "F002 A2 FF LDX #$FF ; 4",
        "F004 9A TXS ; 6",
        "F005 E8 INX ; 8",
        "F006 8A TXA ; 10",
    ]
    assert any(re.search(r"STA player_mask|SBC ball_y", line) for line in text)
    rows = {row[1]: row[2:] for row in listing.write_table(found).rows}
    before, during, after = rows["ball_x"]
    assert re.match(r"F57D \(3\)", before)
    assert (during, after) == ("", ""), "the ball moves before the picture is drawn"
    assert rows["player_mask"][2], "the heights of the paddles are set after the picture"


def test_names_of_bytes():
    names = listing.field_names(ocjax.load("Breakout").ram)
    assert (names[77], names[76]) == ("score.1", "score.0"), "one number of two bytes"
    assert names[51] == "invisible/timed", "two bit fields"
    assert (names[35], names[0]) == ("wall[0]", "wall[35]"), "a field of 36 bytes"


def test_names_of_games_without_a_decoder():
    assert roms.find("ALE/Othello-v5")[:2] == ("Othello", "othello")
    assert roms.find("space_invaders").game is ocjax.load("SpaceInvaders")
    with pytest.raises(ValueError, match="no game 'Othelo': did you mean othello"):
        roms.find("Othelo")


@pytest.mark.slow
@pytest.mark.parametrize("name", [*ocjax.games(), "ElevatorAction", "Othello"])
def test_every_game(name):
    found = disassembly.disassemble(name, states=4)
    assert found.trace.frames >= 3
    assert len(found.trace.visits) > 150
    assert set(found.trace.visits) <= set(found.instructions)
    assert len(list(listing.lines(found))) > len(found.instructions)
    assert len(listing.write_table(found).rows) >= 5, "Kangaroo waits, and changes 5 bytes"


def test_command(tmp_path):
    out = tmp_path / "pong.asm"
    result = run("ram", "disassemble", "Pong", "--states", 2, "--out", out)
    assert result.exit_code == 0, result.output
    assert "STA WSYNC" in out.read_text()
    assert "STA WSYNC" not in result.output
    assert "Pong: writes to RAM in 2 frames" in result.output
    printed = run("ram", "disassemble", "Pong", "--states", 2)
    assert "STA WSYNC" in printed.output
    for args, message in (
        (("Pung",), "no game 'Pung'"),
        (("Pong", "--mode", 99), "no mode 99"),
        (("Pong", "--out", tmp_path / "no" / "x"), "no folder"),
    ):
        result = run("ram", "disassemble", *args)
        assert result.exit_code == 2, result.output
        assert message in " ".join(result.output.split())
