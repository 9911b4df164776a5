"""The header as ctypes sees it: structs, prototypes, enumerations. Nothing but the standard library."""

import ctypes
import re
from pathlib import Path

HEADER = Path(__file__).resolve().parent.parent / "include" / "epipole.h"
SCALARS = {
    "float": ctypes.c_float,
    "double": ctypes.c_double,
    "int32_t": ctypes.c_int32,
    "uint32_t": ctypes.c_uint32,
    "uint64_t": ctypes.c_uint64,
    "uint8_t": ctypes.c_uint8,
    "size_t": ctypes.c_size_t,
    "epi_keep_going": ctypes.c_void_p,
}


def _text():
    text = HEADER.read_text()
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.S)
    return re.sub(r"\\\n", " ", text)


def _structs(text):
    found = dict(SCALARS)
    for body, name in re.findall(r"typedef struct \w+ \{(.*?)\} (\w+);", text, flags=re.S):
        fields = []
        for declaration in filter(None, (part.strip() for part in body.split(";"))):
            kind, field, sizes = re.fullmatch(r"(?:struct )?(\w+) (\w+)((?:\[\d+\])*)", declaration).groups()
            kind = found[kind]
            for size in reversed(re.findall(r"\d+", sizes)):
                kind = kind * int(size)
            fields.append((field, kind))
        found[name] = type(name, (ctypes.Structure,), {"_fields_": fields})
    return found


def _functions(text):
    """name -> (result, [(type, stars, const, parameter)])"""
    found = {}
    for result, stars, name, parameters in re.findall(r"^(?:const )?(\w+) (\**)(epi_\w+)\(([^;{]*)\);", text, flags=re.M):
        arguments = []
        for parameter in parameters.split(","):
            if parameter.strip() == "void":
                continue
            const, kind, levels, argument = re.fullmatch(
                r"\s*(const )?(?:struct )?(\w+) (\**)(\w+)\s*", parameter
            ).groups()
            arguments.append((kind, len(levels), bool(const), argument))
        found[name] = (result + stars, arguments)
    return found


def _constants(text):
    found = {name: int(value) for name, value in re.findall(r"^#define (EPI_\w+) (\d+)$", text, flags=re.M)}
    found.update((name, int(value)) for name, value in re.findall(r"^\s*(EPI_\w+) = (-?\d+),", text, flags=re.M))
    return found


_TEXT = _text()
STRUCTS = _structs(_TEXT)
FUNCTIONS = _functions(_TEXT)
CONSTANTS = _constants(_TEXT)


def load(path):
    """The library, its functions with the types of the header; pointers are addresses."""
    library = ctypes.CDLL(str(path))
    for name, (result, arguments) in FUNCTIONS.items():
        function = getattr(library, name)
        function.restype = ctypes.c_char_p if "*" in result else SCALARS[result]
        function.argtypes = [ctypes.c_void_p if stars else SCALARS[kind] for kind, stars, _, _ in arguments]
    return library
