#!/usr/bin/env python3
"""Flash and stack of every function of C on a Cortex-M4F, and the proof that none can panic, from static libraries.

    measure.py [--table | --update | --check] LIBRARY...

Each function is linked alone, with everything that it calls and no more (`--gc-sections`): its text and read-only data are
the flash. Stack: the longest path of calls, each with what its prologue pushes and reserves; a callback's own stack comes on
top.
With `--table` the table of README.md is printed, from the first library; `--update` writes it there; `--check` fails where a
figure has grown by more than 2 % and 16 bytes, if the table is of the same compiler."""

import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "tests"))
from header import FUNCTIONS  # noqa: E402

PREFIX = "arm-none-eabi-"
README = Path(__file__).resolve().parent / "README.md"
BEGIN, END = "<!-- figures -->", "<!-- end of figures -->"
HEAD = [
    "| function | workspace, bytes (`f32`, n correspondences) | flash `f32` | stack `f32` | flash `f64` | stack `f64` |",
    "|---|---|---|---|---|---|",
]
PANIC = re.compile(r"core9panicking|unwrap_failed|expect_failed|rust_begin_unwind|slice_\w*_fail|_fail(?:ed)?\b")
# What camera firmware links, and its limit in bytes.
FOUR = ("relative_pose", "homography", "absolute_pose", "triangulate")
WORKSPACES = {
    "relative_pose": "21 n, fisheye 77 n", "refine_relative_pose": "21 n, fisheye 77 n", "homography": "21 n",
    "fundamental": "21 n", "absolute_pose": "25 n, fisheye 53 n",
}


def run(*command):
    return subprocess.run([PREFIX + command[0], *command[1:]], check=True, capture_output=True, text=True).stdout


def link(library, roots, out):
    run("ld", "--gc-sections", "-e", roots[0], *(f"--undefined={root}" for root in roots), "-o", out, library)
    text, data, bss = map(int, run("size", out).splitlines()[1].split()[:3])
    return text, data, bss


def stacks(elf):
    """The deepest stack of every function of an image, by name."""
    frames, calls, name = {}, {}, None
    for line in run("objdump", "-d", "--no-show-raw-insn", elf).splitlines():
        if start := re.match(r"[0-9a-f]+ <(.+)>:$", line):
            name = start[1]
            frames[name], calls[name] = 0, set()
            continue
        fields = line.split("\t")
        if name is None or len(fields) < 2:
            continue
        operation, operands = fields[1].strip(), fields[2] if len(fields) > 2 else ""
        if operation.split(".")[0] == "push" or (operation.startswith("stmdb") and operands.startswith("sp!")):
            frames[name] += 4 * registers(operands)
        elif operation.startswith("vpush") or (operation.startswith("vstmdb") and operands.startswith("sp!")):
            frames[name] += (8 if "d" in operands.split("{")[1] else 4) * registers(operands)
        elif operation.startswith("sub") and (size := re.match(r"sp, (?:sp, )?#(\d+)", operands)):
            frames[name] += int(size[1])
        elif operation.startswith("str") and (size := re.search(r"\[sp, #-(\d+)\]!", operands)):
            frames[name] += int(size[1])
        if operation.startswith("b") and (target := re.search(r"<([^+>]+)(\+0x[0-9a-f]+)?>", operands)):
            if target[1] != name:
                calls[name].add(target[1])
    deepest = {}

    def depth(function):
        if function not in deepest:
            deepest[function] = 0  # There is no recursion; a cycle would count once.
            deepest[function] = frames.get(function, 0) + max(map(depth, calls.get(function, ())), default=0)
        return deepest[function]

    sys.setrecursionlimit(10000)
    # Functions of the same code have one body and several names.
    found = {function: depth(function) for function in frames}
    places = {}
    for line in run("nm", elf).splitlines():
        place, _, *name = line.split()
        places.setdefault(place, []).append(name[0])
    for names in places.values():
        deepest_of = max(found.get(name, 0) for name in names)
        found.update((name, deepest_of) for name in names)
    return found


