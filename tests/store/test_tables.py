"""Tables have every row once, however many there are."""

import numpy as np

from vibrodrive.store.tables import rows_of


def test_rows_are_those_of_the_columns_beyond_a_block():
    values = np.arange(40_000)
    assert [*rows_of({"a": values, "b": 0.5 * values})] == [*zip(values.tolist(), (0.5 * values).tolist(), strict=True)]
