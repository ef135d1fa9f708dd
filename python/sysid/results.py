"""What fits and diagnoses share: the call, progress, tables, files."""

import html
import importlib
import os
import sys
import warnings
from typing import Any, Callable, Dict, List, Optional

from . import _native, formats, options
from ._errors import InputError
from .model import as_model
from .run import as_list, put_runs

Progress = Callable[[str, int, int, float], None]


class _Bar:
    """A bar of tqdm, where that is there; else nothing."""

    def __init__(self) -> None:
        bars = importlib.import_module("tqdm.auto")
        self._bar = bars.tqdm(bar_format="{desc} [{elapsed}]",
                                   leave=False, delay=0.5)

    def __call__(self, doing: str, iteration: int, of: int,
                 error: float) -> None:
        self._bar.set_description_str(
            f"{doing}: iteration {iteration}, error {error:.4g} times the "
            "noise", refresh=True)

    def close(self) -> None:
        self._bar.close()


def _shower(progress: Any) -> Any:
    """What `progress` asks for: True, False, a function, or None (a bar where
    a person looks on)."""
    if callable(progress):
        return progress
    looks_on = sys.stderr.isatty() or "ipykernel" in sys.modules
    if progress is False or (progress is None and not looks_on):
        return None
    try:
        return _Bar()
    except ImportError:
        return None


def run_call(function: str, model: Any, runs: Any, holdout: Any,
             given: Dict[str, Any], progress: Any, stop: Any
             ) -> "_native.Handle":
    given = options.given(given)
    holdout = as_list(holdout)
    request = _native.Request()
    values: Dict[str, Any] = {
        "model": request.object(as_model(model)._handle),
        "options": given,
        "call": {
            "arguments": options.arguments_of(bool(holdout), given),
            "add": options.text_of(given.get("add")),
            "fix": options.text_of(given.get("fix")),
        },
    }
    values["runs"], count = put_runs(runs, 1, request)
    if not values["runs"]:
        raise InputError("runs", "there is none",
                         "give a list of sysid.Run, or of files' paths")
    values["holdout"], _ = put_runs(holdout, count, request)
    shower = _shower(progress)
    try:
        return _native.watch(function, values, request, shower, stop)
    finally:
        if isinstance(shower, _Bar):
            shower.close()


class Result:
    """A result that is text, tables and files."""

    def __init__(self, handle: "_native.Handle", value: Dict[str, Any]
                 ) -> None:
        self._handle = handle
        #: What was assumed or ignored, a line each.
        self.notices: List[str] = value["notices"]

    def _ask(self, function: str, **values: Any) -> Any:
        request = _native.Request()
        request.object(self._handle)
        return _native.call(function, values, request).value()

    def __str__(self) -> str:
        notes = "".join(f"note: {notice}\n" for notice in self.notices)
        return notes + self._ask("text", colour=False)["text"].rstrip("\n")

    __repr__ = __str__

    def save(self, folder: "str | os.PathLike[str]") -> List[str]:
        """Writes what the programs write with ``--out``; the files' names.

        report.html is left out where the library was built without the page,
        with a warning.
        """
        files = self._ask("files")
        formats.make_folder(folder)
        for name, text in files["files"].items():
            formats.write_text(os.path.join(folder, name), text)
        if files["no_page"]:
            warnings.warn(f"no report.html: {files['no_page']}", stacklevel=2)
        return list(files["files"])


def table_html(header: List[str], rows: List[List[Any]]) -> str:
    """A table; texts to the left, all else to the right."""
    def cells(tag: str, row: List[Any], style: str = "") -> str:
        return "".join(
            f"<{tag} style='text-align:{'left' if i == 0 else 'right'}'>"
            f"{html.escape(str(cell))}</{tag}>" for i, cell in enumerate(row))

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return (f"<table><thead><tr>{cells('th', header)}</tr></thead>"
            f"<tbody>{body}</tbody></table>")


def sentence_html(text: str, good: bool) -> str:
    colour = "#1a7f37" if good else "#b42318"
    return (f"<p style='font-weight:600;border-left:4px solid {colour};"
            f"padding-left:.6em'>{html.escape(text)}</p>")


def notices_html(notices: List[str]) -> str:
    if not notices:
        return ""
    lines = "".join(f"<li>{html.escape(notice)}</li>" for notice in notices)
    return f"<details><summary>Notes: {len(notices)}</summary><ul>{lines}" \
           "</ul></details>"


def number(value: Optional[float], digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


__all__ = ["InputError", "Progress", "Result", "notices_html", "number",
           "run_call", "sentence_html", "table_html"]
