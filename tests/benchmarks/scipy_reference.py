"""What fit_benchmark compares with: SciPy's least squares over MuJoCo.

The lengths of a chain of ball joints from headings, with derivatives by finite
differences through whole rollouts. fit_benchmark writes FOLDER:

  model.xml   the chain at the true lengths
  problem.json
      samples, steps, h   of a segment: samples, steps between two, step in s
      sigma               of a heading's component
      sigma_defect        of the 2 nv numbers of a defect; none: one segment
                          whose start is known
      sigma_prior         of the first state
      axis                of a link, its joint's heading at neutral
      start               factors on the lengths
      method              of scipy.optimize.least_squares
  nodes.txt   start of each segment: quaternions (w first), angular velocities
  measured.txt  headings, one sample a line

and reads the JSON that this prints: factors found, CPU seconds of the fit, how
often everything was rolled out.
"""

import ctypes
import json
import os
import sys
import time

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import lil_matrix


def array(values):
    return np.ascontiguousarray(values, dtype=np.float64)


def pointer(values):
    if values is None:
        return None
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


class Problem:
    def __init__(self, library, folder):
        with open(os.path.join(folder, "problem.json")) as file:
            self.options = json.load(file)
        self.nodes = array(
            np.loadtxt(os.path.join(folder, "nodes.txt"), ndmin=2))
        self.measured = array(
            np.loadtxt(os.path.join(folder, "measured.txt")))
        self.library = ctypes.CDLL(library)
        self.library.chain_load.restype = ctypes.c_void_p
        model = os.path.join(folder, "model.xml")
        self.chain = ctypes.c_void_p(self.library.chain_load(model.encode()))
        assert self.chain.value, "MuJoCo cannot read " + model
        self.count = len(self.nodes)
        self.joints = self.measured.shape[1] // 3
        self.tangent = 6 * self.joints
        self.sigma_defect = np.array(self.options.get("sigma_defect", []))
        self.sigma_prior = np.array(self.options.get("sigma_prior", []))
        self.axis = array(self.options["axis"])
        self.headings = np.zeros_like(self.measured)
        self.defects = np.zeros((max(self.count - 1, 1), self.tangent))
        self.rolled = 0

    def residuals(self, v):
        """Of v: the factors, then where the states are free their tangents."""
        self.rolled += 1
        scales = array(v[:self.joints])
        free = len(self.sigma_defect) > 0
        dx = array(v[self.joints:]) if free else None
        self.library.chain_roll(
            self.chain, pointer(scales), self.count, pointer(self.nodes),
            pointer(dx), self.options["samples"], self.options["steps"],
            ctypes.c_double(self.options["h"]), pointer(self.axis),
            pointer(self.headings), pointer(self.defects) if free else None)
        errors = ((self.headings - self.measured) / self.options["sigma"])
        if not free:
            return errors.ravel()
        return np.concatenate([
            errors.ravel(), (self.defects / self.sigma_defect).ravel(),
            dx[:self.tangent] / self.sigma_prior])

    def start(self):
        scales = np.array(self.options["start"])
        if len(self.sigma_defect) == 0:
            return scales
        return np.concatenate([scales, np.zeros(self.count * self.tangent)])

    def sparsity(self):
        """Which residuals depend on which variables."""
        t, n = self.tangent, self.joints
        per_segment = self.options["samples"] * 3 * n
        measured = self.measured.size
        rows = measured + (self.count - 1) * t + t
        pattern = lil_matrix((rows, n + self.count * t), dtype=int)
        pattern[:rows - t, :n] = 1
        for k in range(self.count):
            columns = slice(n + k * t, n + (k + 1) * t)
            last = k + 1 == self.count
            end = measured if last else (k + 1) * per_segment
            pattern[k * per_segment:end, columns] = 1
            if not last:
                first = measured + k * t
                pattern[first:first + t, columns] = 1
                # The next node only by its own number, or by its rotation.
                for j in range(n):
                    for a in range(3):
                        row = first + 3 * j
                        pattern[row:row + 3, n + (k + 1) * t + 3 * j + a] = 1
                for i in range(t // 2):
                    column = n + (k + 1) * t + t // 2 + i
                    pattern[first + t // 2 + i, column] = 1
        for i in range(t):
            pattern[rows - t + i, n + i] = 1
        return pattern


def main():
    library, folder = sys.argv[1:]
    problem = Problem(library, folder)
    # Ours ends at the same relative gain.
    options = {"method": problem.options["method"], "ftol": 1e-6}
    if len(problem.sigma_defect) > 0:
        options["jac_sparsity"] = problem.sparsity()
        options["x_scale"] = "jac"
    start = problem.start()
    problem.residuals(start)
    problem.rolled = 0
    began = time.process_time()
    result = least_squares(problem.residuals, start, **options)
    seconds = time.process_time() - began
    print(json.dumps({
        "scales": list(result.x[:problem.joints]),
        "seconds": seconds,
        "rolled": problem.rolled,
        "linearised": int(result.njev) if result.njev else 0,
        "cost": float(result.cost),
        "message": result.message,
    }))


if __name__ == "__main__":
    main()
