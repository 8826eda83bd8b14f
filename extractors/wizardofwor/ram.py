"""The RAM of Wizard of Wor."""

from ocjax.authoring import RamMap, Rom, bcd, byte, low

ROM = Rom("wizard_of_wor", "7e8aa18bc9502eb57daaf5e7c1e94da7")


class Way:  # of `Ram.way` and `facing`; also bits of the exits of a cell
    UP = 1
    DOWN = 2
    LEFT = 4
    RIGHT = 8
    EXPLODES = 255


class Kind:  # of `Ram.kind`; others: no monster
    BURWOR = 1
    GARWOR = 2
    THORWOR = 3
    WORLUK = 4
    WIZARD = 5


class State:  # of `Ram.state`
    WAITS = 0
    PLAYS = 1
    DIES = 128


class Stage:  # of `Ram.stage`
    PLAY = 0
    MUSIC = 1  # before a level


class Hunt:  # of `Ram.hunt`
    NONE = 0
    WORLUK = 1
    WIZARD = 2


class Ram(RamMap):
    frame = byte(0)
    over = byte(3)  # 1: before and after a game
    level = byte(4)
    score = bcd((8, 6))  # hundreds; with a mark after the extra life
    stage = byte(9)
    doubled = byte(11)  # 1: points count twice
    lives = low(13)  # in the boxes
    saver_key = byte(14)  # XORed with colours after a game
    turn = byte(15)  # counts up to `pace`, then the next monster moves
    pace = byte(16)  # 0 after a game
    hunt = byte(19)  # last monster at the end of a level
    flash = byte(20)  # 1: the Wizard was shot
    chosen = byte(24)  # the monster that the next frame shows
    facing = byte(29)
    shot_way = byte(31)  # 0: no shot
    shot_x = byte(33)  # x + 4
    shot_y = byte(35)  # 138 - y
    fire_sound = byte(36)  # counts up
    shooter = byte(37)  # the monster
    missile_way = byte(38)  # 0: no shot
    missile_x = byte(39)  # x + 4
    monster_y = byte(*range(40, 46))  # 142 - y
    y = byte(47)  # 142 - y
    monster_x = byte(*range(48, 54))  # x + 3
    x = byte(55)  # x + 3
    cell = byte(*range(56, 62))  # counts up while the monster explodes
    way = byte(*range(64, 70))
    death = byte(71)  # counts up while the worrior dies
    step = byte(*range(72, 78))  # pixels from the last cell
    stride = byte(79)  # the worrior's, from the last cell
    kind = byte(*range(80, 86))
    state = byte(87)
    seen = byte(*range(88, 94))  # visible frames of a monster of a kind that hides
    music = byte(96)  # counts up before a level
    missile_y = byte(103)  # 138 - y; at least 128: not drawn
