"""Values of NumPy become values of JSON."""

import json

import numpy as np

from vibrodrive.model.plain import plain


def test_numbers_become_json():
    numbers = [
        np.float64(1.5),
        np.int64(2),
        np.bool_(True),
        np.nan,
        [np.inf, (1,)],
        np.array([1.0, np.nan]),
        np.array(3),
    ]
    assert plain(numbers) == [1.5, 2, True, None, [None, [1]], [1.0, None], 3]
    json.dumps(plain(numbers), allow_nan=False)
