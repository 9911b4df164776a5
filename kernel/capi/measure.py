#!/usr/bin/env python3
"""Flash and stack of every function of C on a Cortex-M4F, and the proof that none can panic, from static libraries.

    measure.py [--table] LIBRARY...

Each function is linked alone, with everything that it calls and no more (`--gc-sections`): its text and read-only data are
the flash. Stack: the longest path of calls, each with what its prologue pushes and reserves; a callback's own stack comes on
top. With `--table` the table of README.md is printed, from the first library."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "tests"))
from header import FUNCTIONS  # noqa: E402

PREFIX = "arm-none-eabi-"
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


def main():
    table = "--table" in sys.argv
    libraries = [argument for argument in sys.argv[1:] if argument != "--table"]
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
        if not table:
            return
        print("| function | workspace, bytes (`f32`, n correspondences) | flash `f32` | stack `f32` | flash `f64` | stack `f64` |")
        print("|---|---|---|---|---|---|")
        for name in functions:
            if name.endswith("_f64"):
                continue
            base = name.removesuffix("_f32")
            row = [f"`{base}`", WORKSPACES.get(base[4:].removesuffix("_guided"), "")]
            if base.startswith("epi_window"):
                row[1] = "the window"
            for scalar in ("_f32", "_f64") if name.endswith("_f32") else ("",):
                if base + scalar in functions:
                    row += [str(link(libraries[0], [base + scalar], elf)[0]), str(stack[base + scalar])]
            print("| " + " | ".join(row + [""] * (6 - len(row))) + " |")


if __name__ == "__main__":
    main()
