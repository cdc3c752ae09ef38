"""A library between an importer and an FMU, made from the headers of the standard: it passes every
call on and writes it down with its result, one JSON object in each line, in a file of the folder
LC_STRICT_LOGS that has the name of the library. (A closed process has no other variables than those
of the language.)"""

from __future__ import annotations

import json
import re
import subprocess
import zipfile
from pathlib import Path

import fmpy

HEADERS = Path(fmpy.__file__).parent / "c-code"
# Types of numbers and of pointers as the log writes them.
NUMBERS = re.compile(r"size_t|int|fmi[23](Boolean|Real|Integer|Float64|ValueReference|InterfaceType|Type|StatusKind)")
POINTERS = re.compile(r"void|fmi2Component|fmi3Instance|fmi2FMUstate|fmi3FMUState")

COMMON = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmi%(version)sFunctions.h"

static char log_path[4096];

/* The library beside this one, with the suffix .real. */
static void *find(const char *name) {
    static void *library;
    if (!library) {
        Dl_info self;
        char path[4096];
        dladdr((void *)find, &self);
        snprintf(path, sizeof path, "%%s.real", self.dli_fname);
        const char *folder = getenv("LC_STRICT_LOGS"), *file = strrchr(self.dli_fname, '/');
        if (folder && file) snprintf(log_path, sizeof log_path, "%%s%%s.log", folder, file);
        library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
        if (!library) { fprintf(stderr, "%%s\n", dlerror()); abort(); }
    }
    void *function = dlsym(library, name);
    if (!function) { fprintf(stderr, "%%s\n", dlerror()); abort(); }
    return function;
}

/* A line is written at once, as several processes may share the file. */
static __thread char line[1 << 16];
static __thread size_t length;

static void add(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    size_t room = sizeof line - length;
    int count = vsnprintf(line + length, room, format, arguments);
    length += count < (int)room ? (size_t)count : room - 1;
    va_end(arguments);
}

static void begin(const char *name, const void *instance) {
    length = 0;
    add("{\"call\": \"%%s\", \"instance\": \"%%p\", \"in\": {", name, instance);
}

static void end(int status) {
    add("}, \"status\": %%d}\n", status);
    FILE *log = fopen(log_path, "a");
    if (log) { fwrite(line, 1, length, log); fclose(log); }
}

static void number(const char *name, double value) {
    add("\"%%s\": ", name);
    if (value != value) add("NaN, ");
    else if (value - value != 0.0) add(value > 0.0 ? "Infinity, " : "-Infinity, ");
    else add("%%.17g, ", value);
}

/* Bytes are known again by their checksum. */
static void checksum(const unsigned char *bytes, size_t count) {
    unsigned sum = 2166136261u;
    for (size_t i = 0; i < count; i++) sum = (sum ^ bytes[i]) * 16777619u;
    add("\"bytes\": %%u, ", sum);
}

