# SPDX-License-Identifier: Apache-2.0
"""usage: figures.py FOLDER FIGURES.json [--check]

Measures the cost of reading a position in firmware, and the greatest cost of each call of the readers over many inputs,
for FIGURES.json and the tables in docs/firmware.md. With --check it compares instead; figures may differ by 3 %."""
import json
import os
import re
import subprocess
import sys
import tempfile

import call_graph

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PAGE = os.path.join(ROOT, "docs/firmware.md")
MACHINES = {"m0plus": "mps2-an385", "m4f": "mps2-an386"}
MEGAHERTZ = {"m0plus": 48, "m4f": 168}
CORES = {"m0plus": "Cortex-M0+", "m4f": "Cortex-M4F"}
COSTS = ("text", "rodata", "data", "bss", "stack", "reading", "reply", "character")
BOUNDS = ("feed", "next", "result", "cycles", "call_stack")
FIGURES = COSTS + BOUNDS
TOLERANCE = 0.03
SECTIONS = {"text": (".vectors", ".text"), "rodata": (".rodata", ".ARM.exidx", ".init_array"), "data": (".data",),
            "bss": (".bss",)}


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def sizes(program):
    found = dict(re.findall(r"^(\.\S+)\s+(\d+)", output("arm-none-eabi-size", "-A", program), re.MULTILINE))
    return {figure: sum(int(found.get(section, 0)) for section in sections) for figure, sections in SECTIONS.items()}


def build_plugin(folder):
    """Compiles the plugin that counts. Returns its path."""
    plugin = os.path.join(folder, "count.so")
    output("c++", "-std=c++20", "-O2", "-shared", "-fPIC", "-o", plugin, os.path.join(ROOT, "firmware/count.cpp"))
    return plugin


def marks(program, names):
    """Returns the arguments of the plugin. Thumb functions have bit 0 of their address set."""
    symbols = {name: int(address, 16) for address, _, name in
               re.findall(r"^([0-9a-f]+) (\w) (\w+)$", output("arm-none-eabi-nm", program), re.MULTILINE)}
    return ",".join(f"{name}_{side}={symbols[f'{name}_{side}'] & ~1:#x}" for name in names for side in ("begin", "end"))


def run(plugin, program, cpu, *names):
    """Runs a program to its end. Returns what the plugin printed of the marks `names`, and the number that the program
    printed."""
    result = subprocess.run(
        ["qemu-system-arm", "-M", MACHINES[cpu], "-display", "none", "-monitor", "none", "-serial", "null",
         "-semihosting-config", "enable=on,target=native", "-plugin",
         f"{plugin},core={cpu},{marks(program, names)}", "-kernel", program],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=300, text=True, check=False)
    if result.returncode != 0:
        sys.exit(f"{program} read no position: {result.stdout}{result.stderr}")
    # the emulated program prints its number on standard error, the plugin prints its counts on standard output
    return result.stdout, int(re.search(r"\d+", result.stderr)[0])


def costs(plugin, program, cpu):
    """Returns the costs of one reading."""
    printed, stack = run(plugin, program, cpu, "count")
    counts, replies = ([int(count) for count in re.findall(rf"^count {depth} (\d+)", printed, re.MULTILINE)]
                       for depth in (0, 1))
    return {"stack": stack, "reading": counts[0], "reply": replies[-1] if replies else None,
            "character": counts[1] if len(counts) > 1 else None}


def graph_of(program, printed):
    """Returns the graph of calls, with the indirect calls that the plugin printed."""
    calls = re.findall(r"^call (\w+) (\w+)", printed, re.MULTILINE)
    return call_graph.Graph(program, [(int(site, 16), int(target, 16)) for site, target in calls])


def bounds(plugin, program, cpu, empty):
    """Returns the greatest costs of a call, the number of inputs, and the graph of calls. `empty`: number of
    instructions between two marks with nothing in between."""
    printed, inputs = run(plugin, program, cpu, "feed", "next", "result")
    greatest = {name: (int(instructions) - empty, int(cycles)) for name, instructions, cycles in
                re.findall(r"^(feed|next|result) (\d+) (\d+)", printed, re.MULTILINE)}
    graph = graph_of(program, printed)
    try:
        stack = max(graph.depth(function) for function in graph.find(r"7CountedI.*E4(feed|next|make)"))
    except call_graph.Recursion:
        stack = None
    return ({name: greatest[name][0] for name in ("feed", "next", "result")} |
            {"cycles": greatest["result"][1], "call_stack": stack}), inputs, graph


def readable(graph):
    """Returns the targets of the indirect calls of each function, with the names of C++."""
    targets = {caller: sorted(found) for caller, found in graph.indirect.items()}
    names = sorted(set(targets).union(*targets.values()))
    if not names:
        return {}
    name_of = dict(zip(names, output("c++filt", *names).splitlines()))
    return {name_of[caller]: [name_of[one] for one in found] + (["(no input)"] if caller in graph.never_called else [])
            for caller, found in sorted(targets.items())}


