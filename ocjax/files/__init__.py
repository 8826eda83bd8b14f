"""Objects for data that already exists: RAM or frames in files, folders and datasets, and files of objects."""

from ocjax.files.extraction import extract
from ocjax.files.inputs import Input, InputError, open_input

__all__ = ["Input", "InputError", "extract", "open_input"]
