"""Datasets of played frames and RAM with the objects of both methods."""

from ocjax.datasets.collection import generate_all, plan_of
from ocjax.datasets.detection import export_boxes
from ocjax.datasets.exports import export
from ocjax.datasets.generation import generate, open_dataset, relabel
from ocjax.datasets.plans import SEEDS, DatasetError, Plan, plan

__all__ = [
    "SEEDS",
    "DatasetError",
    "Plan",
    "export",
    "export_boxes",
    "generate",
    "generate_all",
    "open_dataset",
    "plan",
    "plan_of",
    "relabel",
]