static void numbers(const char *name, const unsigned *values, size_t count) {
    add("\"%%s\": [", name);
    for (size_t i = 0; i < count; i++) add(i ? ", %%u" : "%%u", values[i]);
    add("], ");
}
"""

EVENT_INFO = [
    "newDiscreteStatesNeeded",
    "terminateSimulation",
    "nominalsOfContinuousStatesChanged",
    "valuesOfContinuousStatesChanged",
    "nextEventTimeDefined",
    "nextEventTime",
]


def functions(version: str) -> list[tuple[str, str, list[tuple[str, str, bool]]]]:
    """Result, name and arguments of all functions that the headers declare. An argument has a type, a
    name, and whether it is an array."""
    text = (HEADERS / f"fmi{version}FunctionTypes.h").read_text(errors="replace")
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    declared = re.findall(r"typedef\s+([\w ]+?\*?)\s*\b(fmi\d\w+)TYPE\s*\((.*?)\)\s*;", text, flags=re.S)
    found = []
    for result, name, listed in declared:
        arguments = []
        for place, text in enumerate(part.strip() for part in listed.split(",")):
            if text in ("void", ""):
                continue
            array = "[" in text
            words = re.findall(r"\w+|\*", text.split("[")[0])
            # Some arguments have no name.
            named = len([word for word in words if word not in ("const", "*")]) > 1
            argument = words.pop() if named else f"argument{place}"
            arguments.append((" ".join(words), argument, array))
        found.append((result, name, arguments))
    return found


def wrapper(result: str, name: str, arguments: list) -> str:
    """The C source of one function."""
    declared = ", ".join(f"{kind} {argument}{'[]' if array else ''}" for kind, argument, array in arguments) or "void"
    passed = ", ".join(argument for _, argument, _ in arguments)
    lines = [f"{result} {name}({declared}) {{", f'    {name}TYPE *real = ({name}TYPE *)find("{name}");']
    first = arguments[0][1] if arguments and POINTERS.fullmatch(arguments[0][0]) else "NULL"
    lines.append(f'    begin("{name}", {first});')
    after = []
    previous = None
    for kind, argument, array in arguments:
        plain = kind.replace("const", "").strip()
        if NUMBERS.fullmatch(plain) and not array:
            lines.append(f'    number("{argument}", (double){argument});')
            if previous and previous[0].endswith("ValueReference"):
                lines.append(f'    numbers("{previous[1]}", (const unsigned *){previous[1]}, {argument});')
            elif previous and previous[0].endswith("Byte"):
                (lines if "const" in previous[0] else after).append(f"    checksum((const unsigned char *){previous[1]}, {argument});")
        elif POINTERS.fullmatch(plain) and not array and argument != first:
            lines.append(f'    add("\\"{argument}\\": \\"%p\\", ", (void *){argument});')
        elif plain.endswith(" *") and NUMBERS.fullmatch(plain[:-2]):
            after.append(f'    if ({argument}) number("{argument}", (double)*{argument});')
        elif plain.endswith(" *") and POINTERS.fullmatch(plain[:-2]):
            lines.append(f'    add("\\"{argument}\\": \\"%p\\", ", {argument} ? (void *)*{argument} : NULL);')
            after.append(f'    if ({argument}) add("\\"{argument}\\": \\"%p\\", ", (void *)*{argument});')
        elif plain == "fmi2EventInfo *":
            after += [f'    number("{field}", (double){argument}->{field});' for field in EVENT_INFO]
        previous = (kind, argument) if array else None
    lines.append('    add("\\"\\": 0}, \\"out\\": {");')
    call = f"real({passed})"
    if result == "void":
        lines += [f"    {call};", '    add("\\"\\": 0");', f'    end(0);', "}"]
        return "\n".join(lines)
    lines.append(f"    {result} answer = {call};")
    lines += after
    if result.endswith("Status"):
        lines += ['    add("\\"\\": 0");', f'    end((int)answer);']
    else:
        lines += ['    add("\\"answer\\": \\"%p\\"", (void *)answer);', f'    end(0);']
    return "\n".join([*lines, "    return answer;", "}"])


def build(version: str, folder: Path) -> Path:
    """Compiles the library for a version of FMI."""
    source = folder / f"strict{version}.c"
    exported = [wrapper(*function) for function in functions(version)]
    source.write_text(COMMON % {"version": version} + "\n\n".join(exported) + "\n")
    library = folder / f"strict{version}.so"
    command = ["cc", "-O1", "-shared", "-fPIC", "-Wall", "-Werror", "-Wno-unused-function", "-I", HEADERS]
    subprocess.run([*command, source, "-o", library, "-ldl"], check=True)
    return library


def interpose(archive: Path, library: Path, target: Path) -> Path:
    """Writes an archive whose library for Linux is behind the one that writes calls down."""
    with zipfile.ZipFile(archive) as packed, zipfile.ZipFile(target, "w") as file:
        for name in packed.namelist():
            content = packed.read(name)
            if re.fullmatch(r"binaries/(linux64|x86_64-linux)/[^/]+\.so", name):
                file.writestr(f"{name}.real", content)
                content = library.read_bytes()
            file.writestr(name, content)
    return target


def read(log: Path) -> list[dict]:
    """Reads the calls."""
    return [json.loads(line) for line in log.read_text().splitlines()]
