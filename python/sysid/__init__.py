"""sysid: identifies the parameters of mechanisms from recordings, and finds
the effect that a model lacks.

>>> import sysid
>>> model = sysid.load("pendulum3")
>>> run = sysid.read("data/runs/pendulum3.csv", model)
>>> fit = sysid.fit(model, [run])
>>> print(f"{fit['link1.length'].value:.4f}")
0.3000

docs/python.md of the project has more.
"""

from ._errors import InputError, Stopped
from ._native import version as __version__
from .diagnosis import Diagnosis, diagnose
from .fitting import Fit, Parameter, Prediction, Samples, fit
from .model import Model, load
from .run import Run, read
from .simulation import simulate
from .verification import Verification, verify

__all__ = ["Diagnosis", "Fit", "InputError", "Model", "Parameter",
           "Prediction", "Run", "Samples", "Stopped", "Verification",
           "__version__", "diagnose", "fit", "load", "read", "simulate",
           "verify"]
