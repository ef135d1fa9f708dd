"""Recordings as text: a header and columns of numbers."""

import math
from pathlib import Path


class Table:
    """Columns by name, in their order. nan is a missing measurement."""

    def __init__(self, columns):
        self.columns = dict(columns)

    def copy(self):
        return Table({n: list(c) for n, c in self.columns.items()})

    def __getitem__(self, name):
        return self.columns[name]

    def __setitem__(self, name, values):
        self.columns[name] = list(values)

    def __contains__(self, name):
        return name in self.columns

    def rows(self):
        return len(next(iter(self.columns.values())))

    def rename(self, names):
        """Columns by other names, in the same order."""
        self.columns = {names.get(n, n): c for n, c in self.columns.items()}

    def keep(self, rows):
        """Only these rows."""
        for name, column in self.columns.items():
            self.columns[name] = [column[i] for i in rows]


def read_table(path):
    header, rows = None, []
    with open(path, encoding="utf-8") as file:
        for line in file:
            line = line.strip()
            if not line or line.startswith("#"):
                continue
            cells = line.split(",")
            if header is None:
                header = [cell.strip() for cell in cells]
            else:
                rows.append([float(c) if c.strip() else math.nan
                             for c in cells])
    return Table({name: [row[i] for row in rows]
                  for i, name in enumerate(header)})


def write_table(table, path):
    """With every digit; an empty cell where a measurement is missing."""
    names = list(table.columns)
    lines = [",".join(names)]
    for row in zip(*table.columns.values()):
        lines.append(",".join("" if math.isnan(v) else repr(v) for v in row))
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
