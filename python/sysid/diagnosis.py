"""Diagnoses: which effect a model lacks."""

import json
import os
from typing import Any, Dict, Iterable, List, Optional, Union

from . import results
from .fitting import Fit, Names, fit
from .model import Model
from .run import as_list


class Diagnosis(results.Result):
    """What :func:`diagnose` found. Printed, it is the program's text.

    Attributes
    ----------
    json : dict
        The contents of diagnosis.json (docs/interface.md, section 6).
    verdict : str
        ``"adequate"``, ``"missing_effect"``, ``"undecided"`` or
        ``"unexplained"``.
    effects : list of str
        To add to the model as it was given: what was added, or is proposed.
    rivals : list of dict
        Sets of effects that explain the data as well.
    candidates : list of dict
        Effects in the order of what they explain.
    notices : list of str
    """

    def __init__(self, handle: Any, call: Dict[str, Any]) -> None:
        value = handle.value()
        super().__init__(handle, value)
        self.json: Dict[str, Any] = json.loads(value["json"])
        self.verdict: str = self.json["verdict"]
        self.effects: List[str] = value["next"]["add"]
        self.rivals: List[Dict[str, Any]] = self.json["rivals"]
        self.candidates: List[Dict[str, Any]] = self.json["candidates"]
        self._next: Dict[str, Any] = value["next"]
        self._call = call

    def fit(self, **more: Any) -> Fit:
        """Fits the model with what was found in it, to the same runs.

        >>> import sysid
        >>> found = sysid.diagnose("pendulum2_planar",
        ...                        ["data/runs/hidden_1.csv",
        ...                         "data/runs/hidden_2.csv"])
        >>> found.verdict, found.effects
        ('missing_effect', ['coulomb_friction@joint2'])
        >>> fit = found.fit()
        >>> fit.effects
        ['coulomb_friction@joint2']
        """
        call = {name: value for name, value in self._call.items()
                if name not in ("candidates", "auto", "whole_runs")}
        call["add"] = _joined(call.get("add"), self.effects)
        call["fix"] = _with_values(call.get("fix"), self._next["fix"])
        if self._next["solver"]:
            call["solver"] = self._next["solver"]
        call.update(more)
        return fit(**call)

    def _repr_html_(self) -> str:
        sentence = self._ask("text", colour=False)["sentence"]
        rows = []
        for of in self.candidates[:8]:
            confirmed = of["confirmed"] or {}
            rows.append([f"{of['effect']}@{of['target']}",
                         results.number(of["predicted_error"]),
                         results.number(confirmed.get("train")),
                         results.number(confirmed.get("holdout"))])
        return (
            f"<h4>{self.json['model']}</h4>"
            + results.sentence_html(sentence, self.verdict == "adequate")
            + results.table_html(
                ["effect", "error predicted, times the noise", "with it",
                 "of held-out data"], rows)
            + f"<p><code>{self.json['next_command']}</code></p>"
            + results.notices_html(self.notices))


def _joined(given: Any, more: List[str]) -> List[str]:
    if given is None:
        return list(more)
    return ([given] if isinstance(given, str) else list(given)) + list(more)


def _with_values(given: Any, more: Dict[str, Optional[float]]) -> Any:
    if not more:
        return given
    if isinstance(given, dict):
        return {**given, **more}
    return _joined(given, [name if value is None else f"{name}={value!r}"
                           for name, value in more.items()])


def diagnose(model: Union[Model, str, "os.PathLike[str]"], runs: Any, *,
             free: Optional[Names] = None, fix: Optional[Names] = None,
             add: Optional[Union[str, Iterable[str]]] = None,
             holdout: Any = None, auto: bool = False,
             candidates: Optional[Union[str, Iterable[str]]] = None,
             progress: Any = None, stop: Any = None, **more: Any) -> Diagnosis:
    """Says where a model fails, and which effect is missing.

    Parameters
    ----------
    model, runs, free, fix, add, progress, stop, **more
        As :func:`fit` has them; ``add`` are effects that are in the model.
    holdout : list of Run or of paths, optional
        Not fitted; they decide between effects. Default: the last quarter of
        every run.
    auto : bool
        Adds the best effect, fits, and looks again, until nothing is missing.
    candidates : list, optional
        Effects to consider: kinds, names, patterns. Default: all.

    Examples
    --------
    >>> import sysid
    >>> model = sysid.load("pendulum2_planar")
    >>> found = sysid.diagnose(model, ["data/runs/hidden_1.csv"],
    ...                        holdout=["data/runs/hidden_3.csv"],
    ...                        candidates=["coulomb_friction",
    ...                                    "viscous_damping"])
    >>> found.effects
    ['coulomb_friction@joint2']
    """
    call = {"free": free, "fix": fix, "add": add, "candidates": candidates,
            **more}
    runs, holdout = as_list(runs), as_list(holdout)  # they are used again
    handle = results.run_call(
        "diagnose", model, runs, holdout,
        {**call, "auto": auto or None}, progress, stop)
    return Diagnosis(handle, {"model": model, "runs": runs,
                              "holdout": holdout, **call})
