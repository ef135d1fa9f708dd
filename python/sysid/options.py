"""Arguments of Python as plain values of a request."""

import difflib
import math
import os

import numpy as np

from ._errors import InputError


def plain(value, name):
    """A value that JSON can say, with numbers to the last bit."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        if not math.isfinite(value):
            raise InputError(f"--{name}", f"cannot be {value}",
                             "it takes a finite number")
        return value
    if isinstance(value, dict):
        return {str(key): plain(of, name) for key, of in value.items()}
    if isinstance(value, (list, tuple, set, np.ndarray)):
        return [plain(of, name) for of in value]
    raise InputError(f"--{name}", f"cannot be of type {type(value).__name__}",
                     "it takes text, numbers, lists and dicts of them")


def given(options):
    """Those that are not None."""
    return {name: plain(value, name)
            for name, value in options.items() if value is not None}


def text_of(value):
    """A list as a flag has it: 'a,b=1'."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    if isinstance(value, dict):
        return ",".join(name if of is None else f"{name}={of}"
                        for name, of in value.items())
    return ",".join(value)


def arguments_of(has_holdout, options):
    """The arguments of a call as a person would write them, but for add and
    fix: what reports propose to type next."""
    parts = ["model", "runs"] + (["holdout=held_out"] if has_holdout else [])
    parts += [f"{name}={value!r}" for name, value in options.items()
              if name not in ("add", "fix", "candidates", "auto",
                              "whole_runs")]
    return ", ".join(parts)


def near(name, names):
    """A hint that names the nearest, or all."""
    found = difflib.get_close_matches(name, names, 1)
    return (f"did you mean '{found[0]}'?" if found
            else "known: " + ", ".join(names))
