"""Writes what scripts/benchmark measured into docs/performance.md and its plots.

    write_tables.py FOLDER DOCS HEADING

FOLDER holds NAME.json of Google Benchmark, programs.json and arm.json
(whole_programs.py, whole_arm.py), instructions.txt (lines: level model scalar
count instructions) and the plots. In DOCS/performance.md what is between
`<!-- NAME -->` and `<!-- end -->` is replaced, and between `<!-- measured -->`
and `<!-- end -->` by the heading. Where a table or a line of it is missing,
nothing is written.
"""

import json
import os
import re
import shutil
import sys
import textwrap

# Of each program: what the columns are called, counter by counter; {} are the
# versions that the program says.
COLUMNS = {
    "physics": [("mj_forward", "mj_forward of MuJoCo {mj_forward}, ns"),
                ("ratio", "ratio"),
                ("debian", "of MuJoCo {debian}, ns"),
                ("over_plain", "over the plain rollout")],
    "rigid_body": [("pinocchio", "Pinocchio {pinocchio}, ns"),
                   ("ratio", "times faster")],
    "fit": [("lm_iterations", "iterations"), ("reference", "SciPy + MuJoCo, ms"),
            ("ratio", "times faster"), ("their_rollouts", "their rollouts"),
            ("error", "error, std. errors"), ("their_error", "theirs"),
            ("alone", "one thread, ms"), ("speedup", "speed-up"),
            ("cut_out", "cut out by hand, ms"),
            ("over_cut_out", "over that")],
    "growth": [("ns_sample", "ns a sample and linearisation"),
               ("B_sample", "bytes of peak memory a sample")],
    "inverse_dynamics": [("free", "free parameters"), ("base", "that show"),
                         ("reference", "NumPy, ms"), ("ratio", "times faster"),
                         ("cpu_ratio", "in processor time"),
                         ("iteration", "iteration of lm, ms")],
    "diagnosis": [("candidates", "candidates"), ("tests", "points of grids"),
                  ("iteration", "iteration, ms"), ("ratio", "ratio")],
    "typed_laws": [("shipped_ms", "of the catalogue, ms"),
                   ("typed_ms", "typed, ms"), ("ratio", "ratio")],
    "stochastic": [("rollout_us", "rollout, us"), ("ratio", "ratio"),
                   ("tape_kB", "tape, kB"),
                   ("epochs_s", "epochs a second"), ("speedup", "speed-up")],
}
PLOTS = ["growth.svg", "growth_joints.svg"]
TO_MS = {"ns": 1e-6, "us": 1e-3, "ms": 1.0, "s": 1e3}


def number(value):
    if value is None:
        return ""
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def time(milliseconds):
    if milliseconds < 1e-3:
        return f"{1e6 * milliseconds:.3g} ns"
    if milliseconds < 1.0:
        return f"{1e3 * milliseconds:.3g} us"
    return f"{number(milliseconds)} ms"


def medians(benchmarks):
    """Medians where there are any, else what there is."""
    chosen = [b for b in benchmarks if b.get("aggregate_name") == "median"]
    return chosen or [b for b in benchmarks if b["run_type"] == "iteration"]


def table(lines):
    head, *rows = lines
    text = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    text += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(text)


def read(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def benchmark_table(name, path):
    said = read(path)
    found = medians(said["benchmarks"])
    for b in found:
        label = b.get("error_message") or b.get("label") or ""
        if b.get("error_occurred") or "failed" in label:
            raise SystemExit(f"{name}: {b['name']}: {label}")
    columns = COLUMNS[name]
    for key, _ in columns:
        if not any(key in b for b in found):
            raise SystemExit(f"{name}: nothing has {key}")
    lines = [["line", "time"] + [title.format_map(said["context"])
                                 for _, title in columns]]
    for b in found:
        label = f" ({b['label']})" if b.get("label") else ""
        wall = ("real_time" if re.search("real_time|manual_time", b["name"])
                else "cpu_time")
        row_name = b.get("run_name", b["name"])
        row_name = re.sub(r"/(iterations|repeats):\d+|/(real|manual)_time", "",
                          row_name)
        lines.append([f"`{row_name}`{label}",
                      time(b[wall] * TO_MS[b["time_unit"]])] +
                     [number(b.get(key)) for key, _ in columns])
    return table(lines)


def identification_table(said):
    lines = [["identification", "start", "by", "wall, s", "CPU, s",
              "iterations", "largest error, %"]]
    last = None
    for i in said["identifications"]:
        runs = ", ".join(f"`{run}`" for run in i["run"].split(","))
        lines.append([
            f"{runs}: {i['problem']}" if i["run"] != last else "", i["start"],
            i["program"], number(i["wall"]), number(i["cpu"]),
            str(i["iterations"]), f"{i['error']:.2g}"])
        last = i["run"]
    imports = said["imports"]
    lines.append(["(nothing)", "", "toolbox, its imports alone",
                  number(imports["wall"]), number(imports["cpu"]), "", ""])
    return table(lines)


def program_table(said):
    return table([["command", "wall, s", "CPU, s"]] + [
        [f"`{p['command']}`", number(p["wall"]), number(p["cpu"])]
        for p in said["programs"]])


def arm_table(said):
    return table([["by", "wall, s", "CPU, s", "base parameters",
                   "error of efforts, %"]] + [
        [p["by"], number(p["wall"]), number(p["cpu"]), str(p["base"]),
         f"{p['error']:.2g}"] for p in said])


def instruction_table(path):
    counts = {}
    with open(path, encoding="utf-8") as file:
        for line in file:
            level, model, scalar, count, total = line.split()
            counts[level, model, scalar, int(count)] = int(total)
    scalars = ["double", "Jet8", "Jet16", "Jet24"]
    lines = [["instructions an evaluation"] + [f"`{s}`" for s in scalars]]
    for level in ["x86-64-v3", "x86-64"]:
        for model in ["pendulum3", "pendulum3_planar", "arm7"]:
            lines.append([f"{model}, {level}"] + [
                number((counts[level, model, s, 1100] -
                        counts[level, model, s, 100]) / 1000)
                for s in scalars])
    return table(lines)


def replace(page, name, text):
    start, end = f"<!-- {name} -->", "<!-- end -->"
    pattern = re.escape(start) + r".*?" + re.escape(end)
    if not re.search(pattern, page, re.S):
        raise SystemExit(f"the page has no {start} ... {end}")
    return re.sub(pattern, lambda _: f"{start}\n{text}\n{end}", page, count=1,
                  flags=re.S)


def main():
    folder, docs, heading = sys.argv[1:]

    def measured(name):
        path = os.path.join(folder, name)
        if not os.path.exists(path) or os.path.getsize(path) == 0:
            raise SystemExit(f"{name} was not measured")
        return path

    programs = read(measured("programs.json"))
    tables = {
        "measured": textwrap.fill(heading, 120),
        "identifications": identification_table(programs),
        "programs": program_table(programs),
        "arm": arm_table(read(measured("arm.json"))),
        "instructions": instruction_table(measured("instructions.txt")),
    }
    for name in COLUMNS:
        tables[name] = benchmark_table(name, measured(name + ".json"))
    plots = [measured(name) for name in PLOTS]
    path = os.path.join(docs, "performance.md")
    with open(path, encoding="utf-8") as file:
        page = file.read()
    for name, text in tables.items():
        page = replace(page, name, text)
    with open(path + ".part", "w", encoding="utf-8") as file:
        file.write(page)
    for plot in plots:
        shutil.copy(plot, os.path.join(docs, "figures"))
    os.replace(path + ".part", path)


if __name__ == "__main__":
    main()
