"""Files of saved policies with changes."""

import json

import numpy as np


def changed(path, out, changes):
    """Write the policy of a file with other arrays or other fields of its description.

    The value None removes an array or a field.
    """
    with np.load(path) as file:
        arrays = dict(file)
    description = json.loads(str(arrays.pop("description")))
    for name, value in changes.items():
        place = description if name in description else arrays
        place.pop(name, None)
        if value is not None:
            place[name] = value
    np.savez(out, **arrays, description=np.array(json.dumps(description)))
