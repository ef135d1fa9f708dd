"""The programs, which the package brings along, on the path of its user."""

import os
import pathlib
import sys


def main() -> None:
    name = pathlib.Path(sys.argv[0]).name
    program = pathlib.Path(__file__).parent / "bin" / name
    try:
        os.execv(program, [str(program), *sys.argv[1:]])
    except OSError as error:
        sys.exit(f"{program}: {error.strerror}")
