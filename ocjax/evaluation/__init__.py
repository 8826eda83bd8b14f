"""Agreement of two sets of objects, and reports of it."""

from ocjax.evaluation.matching import RADIUS, Detections, detections, from_records, iou, match
from ocjax.evaluation.metrics import (
    THRESHOLDS,
    Agreement,
    agreement,
    average_precision,
    coverage,
    identity_switches,
    intervals,
    value_shares,
)

__all__ = [
    "RADIUS",
    "THRESHOLDS",
    "Agreement",
    "Detections",
    "agreement",
    "average_precision",
    "coverage",
    "detections",
    "from_records",
    "identity_switches",
    "intervals",
    "iou",
    "match",
    "value_shares",
]
