"""Published suites of games for reporting results."""

from typing import NamedTuple

__all__ = ["SUITES", "Suite"]


class Suite(NamedTuple):
    """The games of a suite, by Gymnasium's names, and its publication."""

    games: tuple[str, ...]
    source: str


def _suite(games: str, source: str) -> Suite:
    return Suite(tuple(games.split()), source)


SUITES = {
    "atari100k": _suite(
        "Alien Amidar Assault Asterix BankHeist BattleZone Boxing Breakout ChopperCommand "
        "CrazyClimber DemonAttack Freeway "
        "Frostbite Gopher Hero Jamesbond Kangaroo Krull KungFuMaster MsPacman Pong PrivateEye "
        "Qbert RoadRunner Seaquest UpNDown",
        "Kaiser et al. (2020), Model-Based Reinforcement Learning for Atari",
    ),
    "atari5": _suite(
        "BattleZone DoubleDunk NameThisGame Phoenix Qbert",
        "Aitchison et al. (2023), Atari-5: Distilling the Arcade Learning Environment down to "
        "Five Games",
    ),
    "atari10": _suite(
        "Amidar BattleZone Bowling DoubleDunk Frostbite KungFuMaster NameThisGame Phoenix Qbert "
        "Riverraid",
        "Aitchison et al. (2023), Atari-5: Distilling the Arcade Learning Environment down to "
        "Five Games",
    ),
    "atari57": _suite(
        "Alien Amidar Assault Asterix Asteroids Atlantis BankHeist BattleZone BeamRider Berzerk "
        "Bowling Boxing Breakout Centipede "
        "ChopperCommand CrazyClimber Defender DemonAttack DoubleDunk Enduro FishingDerby Freeway "
        "Frostbite Gopher Gravitar Hero "
        "IceHockey Jamesbond Kangaroo Krull KungFuMaster MontezumaRevenge MsPacman NameThisGame "
        "Phoenix Pitfall Pong PrivateEye "
        "Qbert Riverraid RoadRunner Robotank Seaquest Skiing Solaris SpaceInvaders StarGunner "
        "Surround Tennis TimePilot Tutankham "
        "UpNDown Venture VideoPinball WizardOfWor YarsRevenge Zaxxon",
        "Badia et al. (2020), Agent57: Outperforming the Atari Human Benchmark",
    ),
    "ocatari": _suite(
        "Adventure AirRaid Alien Amidar Assault Asterix Asteroids Atlantis BankHeist BattleZone "
        "BeamRider Berzerk Bowling Boxing "
        "Breakout Carnival Centipede ChopperCommand CrazyClimber DemonAttack DonkeyKong "
        "DoubleDunk Enduro FishingDerby Freeway "
        "Frogger Frostbite Galaxian Gopher Hero IceHockey Jamesbond Kangaroo KeystoneKapers "
        "KingKong Krull KungFuMaster MarioBros "
        "MontezumaRevenge MsPacman NameThisGame Pacman Phoenix Pitfall Pitfall2 Pong Pooyan "
        "PrivateEye Qbert Riverraid RoadRunner "
        "Seaquest Skiing SpaceInvaders StarGunner Tennis TimePilot UpNDown Venture VideoPinball "
        "YarsRevenge Zaxxon",
        "the games that OCAtari 2.2 lists (Delfosse et al., 2024)",
    ),
}
