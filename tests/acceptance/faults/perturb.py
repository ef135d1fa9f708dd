#!/usr/bin/env python3
"""A recording with other last bits.

  perturb.py IN.csv OUT.csv SEED

adds to every number, times included, an even draw of at most 1e-13 of its
column's range: a thousandth of what nine decimals round away, and some hundred
last bits of a double. Nothing that is said of a recording may hang on it.
"""

import sys

from draw import Draw
from planted import span
from table import read_table, write_table

SIZE = 1e-13


def perturbed(table, *seed):
    table = table.copy()
    for name, column in table.columns.items():
        if all(v != v for v in column):
            continue  # nothing was measured
        draw = Draw("last bits", name, *seed)
        size = SIZE * (span(column) or abs(column[0]))
        table[name] = [v + size * draw.uniform(-1, 1) for v in column]
    return table


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    write_table(perturbed(read_table(sys.argv[1]), sys.argv[3]), sys.argv[2])
