#!/usr/bin/env python3
"""Run the command on every file of a folder and say what became of each.

    broken.py FOLDER --decimate target/release/decimate

One line a file: exit status, what the command said, seconds, and the most memory that it held. Exits with 1 where a file
takes more than a second or 100 MB, or where the command does not exit by itself: a signal, a panic, a status that its
help does not name, or no word on standard error with a status other than 0. Python alone; not on Windows.

The memory is what the system counted for the process, Python's own of some 10 MB before the command began included.
"""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

MOST_SECONDS = 1.0
MOST_MEGABYTES = 100.0
PATIENCE_SECONDS = 60
# Done, could not be processed, wrong usage.
EXPECTED = (0, 1, 2)


def run(command, messages):
    """The exit status (negative for a signal), seconds and megabytes of a command."""
    start = time.monotonic()
    child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=messages)
    deadline = start + PATIENCE_SECONDS
    while True:
        pid, status, usage = os.wait4(child.pid, os.WNOHANG)
        if pid:
            break
        if time.monotonic() > deadline:
            child.kill()
            pid, status, usage = os.wait4(child.pid, 0)
            break
        time.sleep(0.002)
    seconds = time.monotonic() - start
    child.returncode = os.waitstatus_to_exitcode(status)
    unit = 1 if sys.platform == "darwin" else 1024
    return child.returncode, seconds, usage.ru_maxrss * unit / 1e6


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--ratio", default="0.5", metavar="R")
    parser.add_argument("--decimate", default="target/release/decimate", metavar="BINARY")
    options = parser.parse_args()
    files = sorted(path for path in options.folder.iterdir() if path.is_file())
    if not files:
        raise SystemExit(f"{options.folder}: no file in it")
    print("| file | exit | message | seconds | MB |")
    print("|---|---|---|---|---|")
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out.ply"
        said = pathlib.Path(folder) / "said"
        for file in files:
            with said.open("wb") as messages:
                status, seconds, megabytes = run(
                    [options.decimate, file, "-o", out, "--ratio", options.ratio], messages)
            text = said.read_text(errors="replace").replace(str(file), file.name).replace(f" -> {out}", "")
            lines = text.splitlines()
            message = (lines[0] if lines else "").removeprefix("error: ").removeprefix(f"{file.name}: ")
            is_whole = status == 0 or not out.exists()
            if status not in EXPECTED or not message or not is_whole or "panicked" in text \
                    or seconds > MOST_SECONDS or megabytes > MOST_MEGABYTES:
                wrong.append(file.name)
                message += " **WRONG**"
            print("|", " | ".join([file.name, str(status), message.replace("|", "\\|"), f"{seconds:.2f}",
                                   f"{megabytes:.0f}"]), "|", flush=True)
            out.unlink(missing_ok=True)
    print(f"\n{len(wrong)} of {len(files)} wrong" + "".join(f"\n  {name}" for name in wrong), file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
