"""Whole processes from their start to their end, imports and files included: the
programs on shipped runs, and beside them the same identifications made with
MuJoCo's toolbox (mujoco_sysid.py).

    whole_programs.py BUILD OUT.json [FILTER]

BUILD is a build tree with the programs, FILTER a regular expression of lines. A
line is repeated while it is short; its times are medians. The interpreter that
runs this runs the toolbox.
"""

import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
TOOLBOX = [sys.executable, os.path.join(HERE, "mujoco_sysid.py")]
MOST, LONG = 5, 10.0  # repetitions at most; seconds after which there is none


def run(name):
    return f"data/runs/{name}.csv"


def robot(name):
    return f"data/robots/{name}.urdf"


def free(values):
    return ",".join(f"{name}={value:.6g}" for name, value in values.items())


class Problem:
    """An identification: what is found, and from where the fits start."""

    def __init__(self, name, model, runs, truth, step, friction=None):
        self.name, self.model, self.step = name, model, step
        self.runs = ",".join(run(r) for r in runs)
        self.truth, self.friction = truth, friction
        self.bodies = {n: v for n, v in truth.items()
                       if not n.endswith(".friction")}

    def start(self, off):
        """By turns above and below the truth by that factor."""
        return {name: value * (1 + off if i % 2 == 0 else 1 / (1 + off))
                for i, (name, value) in enumerate(self.bodies.items())}

    def ours(self, start):
        command = ["sysid_fit", "--model", self.model, "--traj", self.runs,
                   "--free", free(start), "--json", "-"]
        if self.friction:
            command += ["--add", f"coulomb_friction@{self.friction}"]
        return command

    def theirs(self, start, *flags):
        command = TOOLBOX + [robot(self.model), self.runs, "--free",
                             free(start), "--step", str(self.step), *flags]
        if self.friction:
            command += ["--friction", f"{self.friction}=0.01"]
        return command

    def error(self, found):
        """The largest, % of the true value."""
        return max(100.0 * abs(found[name] / value - 1.0)
                   for name, value in self.truth.items())


PENDULUM3 = Problem(
    "three lengths, ball joints", "pendulum3", ["pendulum3"],
    {"link1.length": 0.3, "link2.length": 0.4, "link3.length": 0.35}, 0.005)
CARTPOLE = Problem(
    "two masses and a length, driven", "cartpole", ["cartpole"],
    {"cart.mass": 1.0, "pole.mass": 0.2, "pole.length": 0.6}, 0.01)
FRICTION = Problem(
    "two lengths and a friction", "pendulum2_planar",
    ["pendulum2_planar_friction"],
    {"link1.length": 0.5, "link2.length": 0.5, "joint1.friction": 0.05}, 0.01,
    friction="joint1")
HIDDEN = Problem(
    "two lengths and a friction, two runs", "pendulum2_planar",
    ["hidden_1", "hidden_2"],
    {"link1.length": 0.5, "link2.length": 0.5, "joint2.friction": 0.01}, 0.01,
    friction="joint2")
PAPER = Problem(
    "two lengths from ten steps, ball joints", "pendulum2", ["figure1"],
    {"link1.length": 0.81, "link2.length": 0.304}, 0.04)
HALF_A_METRE = {name: 0.5 for name in PENDULUM3.truth}
A_METRE = {name: 1.0 for name in PAPER.truth}


def identifications():
    """Problem, how the start is called, line, command. From two of the starts
    of sysid_fit the toolbox ends in a wrong minimum: `nearer` is another."""
    for problem, start, said, nearer in [
            (PENDULUM3, HALF_A_METRE, "0.5 m", 0.05),
            (CARTPOLE, CARTPOLE.start(0.2), "20 % off", 0.02),
            (FRICTION, FRICTION.start(0.2), "20 % off", None),
            (HIDDEN, HIDDEN.start(0.2), "20 % off", None),
            (PAPER, A_METRE, "1 m", None)]:
        yield problem, said, "sysid_fit", problem.ours(start)
        yield problem, said, "toolbox", problem.theirs(start)
        if nearer:
            start, said = problem.start(nearer), f"{100 * nearer:.0f} % off"
            yield problem, said, "sysid_fit", problem.ours(start)
            yield problem, said, "toolbox", problem.theirs(start)
        yield (problem, said, "toolbox, initial states estimated",
               problem.theirs(start, "--states"))


