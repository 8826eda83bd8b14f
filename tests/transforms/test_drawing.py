"""Labels of drawn objects."""

import pytest

from ocjax.transforms import drawing


@pytest.mark.parametrize(
    ("record", "text"),
    [
        ({"hud": True, "value": 12}, " 12"),
        ({"hud": False, "value": 3, "orientation": 2}, " value 3, facing NE"),
        ({"hud": False, "orientation": 12}, " facing W"),
        ({"hud": True}, ""),
    ],
)
def test_labels_say_what_their_numbers_are(record, text):
    assert drawing._attributes(record) == text
