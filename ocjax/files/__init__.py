"""Extract objects from existing RAM or frames in files, folders and datasets."""

from ocjax.files.inputs import Input, InputError, open_input
from ocjax.files.pipeline import extract

__all__ = ["Input", "InputError", "extract", "open_input"]