def measured(folder):
    readers = sorted(re.findall(r"reader-(\w+)-m0plus\.elf", " ".join(os.listdir(folder))))
    readers.remove("base")
    table, inputs, indirect_calls = {}, {}, {}
    with tempfile.TemporaryDirectory(prefix="absenc-figures-") as temporary:
        plugin = build_plugin(temporary)
        for cpu in MACHINES:
            def program(kind, reader):
                return os.path.join(folder, f"{kind}-{reader}-{cpu}.elf")

            base = sizes(program("reader", "base")) | costs(plugin, program("reader", "base"), cpu)
            # The base program reads nothing between its marks, so its counts are those of the marks alone.
            base["character"] = base["reply"] = base["reading"]
            for reader in readers:
                figures = sizes(program("reader", reader)) | costs(plugin, program("reader", reader), cpu)
                above = {name: None if figures[name] is None else figures[name] - base[name] for name in COSTS}
                greatest, inputs[reader], graph = bounds(plugin, program("bounds", reader), cpu, base["reading"])
                table.setdefault(reader, {})[cpu] = above | greatest
                indirect_calls.setdefault(reader, {})[cpu] = readable(graph)
    return {"compiler": output("arm-none-eabi-g++", "--version").splitlines()[0], "figures": table, "inputs": inputs,
            "indirect_calls": indirect_calls}


def rows(table, cells):
    """Returns the rows of a table with the values that `cells` returns; None: an empty cell."""
    lines = []
    for reader, cores in table["figures"].items():
        for cpu, figures in cores.items():
            texts = ["" if cell is None else str(cell) for cell in cells(reader, cpu, figures)]
            lines.append(f"| {reader} | {CORES[cpu]} | {' | '.join(texts)} |")
    return lines


def costs_table(table):
    lines = [f"Compiler: `{table['compiler']}`, `-Os`, newlib-nano.", "",
             "| reader | core | text | rodata | data | bss | stack | a reading | a reply | a character |",
             "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|"]
    return lines + rows(table, lambda reader, cpu, figures: [figures[name] for name in COSTS])


def bounds_table(table):
    def cells(reader, cpu, figures):
        stack = figures["call_stack"]
        ram = None if stack is None else figures["data"] + figures["bss"] + stack
        return [table["inputs"][reader], figures["feed"], figures["next"], stack, ram, figures["result"],
                figures["cycles"], f"{figures['cycles'] / MEGAHERTZ[cpu]:.1f}"]

    return ["| reader | core | inputs | `feed` | `next` | stack | RAM | to the result | cycles | us |",
            "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|"] + rows(table, cells)


def put_into_page(table):
    with open(PAGE, encoding="utf-8") as file:
        text = file.read()
    for mark, lines in (("figures", costs_table(table)), ("bounds", bounds_table(table))):
        front, rest = text.split(f"<!-- {mark} -->\n", 1)
        back = rest.split(f"<!-- end of {mark} -->", 1)[1]
        text = "\n".join([f"{front}<!-- {mark} -->", *lines, f"<!-- end of {mark} -->{back}"])
    with open(PAGE, "w", encoding="utf-8") as file:
        file.write(text)


def differences(wanted, found):
    """Returns the figures that differ beyond the tolerance or are missing on one side, in words; with another compiler
    only that."""
    if wanted["compiler"] != found["compiler"]:
        return [f"the table is from {wanted['compiler']}, but this compiler is {found['compiler']}: run ./dev firmware --figures"]
    found_differences = []
    for reader in sorted(wanted["figures"].keys() | found["figures"].keys()):
        for cpu in MACHINES:
            for name in FIGURES:
                before = wanted["figures"].get(reader, {}).get(cpu, {}).get(name)
                now = found["figures"].get(reader, {}).get(cpu, {}).get(name)
                same = before == now or (None not in (before, now) and abs(now - before) <= TOLERANCE * before)
                if not same:
                    found_differences.append(f"{reader} {cpu} {name}: {now}, in the table {before}")
    return found_differences


def main():
    folder, path = sys.argv[1:3]
    found = measured(folder)
    if "--check" not in sys.argv:
        with open(path, "w", encoding="utf-8") as file:
            json.dump(found, file, indent=1)
            file.write("\n")
        put_into_page(found)
        return print("\n".join([*costs_table(found), "", *bounds_table(found)]))
    with open(path, encoding="utf-8") as file:
        changed = differences(json.load(file), found)
    if changed:
        sys.exit("\n".join(changed) + "\nIf the changes are intended: ./dev firmware --figures")
    return None


if __name__ == "__main__":
    main()
