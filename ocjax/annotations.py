"""Types of games and results, for annotations."""

from ocjax.console.boxes import Box
from ocjax.extraction.categories import Category
from ocjax.transforms.relations import Relations

__all__ = ["Box", "Category", "Relations"]
