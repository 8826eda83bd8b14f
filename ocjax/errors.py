"""Errors of loading games, and of missing extras."""

from ocjax._extras import MissingExtraError
from ocjax.extraction.declaration import GameError
from ocjax.extraction.registry import UnknownGameError

__all__ = ["GameError", "MissingExtraError", "UnknownGameError"]