def registers(operands):
    count = 0
    for part in re.search(r"\{(.*)\}", operands)[1].split(","):
        ends = part.strip().split("-")
        numbers = [int(re.sub(r"\D", "", end) or 0) for end in ends]
        count += numbers[-1] - numbers[0] + 1 if len(ends) == 2 else 1
    return count


def row_of(library, base, functions, stack, elf):
    """A line of the table: a function's flash and stack, for each scalar."""
    workspace = WORKSPACES.get(base[4:].removesuffix("_guided"), "the window" if base.startswith("epi_window") else "")
    row = [f"`{base}`", workspace]
    for name in (base, base + "_f32", base + "_f64"):
        if name in functions:
            row += [str(link(library, [name], elf)[0]), str(stack[name])]
    return row + [""] * (6 - len(row))


def split(readme):
    """What stands before the table, its lines, and what follows."""
    before, marker, rest = readme.partition(BEGIN)
    table, end, after = rest.partition(END)
    assert marker and end, "the table's markers are gone"
    return before + marker, table.strip().splitlines(), end + after


def grown(old, new):
    """The figures that have grown, and how many were compared."""
    figures = {row[0]: row[2:] for row in (re.split(r" *\| *", line)[1:-1] for line in old)}
    growth, compared = [], 0
    for row in new:
        committed = figures.get(row[0])
        if committed is None:
            growth.append(f"{row[0]} is not in the table")
            continue
        for before, now in zip(committed, row[2:]):
            if now:
                compared += 1
                if not before or int(now) > 1.02 * int(before) + 16:
                    growth.append(f"{row[0]}: {before} -> {now}")
    return growth, compared


def main():
    mode = next((argument for argument in sys.argv[1:] if argument.startswith("--")), None)
    assert mode in (None, "--table", "--update", "--check"), f"what is {mode}?"
    libraries = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    defined = run("nm", "-g", "--defined-only", libraries[0])
    functions = [name for name in FUNCTIONS if re.search(rf" T {name}$", defined, flags=re.M)]
    with tempfile.TemporaryDirectory() as folder:
        elf = str(Path(folder) / "image.elf")
        for library in libraries:
            text, data, bss = link(library, functions, elf)
            assert (data, bss) == (0, 0), f"{library}: {data} bytes of .data, {bss} of .bss"
            left = sorted({name for name in run("nm", elf).split() if PANIC.search(name)})
            print(f"{library}: {len(functions)} functions, {text} bytes, no .data, no .bss, panic paths: {len(left)}",
                  file=sys.stderr)
            if left:
                sys.exit("the linker keeps what only a panic calls: " + " ".join(left))
        link(libraries[0], functions, elf)
        stack = stacks(elf)
        four = link(libraries[0], [f"epi_{name}_f32" for name in FOUR], elf)[0]
        print(f"{', '.join(FOUR)} in f32: {four} bytes", file=sys.stderr)
        if mode is None:
            return
        bases = dict.fromkeys(re.sub("_f(32|64)$", "", name) for name in functions)
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            rows = list(pool.map(lambda base: row_of(libraries[0], base, functions, stack, f"{folder}/{base}"), bases))
    compiler = subprocess.run(["rustc", "--version"], check=True, capture_output=True, text=True).stdout.strip()
    lines = [f"By {compiler}; camera firmware ({', '.join(FOUR)}) in `f32`: {four} bytes.", "", *HEAD]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    if mode == "--table":
        print("\n".join(lines))
        return
    before, old, after = split(README.read_text())
    if mode == "--update":
        README.write_text("\n".join([before, "", *lines, "", after]).replace("-->\n\n\n", "-->\n\n"))
        return
    growth, compared = grown(old[4:], rows)
    same = compiler in old[0]
    print("\n".join(growth + [f"{compared} figures compared, {len(growth)} grown"]))
    if not same:
        print("SKIPPED: the table belongs to another compiler, and nothing is judged")
    sys.exit(bool(same and growth))


if __name__ == "__main__":
    main()
