"""The observations of JAXtari's games: the mapping from ocjax's objects to their fields."""

import dataclasses
from collections.abc import Mapping

__all__ = ["FIELDS", "ObservedField"]


@dataclasses.dataclass(frozen=True)
class ObservedField:
    """A field of JAXtari's observation of a game.

    Args:
        categories: the categories of the objects. Without any, ocjax has no such objects, and the
            field is empty or 0.
        count: number of objects, or the shape of numbers, or None for one object without a
            dimension.
        constants: JAXtari's constant contents of `visual_id` and `orientation`.
        size: JAXtari's constant width and height, even if the edge of the field covers a part of
            the object.
        absent: left and top of a missing object: JAXtari keeps it at this position, and active.
        value: whether the field is a number instead of an `ObjectObservation`: the value of the
            category's only object, or the number of objects if the category has several slots.
        slot: the field's first slot of the category.
    """

    categories: tuple[str, ...] = ()
    count: int | tuple[int, ...] | None = None
    constants: Mapping[str, tuple[float, ...]] = dataclasses.field(default_factory=dict)
    size: tuple[int, int] | None = None
    absent: tuple[int, int] | None = None
    value: bool = False
    slot: int = 0


def _one(*categories: str, slot: int = 0) -> ObservedField:
    return ObservedField(categories, slot=slot)


def _several(count: int, *categories: str) -> ObservedField:
    return ObservedField(categories, count)


def _number(*category: str) -> ObservedField:
    return ObservedField(category, value=True)


def _numbers(*count: int) -> ObservedField:
    return ObservedField((), count, value=True)


