# SPDX-License-Identifier: Apache-2.0
"""usage: figures.py FOLDER FIGURES.json [--check]

Measures the cost of reading a position in firmware, for FIGURES.json and the table in docs/firmware.md. With --check it
compares instead; figures may differ by 3 %."""
import json
import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PAGE = os.path.join(ROOT, "docs/firmware.md")
MACHINES = {"m0plus": "mps2-an385", "m4f": "mps2-an386"}
FIGURES = ("text", "rodata", "data", "bss", "stack", "reading", "reply", "character")
TOLERANCE = 0.03
SECTIONS = {"text": (".vectors", ".text"), "rodata": (".rodata", ".ARM.exidx", ".init_array"), "data": (".data",),
            "bss": (".bss",)}


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def sizes(program):
    found = dict(re.findall(r"^(\.\S+)\s+(\d+)", output("arm-none-eabi-size", "-A", program), re.MULTILINE))
    return {figure: sum(int(found.get(section, 0)) for section in sections) for figure, sections in SECTIONS.items()}


def marks(program):
    """Returns the arguments of the plugin. Thumb functions have bit 0 of their address set."""
    symbols = {name: int(address, 16) for address, _, name in
               re.findall(r"^([0-9a-f]+) (\w) (\w+)$", output("arm-none-eabi-nm", program), re.MULTILINE)}
    return f"begin={symbols['count_begin'] & ~1:#x},end={symbols['count_end'] & ~1:#x}"


def run(plugin, program, machine):
    result = subprocess.run(
        ["qemu-system-arm", "-M", machine, "-display", "none", "-monitor", "none", "-serial", "null",
         "-semihosting-config", "enable=on,target=native", "-plugin", f"{plugin},{marks(program)}", "-kernel", program],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=120, text=True, check=False)
    if result.returncode != 0:
        sys.exit(f"{program} read no position: {result.stdout}{result.stderr}")
    counts, replies = ([int(count) for count in re.findall(rf"^count {depth} (\d+)", result.stdout, re.MULTILINE)]
                       for depth in (0, 1))
    # The program's own output goes to standard error.
    stack = int(re.search(r"\d+", result.stderr)[0])
    return {"stack": stack, "reading": counts[0], "reply": replies[-1] if replies else None,
            "character": counts[1] if len(counts) > 1 else None}


def measured(folder):
    readers = sorted(re.findall(r"reader-(\w+)-m0plus\.elf", " ".join(os.listdir(folder))))
    table = {}
    with tempfile.TemporaryDirectory(prefix="absenc-figures-") as temporary:
        plugin = os.path.join(temporary, "count.so")
        output("c++", "-std=c++20", "-O2", "-shared", "-fPIC", "-o", plugin, os.path.join(ROOT, "firmware/count.cpp"))
        for cpu, machine in MACHINES.items():
            every = {}
            for reader in readers:
                program = os.path.join(folder, f"reader-{reader}-{cpu}.elf")
                every[reader] = sizes(program) | run(plugin, program, machine)
            base = every.pop("base")
            # The base program reads nothing between its marks: it counts the instructions of the marks.
            base["character"] = base["reply"] = base["reading"]
            for reader, figures in every.items():
                above = {name: None if figures[name] is None else figures[name] - base[name] for name in FIGURES}
                table.setdefault(reader, {})[cpu] = above
    return {"compiler": output("arm-none-eabi-g++", "--version").splitlines()[0], "figures": table}


def page(table):
    lines = [f"Compiler: `{table['compiler']}`, `-Os`, newlib-nano.", "",
             "| reader | core | text | rodata | data | bss | stack | a reading | a reply | a character |",
             "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|"]
    for reader, cores in table["figures"].items():
        for cpu, figures in cores.items():
            cells = ["" if figures[name] is None else str(figures[name]) for name in FIGURES]
            lines.append(f"| {reader} | {'Cortex-M0+' if cpu == 'm0plus' else 'Cortex-M4F'} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def put_into_page(table):
    with open(PAGE, encoding="utf-8") as file:
        text = file.read()
    front, rest = text.split("<!-- figures -->\n", 1)
    back = rest.split("<!-- end of figures -->", 1)[1]
    with open(PAGE, "w", encoding="utf-8") as file:
        file.write(f"{front}<!-- figures -->\n{page(table)}<!-- end of figures -->{back}")


def differences(wanted, found):
    """Returns the figures that differ beyond the tolerance or are missing on one side, in words."""
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
        return print(page(found))
    with open(path, encoding="utf-8") as file:
        changed = differences(json.load(file), found)
    if changed:
        sys.exit("\n".join(changed) + "\nIf the changes are intended: ./dev firmware --figures")
    return None


if __name__ == "__main__":
    main()
