#!/usr/bin/env python3
"""The rules of the C interface, function by function, through the shared library: null, misaligned and overlapping
pointers, counts that no memory holds, capacities, sizes of structs, unknown values of enumerations. Each is a status of its
own, and nothing but a workspace has been written.

    rules.py LIBRARY
"""

import ctypes
import sys

from header import CONSTANTS, FUNCTIONS, SCALARS, STRUCTS, load

ROOM = 1 << 16
COUNT = 8
NULLABLE = {"scores", "keep_going", "context"}
ENUMS = {"method", "fixed", "loss", "prior"}
# Answers without a status: sizes, versions, strings.
NOT_JUDGED = [name for name, (result, _) in FUNCTIONS.items() if result != "int32_t"]


def status(name):
    return CONSTANTS["EPI_STATUS_" + name]


class Arena:
    """Memory for each pointer of a call, far from each other's."""

    def __init__(self, regions):
        self.raw = ctypes.create_string_buffer(ROOM * (regions + 2))
        self.start = (ctypes.addressof(self.raw) + ROOM - 1) // ROOM * ROOM

    def region(self, k):
        return self.start + k * ROOM

    def bytes(self, but=None):
        regions = range((len(self.raw) - ROOM) // ROOM)
        return [ctypes.string_at(self.region(k), ROOM) for k in regions if k != but]


class Call:
    """A call that no rule forbids."""

    def __init__(self, library, name):
        self.library, self.name, self.function = library, name, getattr(library, name)
        self.suffix = name[-4:]
        self.parameters = FUNCTIONS[name][1]
        self.arena = Arena(len(self.parameters))
        self.values = [self.value(k, *parameter) for k, parameter in enumerate(self.parameters)]
        self.workspace = next((k for k, p in enumerate(self.parameters) if p[3] == "workspace"), None)
        self.window = next((k for k, p in enumerate(self.parameters) if p[3] == "window" and p[1] == 1), None)

    def value(self, k, kind, stars, const, name):
        if name in NULLABLE and name != "scores":
            return None
        if stars:
            address = self.arena.region(k)
            ctypes.memset(address, 0 if const else 0xA5, ROOM)
            if name == "window" and stars == 1:
                made = ctypes.c_void_p()
                create = getattr(self.library, "epi_window_create" + self.suffix)
                assert create(address, ROOM // 2, 4, 8, 32, 1, ctypes.addressof(made)) == 0
                assert made.value == address
            elif kind.startswith("epi_pose") and const:
                for each in (STRUCTS[kind] * COUNT).from_address(address):
                    each.rotation[3] = 1
            elif kind.startswith("epi_camera") and const:
                for each in (STRUCTS[kind] * COUNT).from_address(address):
                    each.fx = each.fy = 500
            elif "_options" in kind and const:
                default = getattr(self.library, kind[:-4] + "_default" + self.suffix)
                assert default(address, ctypes.sizeof(STRUCTS[kind])) == 0
            elif name in ("quaternion",) and const:
                scalar = ctypes.c_float if self.suffix == "_f32" else ctypes.c_double
                scalar.from_address(address + 3 * ctypes.sizeof(scalar)).value = 1
            return address
        if name == "count":
            return COUNT
        if name == "capacity":
            return 16
        if name in ("workspace_size",):
            return ROOM
        if name == "size" and self.name.startswith("epi_window_create"):
            return ROOM
        if name == "size" or name.endswith("_size"):
            return ctypes.sizeof(STRUCTS[self.struct_before(k)])
        if name in ("frames", "points", "observations"):
            return 4
        return 1 if kind in ("float", "double") else 0

    def struct_before(self, k):
        return self.parameters[k - 1][0]

    def run(self, **changed):
        values = [changed.get(p[3], v) for p, v in zip(self.parameters, self.values)]
        return self.function(*values)

    def refuses(self, expected, why, **changed):
        before = self.arena.bytes(self.workspace)
        answer = self.run(**changed)
        text = self.library.epi_status_string(answer).decode()
        assert answer == expected, f"{self.name}: {why}: answers {answer} ({text}), not {expected}"
        assert self.arena.bytes(self.workspace) == before, f"{self.name}: {why}: something was written"


def check(library, name):
    """How many calls were refused as the rules say."""
    refused = 0

    def refuses(expected, why, prepare=None, **changed):
        nonlocal refused
        call = Call(library, name)
        if prepare:
            prepare(call)
        changed = {key: value(call) if callable(value) else value for key, value in changed.items()}
        call.refuses(status(expected), why, **changed)
        refused += 1

    call = Call(library, name)
    answer = call.run()
    forbidden = [status(s) for s in ("NULL_POINTER", "MISALIGNED", "OVERLAP", "TOO_LARGE", "STRUCT_SIZE", "UNKNOWN_ENUM")]
    assert answer not in forbidden, f"{name}: a call that no rule forbids answers {answer}"

    pointers = [(k, p) for k, p in enumerate(call.parameters) if p[1] and p[3] not in ("context",)]
    for k, (kind, stars, const, parameter) in pointers:
        if parameter not in NULLABLE:
            refuses("NULL_POINTER", f"{parameter} null", **{parameter: None})
        if kind != "uint8_t":
            refuses("MISALIGNED", f"{parameter} misaligned", **{parameter: lambda c, k=k: c.values[k] + 1})
        if const:
            continue
        for other, (_, _, _, other_name) in pointers:
            if other != k:
                where = 64 if other_name == "window" and call.parameters[other][1] == 1 else 0
                # An output where another argument lies.
                if parameter != "window":
                    refuses("OVERLAP", f"{parameter} over {other_name}",
                            **{parameter: lambda c, o=other, w=where: c.values[o] + w})

    for k, (kind, stars, const, parameter) in enumerate(call.parameters):
        if stars:
            if "_options" in kind and const:
                for wrong in (0, 4, ctypes.sizeof(STRUCTS[kind]) + 8, 0xFFFFFFFF):
                    def prepare(c, k=k, wrong=wrong):
                        ctypes.c_uint32.from_address(c.values[k]).value = wrong
                    refuses("STRUCT_SIZE", f"{parameter}.size {wrong}", prepare)
            if kind.startswith("epi_camera") and const:
                def prepare(c, k=k, kind=kind):
                    STRUCTS[kind].from_address(c.values[k]).model = 99
                refuses("UNKNOWN_ENUM", f"{parameter}.model", prepare)
            if kind.startswith("epi_pose") and const and parameter not in ("prior",):
                def prepare(c, k=k, kind=kind):
                    STRUCTS[kind].from_address(c.values[k]).rotation[3] = 0.5
                refuses("ROTATION", f"{parameter} no rotation", prepare)
        elif parameter in ("count", "capacity"):
            for huge in (1 << 62, (1 << 64) - 1):
                refuses("TOO_LARGE", f"{parameter} {huge}", **{parameter: huge})
            if parameter == "capacity" and "window" not in name:
                refuses("CAPACITY", "capacity 0", capacity=0)
        elif parameter == "workspace_size":
            refuses("TOO_LARGE", "workspace_size", workspace_size=(1 << 64) - 1)
            refuses("WORKSPACE", "workspace_size", workspace_size=100)
        elif parameter.endswith("_size") or (parameter == "size" and "window_create" not in name):
            size = ctypes.sizeof(STRUCTS[call.struct_before(k)])
            for wrong in (0, size - 1, size + 1, (1 << 64) - 1):
                refuses("STRUCT_SIZE", f"{parameter} {wrong}", **{parameter: wrong})
        elif parameter in ENUMS and kind == "uint32_t":
            refuses("UNKNOWN_ENUM", parameter, **{parameter: 99})
        elif parameter in ("frame", "a", "b") and "window" in name:
            refuses("STALE_FRAME", parameter)
    return refused


def check_windows(library, suffix):
    """What only a window can be: other memory, another scalar's, full lists."""
    memory = Arena(2)
    make = getattr(library, "epi_window_create" + suffix)
    clear = getattr(library, "epi_window_clear" + suffix)
    other = getattr(library, "epi_window_clear" + {"_f32": "_f64", "_f64": "_f32"}[suffix])
    out = ctypes.c_void_p()
    where = memory.region(0)
    assert clear(where) == status("NOT_A_WINDOW"), "zeros are no window"
    size = getattr(library, "epi_window_size" + suffix)(2, 2, 2, 0)
    assert make(where, size - 1, 2, 2, 2, 0, ctypes.addressof(out)) == status("WORKSPACE")
    assert make(where, size, 1 << 16, 2, 2, 0, ctypes.addressof(out)) == status("TOO_LARGE")
    assert out.value is None
    assert make(where, size, 2, 2, 2, 0, ctypes.addressof(out)) == 0 and out.value == where
    assert clear(where) == 0 and other(where) == status("NOT_A_WINDOW")

    scalar = ctypes.c_float if suffix == "_f32" else ctypes.c_double
    position = (scalar * 3)(1, 2, 3)
    point = ctypes.c_uint32()
    add = getattr(library, "epi_window_add_point" + suffix)
    for expected in (0, 0, status("POINTS_FULL")):
        assert add(where, ctypes.addressof(position), ctypes.addressof(point)) == expected
    points = (ctypes.c_uint32 * 2)()
    names = getattr(library, "epi_window_points" + suffix)
    assert names(where, ctypes.addressof(points), 1) == status("CAPACITY") and not any(points)
    assert names(where, ctypes.addressof(points), 2) == 2
    marginalise = getattr(library, "epi_window_marginalise_point" + suffix)
    assert marginalise(where, points[0], 0, 1) == status("NO_PRIOR_MEMORY")
    # The memory holds no address: the window lives on elsewhere.
    ctypes.memmove(memory.region(1), where, size)
    assert getattr(library, "epi_window_point_count" + suffix)(memory.region(1)) == 2


def main():
    library = load(sys.argv[1])
    assert library.epi_abi_version() == CONSTANTS["EPI_ABI_VERSION"]
    texts = {library.epi_status_string(v) for n, v in CONSTANTS.items() if n.startswith("EPI_STATUS_")}
    assert len(texts) == sum(n.startswith("EPI_STATUS_") for n in CONSTANTS), "a sentence of its own for every status"
    assert library.epi_status_string(-12345) == library.epi_status_string(-54321) == b"unknown status"
    judged = [name for name in FUNCTIONS if name not in NOT_JUDGED]
    failures = []
    refused = 0
    for name in judged:
        try:
            refused += check(library, name)
        except AssertionError as failure:
            failures.append(str(failure))
    for suffix in ("_f32", "_f64"):
        check_windows(library, suffix)
    print("\n".join(failures))
    print(f"{refused} forbidden calls of {len(judged)} functions refused, {len(failures)} functions fail")
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