def programs():
    """Command lines of ours, as they are typed."""
    arm = "--excite multisine --out_csv arm.csv"
    hidden = ("--traj data/runs/hidden_1.csv,data/runs/hidden_2.csv "
              "--holdout data/runs/hidden_3.csv")
    return [
        "sysid_fit --model pendulum3 --traj data/runs/pendulum3.csv",
        "sysid_fit --model pendulum3 --traj data/runs/pendulum3.csv "
        "--out result",
        "sysid_fit --model rod_and_bob --traj data/runs/rod_and_bob.csv",
        "sysid_fit --model pendulum2 --traj data/runs/figure1_damped.csv "
        "--add viscous_damping@joint1,viscous_damping@joint2",
        "sysid_check --model pendulum3 --traj data/runs/pendulum3.csv",
        "sysid_check --model cartpole --traj data/runs/cartpole.csv",
        f"sysid_diagnose --model pendulum2_planar {hidden}",
        f"sysid_diagnose --model pendulum2_planar {hidden} --auto",
        "sysid_diagnose --model pendulum3 --traj data/runs/pendulum3.csv "
        "--holdout data/runs/pendulum3_holdout.csv",
        "sysid_simulate --model pendulum3 --out_csv swing.csv",
        f"sysid_simulate --model arm7 {arm}",
    ]


def spent(command, folder):
    """Wall and processor seconds of a process with its children, and its
    output. It writes into the folder."""
    with tempfile.TemporaryFile() as output:
        began = time.perf_counter()
        process = subprocess.Popen(command, cwd=folder, stdout=output,
                                   stderr=subprocess.PIPE)
        errors = process.stderr.read().decode()
        _, status, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - began
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        text = output.read().decode()
    # 1 of our programs: not converged, or findings.
    if process.returncode not in ((0,) if command[0] == sys.executable
                                  else (0, 1)):
        raise SystemExit(f"{errors[-2000:]}\nexit code {process.returncode} "
                         f"of {' '.join(command)}")
    return wall, used.ru_utime + used.ru_stime, text


def measured(command, folder):
    rounds, began = [], time.perf_counter()
    while len(rounds) < MOST:
        rounds.append(spent(command, folder))
        if time.perf_counter() - began > LONG:
            break
    return {"wall": statistics.median(r[0] for r in rounds),
            "cpu": statistics.median(r[1] for r in rounds),
            "rounds": len(rounds), "output": rounds[-1][2]}


def program_path(build, command):
    """The command with the place of the program, if it is one of ours."""
    if os.path.isabs(command[0]):
        return command
    return [os.path.join(build, "tools", command[0]), *command[1:]]


def say(line, it, more=""):
    print(f"{it['wall']:8.2f} s, {it['cpu']:8.2f} s of CPU  {line}{more}",
          flush=True)


def estimates(text):
    said = json.loads(text)
    if isinstance(said["parameters"], dict):
        return said["parameters"], said["iterations"]
    return ({p["name"]: p["value"] for p in said["parameters"]},
            said["iterations"])


def main():
    build, out = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    wanted = re.compile(sys.argv[3] if len(sys.argv) > 3 else "")

    result = {"imports": None, "identifications": [], "programs": []}
    with tempfile.TemporaryDirectory() as folder:
        os.symlink(os.path.join(ROOT, "data"), os.path.join(folder, "data"))
        imports = [sys.executable, "-c", "from mujoco import sysid"]
        spent(imports, folder)  # what is read for the first time
        result["imports"] = measured(imports, folder)
        say("imports of the toolbox", result["imports"])
        for problem, start, line, command in identifications():
            name = f"{problem.model}: {problem.name}, {start}, {line}"
            if not wanted.search(name):
                continue
            it = measured(program_path(build, command), folder)
            found, iterations = estimates(it.pop("output"))
            it.update(problem=problem.name, run=problem.runs, start=start,
                      program=line, iterations=iterations,
                      error=problem.error(found))
            result["identifications"].append(it)
            say(name, it, f", error {it['error']:.2g} %")
        for line in programs():
            if not wanted.search(line):
                continue
            it = measured(program_path(build, line.split()), folder)
            it.pop("output")
            it["command"] = line
            result["programs"].append(it)
            say(line, it)
    result["imports"].pop("output")
    with open(out, "w", encoding="utf-8") as file:
        json.dump(result, file, indent=1)


if __name__ == "__main__":
    main()
