"""`Checks.returns` in states that recordings of play do not reach."""

import ale_py
import numpy as np
import pytest
from ale_py import roms

import ocjax

START_FRAMES = 200
HUNDREDS, REST, DAY = 44, 43, 45  # of Enduro's RAM


@pytest.fixture(scope="module")
def enduro():
    """A race that has begun, and its return."""
    ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
    ale = ale_py.ALEInterface()
    ale.setFloat("repeat_action_probability", 0.0)
    ale.loadROM(roms.get_rom_path("enduro"))
    ale.reset_game()
    return ale, sum(ale.act(ale_py.Action.FIRE) for _ in range(START_FRAMES))


def test_cars_passed_on_later_days(enduro):
    ale, total = enduro
    game = ocjax.load("Enduro")
    for day, cars in ((1, 0x150), (2, 0x250), (3, 0x107), (4, 0x000), (0x12, 0x300)):
        ale.setRAM(DAY, day)
        ale.setRAM(HUNDREDS, cars >> 8)
        ale.setRAM(REST, cars & 0xFF)
        total += ale.act(ale_py.Action.FIRE) + ale.act(ale_py.Action.FIRE)
        assert game.checks.returns(game.rem(np.array(ale.getRAM())[None])) == [total]
