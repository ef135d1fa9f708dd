"""Writes what scripts/benchmark measured between the markers of a Markdown page.

    write_tables.py FOLDER PAGE HEADING

FOLDER holds NAME.json of Google Benchmark and instructions.txt (lines: level
model scalar count instructions). In PAGE what is between `<!-- NAME -->` and
`<!-- end -->` is replaced, and between `<!-- measured -->` and `<!-- end -->` by
the heading.
"""

import json
import os
import re
import sys

# Of each program: what the columns are called, counter by counter.
COLUMNS = {
    "physics": [("mj_forward", "mj_forward, ns"), ("ratio", "ratio"),
                ("over_plain", "over the plain rollout")],
    "fit": [("iterations", "iterations"), ("reference", "SciPy + MuJoCo, ms"),
            ("ratio", "times faster"), ("error", "error, std. errors"),
            ("their_error", "theirs"), ("alone", "one thread, ms"),
            ("speedup", "speed-up"), ("cut_out", "cut out by hand, ms"),
            ("over_cut_out", "over that")],
    "growth": [("ns_sample", "ns a sample and linearisation"),
               ("B_sample", "bytes of peak memory a sample")],
    "inverse_dynamics": [("free", "free parameters"), ("base", "that show"),
                         ("reference", "NumPy, ms"), ("ratio", "times faster"),
                         ("cpu_ratio", "in processor time"),
                         ("iteration", "iteration of lm, ms")],
    "diagnosis": [("candidates", "candidates"), ("iteration", "iteration, ms"),
                  ("ratio", "ratio")],
    "typed_laws": [("shipped_ms", "of the catalogue, ms"),
                   ("typed_ms", "typed, ms"), ("ratio", "ratio")],
    "stochastic": [("rollout_us", "rollout, us"), ("ratio", "ratio"),
                   ("epochs_s", "epochs a second"), ("speedup", "speed-up")],
}
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


def benchmark_table(name, path):
    with open(path) as file:
        found = medians(json.load(file)["benchmarks"])
    columns = [(key, title) for key, title in COLUMNS[name]
               if any(key in b for b in found)]
    lines = [["line", "time"] + [title for _, title in columns]]
    for b in found:
        label = f" ({b['label']})" if b.get("label") else ""
        wall = ("real_time" if re.search("real_time|manual_time", b["name"])
                else "cpu_time")
        row_name = b.get("run_name", b["name"])
        row_name = re.sub(r"/(iterations|repeats):\d+|/(real|manual)_time", "", row_name)
        lines.append([f"`{row_name}`{label}",
                      time(b[wall] * TO_MS[b["time_unit"]])] +
                     [number(b.get(key)) for key, _ in columns])
    return table(lines)


def instruction_table(path):
    counts = {}
    with open(path) as file:
        for line in file:
            level, model, scalar, count, total = line.split()
            counts[level, model, scalar, int(count)] = int(total)
    scalars = ["double", "Jet8", "Jet16", "Jet24"]
    lines = [["instructions an evaluation"] + [f"`{s}`" for s in scalars]]
    for level, model in dict.fromkeys((k[0], k[1]) for k in counts):
        lines.append([f"{model}, {level}"] + [
            number((counts[level, model, s, 1100] -
                    counts[level, model, s, 100]) / 1000) for s in scalars])
    return table(lines)


def replace(page, name, text):
    start, end = f"<!-- {name} -->", "<!-- end -->"
    pattern = re.escape(start) + r".*?" + re.escape(end)
    if not re.search(pattern, page, re.S):
        raise SystemExit(f"the page has no {start} ... {end}")
    return re.sub(pattern, lambda _: f"{start}\n{text}\n{end}", page, count=1,
                  flags=re.S)


def main():
    folder, path, heading = sys.argv[1:]
    with open(path) as file:
        page = file.read()
    page = replace(page, "measured", heading)
    for name in COLUMNS:
        source = os.path.join(folder, name + ".json")
        if os.path.exists(source):
            page = replace(page, name, benchmark_table(name, source))
    source = os.path.join(folder, "instructions.txt")
    if os.path.exists(source) and os.path.getsize(source) > 0:
        page = replace(page, "instructions", instruction_table(source))
    with open(path, "w") as file:
        file.write(page)


if __name__ == "__main__":
    main()
