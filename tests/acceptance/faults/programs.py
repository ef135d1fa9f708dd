"""The programs under test, as child processes: nothing of them is linked."""

import dataclasses
import json
import os
import shlex
import subprocess
from pathlib import Path


@dataclasses.dataclass
class Result:
    code: int  # None: it was ended, by the limit or a crash
    json: dict  # what --json wrote; None without
    err: str
    seconds: float  # of the processor


class Programs:
    """The folder of sysid_check and the others."""

    def __init__(self, folder, mujoco_recording=None, limit=600):
        self.folder = Path(folder).resolve()
        self.mujoco = mujoco_recording and Path(mujoco_recording).resolve()
        self.limit = limit  # s of the processor, for each program
        fit_help = subprocess.run([self.folder / "sysid_fit", "--help"],
                                  capture_output=True, text=True, check=True)
        # A fit need not repeat what sysid_check was asked already.
        self._unchecked = (["--check", "none"] if "--check" in fit_help.stdout
                           else [])

    def run(self, program, flags, cwd):
        """Runs one with --json; its result."""
        cwd = Path(cwd)
        out = cwd / (program + ".json")
        out.unlink(missing_ok=True)
        # The limit is processor time: the verdict is that of a busy machine.
        command = ["sh", "-c", 'ulimit -t "$0" && exec "$@"',
                   str(self.limit), str(self.folder / program), *flags,
                   "--threads", "1", "--json", out.name]
        with open(cwd / (program + ".err"), "w+") as err:
            child = subprocess.Popen(command, cwd=cwd, stderr=err,
                                     stdout=subprocess.DEVNULL)
            _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
            err.seek(0)
            said = err.read()
        code = child.returncode
        document = json.loads(out.read_text()) if out.exists() else None
        return Result(None if code < 0 else code, document, said,
                      usage.ru_utime + usage.ru_stime)

    def check(self, flags, cwd):
        return self.run("sysid_check", flags, cwd)

    def fit(self, flags, cwd):
        return self.run("sysid_fit", [*flags, *self._unchecked], cwd)

    def diagnose(self, flags, cwd):
        return self.run("sysid_diagnose", flags, cwd)

    def simulate(self, flags, cwd):
        subprocess.run([str(self.folder / "sysid_simulate"), *flags], cwd=cwd,
                       check=True, capture_output=True)

    def record(self, model, numbers, cwd):
        """The rows that mujoco_recording prints."""
        (Path(cwd) / "plant.xml").write_text(model)
        done = subprocess.run([self.mujoco, "plant.xml"], cwd=cwd,
                              input="\n".join(numbers), text=True,
                              capture_output=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(done.stderr)
        return [[float(word) for word in line.split()]
                for line in done.stdout.splitlines()]


def split_entries(value):
    """The entries of a flag's list: commas outside of brackets and quotes."""
    entries, depth, quote, start = [], 0, "", 0
    for i, c in enumerate(value):
        if quote:
            quote = "" if c == quote else quote
        elif c in "'\"":
            quote = c
        elif c in "([":
            depth += 1
        elif c in ")]":
            depth -= 1
        elif c == "," and depth == 0:
            entries.append(value[start:i])
            start = i + 1
    return [entry for entry in entries + [value[start:]] if entry]


def parse_flags(text):
    """{flag: value} of words as a shell reads them; {} where none begins."""
    words = shlex.split(text)
    if not words or not words[0].startswith("--"):
        return {}
    flags, i = {}, 0
    while i < len(words) and words[i].startswith("--"):
        flag, equals, value = words[i][2:].partition("=")
        if not equals:
            i += 1
            if i == len(words):
                return {}
            value = words[i]
        flags[flag] = value
        i += 1
    return flags


# What stands before this names the column that an entry is about.
_KEY_ENDS = {"columns": "=", "shift": "=", "fix": "=", "free": "="}


def merged(given, more):
    """The flags of a command, with those of a suggested fix pasted in.

    Of lists the new entry about a column replaces the old one and others
    stay; --ignore may name one column many times. Any other flag replaces.
    """
    result = dict(given)
    for flag, value in more.items():
        old = split_entries(result.get(flag, ""))
        new = split_entries(value)
        if flag == "ignore":
            entries = old + [entry for entry in new if entry not in old]
        elif flag in _KEY_ENDS:
            end = _KEY_ENDS[flag]
            keys = {entry.split(end)[0].strip() for entry in new}
            entries = [entry for entry in old
                       if entry.split(end)[0].strip() not in keys] + new
        else:
            result[flag] = value
            continue
        result[flag] = ",".join(entries)
    return result


def as_words(flags):
    return [word for flag, value in flags.items()
            for word in ("--" + flag, value)]
