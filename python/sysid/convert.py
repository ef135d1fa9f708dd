"""Writes a recording that Python reads as CSV, numbers to the last bit:

    python3 -m sysid.convert run.mcap --model robot.urdf --out run.csv

With --model the columns are those of the model (t, joint1.q, ...), in SI units,
as --columns maps them; without it all columns of the file, as they are.
"""

import argparse
import sys

from . import formats
from ._errors import InputError
from .model import load
from .run import read


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python3 -m sysid.convert", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", help="npz, npy, HDF5, parquet, a torch "
                        "file of tensors, a ROS bag or MCAP; BAG:/topic")
    parser.add_argument("--model", help="URDF, or a shipped model's name")
    parser.add_argument("--columns", help="name=expression of the file's "
                        "columns, as sysid_fit takes it")
    parser.add_argument("--out", default="-", help="CSV; - is standard output")
    given = parser.parse_args()
    try:
        if given.model:
            run = read(given.recording, load(given.model), given.columns)
            table, notices = run.columns, run.notices
        else:
            notices = []
            table = formats.read_table(given.recording, given.columns or "",
                                       notices)
        for notice in notices:
            print(f"note: {notice}", file=sys.stderr)
        if given.out == "-":
            sys.stdout.write(formats.csv_text(table))
        else:
            formats.write_csv(given.out, table)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