# In the order of the fields in JAXtari 0.2.0's `jax_<game>.py`. The directions of Freeway's lanes
# begin with the top lane.
FIELDS: Mapping[str, Mapping[str, ObservedField]] = {
    "Amidar": {
        "player_gorilla": _one("Player"),
        "player_paint_roller": _one(),
        "enemy": _several(6, "Warrior", "Pig"),
        "lives": _number("Life"),
        "score": _number("Score"),
        "paths": _several(88),
        "walked_on_paths": _several(88),
        "completed_rectangles": _several(29),
    },
    "Assault": {
        "player": _one("Player"),
        "mothership": _one("MotherShip"),
        "enemy_1": _one("Enemy", slot=0),
        "enemy_2": _one("Enemy", slot=1),
        "enemy_3": _one("Enemy", slot=2),
        "enemy_4": _one("Enemy", slot=3),
        "enemy_5": _one("Enemy", slot=4),
        "enemy_6": _one("Enemy", slot=5),
        "enemy_projectile": _one("EnemyMissile"),
        "player_projectile": _one("PlayerMissileVertical", "PlayerMissileHorizontal"),
        "lives": _number("Lives"),
        "score": _number("PlayerScore"),
    },
    "Asteroids": {
        "player": _one("Player"),
        "missiles": _several(2, "PlayerMissile"),
        "asteroids": _several(17, "Asteroid"),
        "score": _number("PlayerScore"),
        "lives": _number("Lives"),
    },
    "Atlantis": {
        "enemy": _several(20, "GorgonShip", "BanditBomber"),
        "bullet": _several(2, "Projectile"),
        "plasma": _several(20, "Deathray"),
        "cannons": _several(3, "Sentry", "AcropolisCommandPost"),
        "installations": _several(6, "Generator", "DomedPalace", "BridgedBazaar", "AquaPlane"),
        "score": _number("Score"),
        "installations_alive": _numbers(6),
        "command_post_alive": _number(),
        "fire_cooldown": _number(),
    },
    "BeamRider": {
        "player": _one("Player"),
        "player_shots": _several(1, "Player_Projectile", "Torpedos"),
        "white_ufo": _several(3, "Saucer"),
        "enemy_shots": _several(9, "Enemy_Projectile"),
        "chasing_meteoroids": _several(6, "Debris"),
        "falling_rocks": _several(3, "Rock"),
        "lane_blockers": _several(1, "Blocker"),
        "coins": _several(3, "Jumper"),
        "kamikaze": _several(1, "Charger"),
        "rejuvenator": _one("Rejuvenator"),
        "bouncer": _one("Bouncecraft"),
        "mothership": _one("Sentinel"),
        "shooting_cd": _number(),
        "torpedoes_left": _number("Torpedos_Available"),
        "white_ufo_left": _number("Enemy_Amount"),
        "lives": _number("Life"),
        "score": _number("Score"),
        "sector": _number("Sector"),
        "shooting_delay": _number(),
        "bullet_type": _number(),
        "shot_type_pending": _number(),
        "standby_phase": _number(),
        "death_timer": _number(),
        "white_ufo_pattern_id": _numbers(3),
        "white_ufo_pattern_timer": _numbers(3),
        "mothership_timer": _number(),
        "mothership_stage": _number(),
        "rejuvenator_dead": _number(),
    },
    "Berzerk": {
        "player": _one("Player"),
        "player_bullet": _one("PlayerMissile"),
        "enemies": _several(7, "Enemy"),
        "enemy_bullets": _several(7, "EnemyMissile"),
        "otto": _one("EvilOtto"),
        "score": _number("PlayerScore"),
        "lives": _number("Lives"),
    },
    "Boxing": {
        "left_boxer": _one("Player"),
        "right_boxer": _one("Enemy"),
        "score_left": _number("PlayerScore"),
        "score_right": _number("EnemyScore"),
        "clock_minutes": _number(),
        "clock_seconds": _number(),
    },
    "Breakout": {
        "player": _one("Player"),
        "ball": _one("Ball"),
        "blocks_bot": _several(36),
        "blocks_mid": _several(36),
        "blocks_top": _several(36),
        "lives": _number("Live"),
        "score": _number("PlayerScore"),
    },
    "Centipede": {
        "player": _one("Player"),
        "mushrooms": _several(304, "Mushroom"),
        "centipede": _several(9, "CentipedeSegment"),
        "spider": _one("Spider"),
        "flea": _one("Flea"),
        "scorpion": _one("Scorpion"),
        "player_spell": _one("Projectile"),
        "lives": _number("Life"),
        "score": _number("Score"),
    },
    "ChopperCommand": {
        "player": _one("Player"),
        "trucks": _several(12, "Truck"),
        "jets": _several(12, "EnemyPlane"),
        "choppers": _several(12, "EnemyHelicopter"),
        "enemy_missiles": _several(48, "Bomb"),
        "player_missiles": _several(1, "Shot"),
        "lives": _number("Life"),
        "score": _number("Score"),
    },
    "DonkeyKong": {
        "level": _number(),
        "mario": _one("Player"),
        "hammer": _one("Hammer"),
        "barrels": _several(4, "Barrel"),
        "fires": _several(4, "Fireball"),
        "traps": _several(8, "Rivet"),
        "ladders": _several(16, "Ladder"),
        "score": _number("Score"),
        "lives": _number("Life"),
    },
    "FishingDerby": {
        "hook_p1": _one("PlayerOneHook"),
        "hook_p2": _one("PlayerTwoHook"),
        "fish": _several(6, "Fish"),
        "shark": _one("Shark"),
        "score": _number("ScorePlayerOne"),
    },
    "Freeway": {
        "chicken": _one("Chicken"),
        "car": ObservedField(
            ("Car",),
            10,
            {"visual_id": tuple(range(10)), "orientation": (270.0,) * 5 + (90.0,) * 5},
            (8, 10),
        ),
    },
    "Frostbite": {
        "bailey": _one("Player"),
        "obstacles": _several(12, "Bird", "GreenFish", "Crab", "Clam"),
        "bear": _one("Bear"),
        "ice_grid": _several(48, "FloatingBlock"),
        "igloo_progress": _number(),
        "temperature": _number("Temperature"),
        "score": _number("Score"),
        "lives": _number("Lives"),
        "level": _number(),
    },
    "Gopher": {
        "player": _one("Player"),
        "gopher": _one("Gopher"),
        "duck": _one("Bird"),
        "carrots": _several(3, "Carrot"),
        "seed": _one("Seed"),
        "holes": _several(18, "Hole"),
        "tunnels": _several(40, "Floor"),
        "score_player": ObservedField(("Score",), 1, value=True),
    },
    "Kangaroo": {
        "player": _one("Player"),
        "platforms": _several(20, "Platform"),
        "ladders": _several(20, "Ladder"),
        "fruits": _several(3, "Fruit"),
        "bell": _one("Bell"),
        "child": _one("Child"),
        "falling_coconut": _one("FallingCoconut"),
        "monkeys": _several(4, "Monkey"),
        "thrown_coconuts": _several(4, "ThrownCoconut"),
    },
    "MsPacman": {
        "player": _one("Player"),
        "ghosts": _several(4, "Ghost"),
        "fruit": _one("Fruit"),
        "power_pellets": _several(4, "PowerPill"),
        "pellets": _several(252, "Pill"),
    },
    "NameThisGame": {
        "player": _one("Player"),
        "shark": _one("Shark"),
        "spear": _one("Shot"),
        "tentacles": _several(8, "Tentacle"),
        "oxygen_line": _one("Oxygen_Pipe"),
        "boat": _one("Oxygen_Boat"),
        "score": _number("Score"),
        "oxygen_frames_remaining": _number(),
        "round_idx": _number(),
    },
    "Phoenix": {
        "player": _one("Player"),
        "player_projectile": _one("Player_Projectile"),
        "enemy_projectiles": _several(8, "Enemy_Projectile"),
        "enemies": _several(8, "Phoenix", "Bat"),
        "boss": _one("Boss"),
        "boss_blocks": _several(162, "Boss_Block_Red", "Boss_Block_Blue", "Boss_Block_Green"),
        "player_score": _number("Score"),
        "lives": _number("Life"),
    },
    "Pong": {
        "player": ObservedField(("Player",), size=(4, 16)),
        "enemy": ObservedField(("Enemy",), size=(4, 16), absent=(16, 115)),
        "ball": ObservedField(("Ball",), size=(2, 4), absent=(78, 115)),
        "score_player": _number("PlayerScore"),
        "score_enemy": _number("EnemyScore"),
    },
    "Riverraid": {
        "player": _one("Player"),
        "enemies": _several(10, "Helicopter", "Jet", "Tanker"),
        "fuel_tanks": _several(10, "FuelDepot"),
        "player_projectile": _one("PlayerMissile"),
        "house_trees": _several(10, "House"),
        "dam": _one("Bridge"),
        "river_left_bank": _numbers(210),
        "river_right_bank": _numbers(210),
        "island_left_bank": _numbers(210),
        "island_right_bank": _numbers(210),
        "dam_indicator": _numbers(210),
        "player_fuel": _number("Fuel"),
        "player_lives": _number("Lives"),
        "player_score": _number("PlayerScore"),
        "player_speed": _number(),
    },
    "RoadRunner": {
        "player": _one("Player"),
        "enemy": _one("Enemy"),
        "score": _number("Score"),
        "ravines": _several(3, "RoadCrack"),
        "seeds": _several(4, "Seed"),
        "truck": _one("Truck"),
        "landmine": _one("AcmeMine"),
        "bullet": _one("TurretBall"),
        "cannon": _one("Turret"),
        "lives": _number("Lives"),
        "current_level": _number(),
        "score_popup": _number("Bonus"),
    },
    "Seaquest": {
        "player": _one("Player"),
        "divers": _several(4, "Diver"),
        "enemies": _several(25, "Shark", "Submarine", "SurfaceSubmarine"),
        "projectiles": _several(5, "PlayerMissile", "EnemyMissile"),
        "oxygen_level": _number("OxygenBar"),
        "player_score": _number("PlayerScore"),
        "lives": _number("Lives"),
        "collected_divers": _number("CollectedDiver"),
    },
    "Skiing": {
        "skier": _one("Player"),
        "flags": _several(2, "Flag"),
        "trees": _several(4, "Tree"),
        "moguls": _several(2, "Mogul"),
        "successful_gates": _number(),
    },
    "SpaceInvaders": {
        "player": _one("Player"),
        "enemies": _several(36, "Alien"),
        "player_bullet": _one(),
        "enemy_bullets": _several(3),
        "ufo": _one("Satellite"),
        "barricades": _several(144),
        "score_player": _number("P1Score"),
        "lives": _number("Lives"),
    },
    "Surround": {
        "trail": _several(800, "Trail"),
        "player1": _one("Player"),
        "player2": _one("Enemy"),
        "agent_id": _number(),
        "score0": _number("PlayerScore"),
        "score1": _number("EnemyScore"),
    },
    "Tennis": {
        "player": _one("Player"),
        "enemy": _one("Enemy"),
        "ball": _one("Ball"),
        "is_serving_state": _number(),
        "player_points": _number("PlayerScore"),
        "enemy_points": _number("EnemyScore"),
        "player_sets": _number(),
        "enemy_sets": _number(),
    },
    "TimePilot": {
        "player": _one("Player"),
        "player_missile": _one("Player_Shot"),
        "enemies": _several(
            4, "Enemy_Green", "Enemy_Black", "Enemy_Yellow", "Enemy_Blue", "Enemy_Orange"
        ),
        "level_boss": _one(),
        "enemy_missiles": _several(
            2,
            "Enemy_Green_Shot",
            "Enemy_Black_Shot",
            "Enemy_Yellow_Shot",
            "Enemy_Blue_Shot",
            "Enemy_Orange_Shot",
        ),
        "clouds": _several(4),
        "level": _number(),
        "score": _number("Score"),
        "lives": _number("Life"),
        "enemies_remaining": _number("Enemies_Left"),
    },
    "UpNDown": {
        "player": _one("Player"),
        "enemies": _several(8, "Truck"),
        "flags": _several(8, "Flag"),
        "collectibles": _several(4, "Collectable"),
        "flags_collected_mask": _numbers(8),
        "score": _number("Score"),
        "lives": _number("Life"),
        "level": _number(),
    },
    "VideoPinball": {
        "ball": _one("Ball"),
        "flippers": _several(2, "Flipper"),
        "spinners": _several(2, "Spinner"),
        "plunger": _one("Plunger"),
        "targets": _several(4, "DropTarget", "Target"),
        "bumpers": _several(3, "Bumper"),
        "rollovers": _several(2, "Rollover"),
        "hole_plugs": _several(2),
        "score": _number("Score"),
        "lives_lost": _number("LifeUsed"),
        "atari_symbols": _number("Logo"),
        "bumper_multiplier": _number(),
        "rollover_counter": _number(),
        "color_cycling": _number(),
        "tilt_mode_active": _number(),
    },
    "WizardOfWor": {
        "player": _one("Player"),
        "enemies": _several(6, "Burwor", "Garwor", "Thorwor", "Worluk", "Wizard"),
        "bullet": _one("PlayerShot"),
        "enemy_bullet": _one("EnemyShot"),
        "score": _number("Score"),
        "lives": _number("Lives"),
    },
    "YarsRevenge": {
        "yar": _one("Player"),
        "qotile": _one("Enemy"),
        "destroyer": _one("Enemy_Missile"),
        "swirl": _one("Swirl"),
        "energy_missile": _one("Player_Bullet"),
        "cannon": _one("Zorlon_Cannon"),
        "energy_shield": _one(),
        "energy_shield_state": _numbers(16, 8),
        "score": _number("Score"),
        "lives": _number("Life"),
    },
}
