"""Positions and colours on Pooyan's screen."""

from ocjax.extractors.pooyan.ram import LAST_ROW

WHITE = 14
PINK = 86  # while the pig has a bait
WOLF = 40
ROCK = 36
SKY = 144
CLIFF_COLORS = (50, 52, 28, 30, 64, 66, 60, 62)  # two of each mode

ROWS = range(1, LAST_ROW + 1)
PITCH = 21  # lines per row
FIRST_LINE = 41  # of row 0
BALLOON_LINES = 8
WOLF_WIDTH = 8
ROCK_LEFTS = (121, 142)  # when it falls; the second one in rounds that should not have it
ROCK_WIDTH = 16
ROCK_HEIGHT = 11  # one less when it falls
PIG_LEFT = 130
TOP_LINE = 21  # of wolves at the top
GROUND_LINE = 36  # below wolves at the top
BOTTOM_LINE = 186  # of wolves at the bottom
CLIFFS = (16, 144)  # columns between them
COLUMNS = (44, 76, 108)  # of balloons
CLIMBER_LEFTS = (145, 141, 137)  # by reach
