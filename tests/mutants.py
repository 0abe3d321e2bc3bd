#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Breaks the units in one place at a time and checks whether a test fails.

tests/mutant_rules.py finds the places. tests/mutants_survivors.txt lists mutants that may survive, with a reason."""

import argparse
import fcntl
import os
import queue
import random
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import mutant_rules

ROOT = Path(__file__).resolve().parent.parent
COPIED = ("CMakeLists.txt", "VERSION", "absenc", "cmake", "tests")
NO_SOURCE = re.compile(r"_(test|fuzz|bench)\.|^(test_|testing|vectors|fields|explain|texts)")
# Matches compiler errors that come from checks at compile time, such as a static_assert.
STATIC_CHECK = re.compile(r"static.assert|constant.expression|non-constant|non-.constexpr|duplicate case value")
# GoogleTest filter that leaves out all but the first series of faults of tests/kit, used for mutants that are switched
# at run time.
FIRST_SERIES = "-" + ":".join(f"*/{series}_*" for series in range(1, 10))
HANGS = (-signal.SIGXCPU, -signal.SIGKILL)
SWITCH_HEADER = Path("absenc/chosen_mutant.hpp")
SWITCH = """#pragma once
#include <cstdlib>
#include <type_traits>

inline const int the_chosen_mutant = std::getenv("CHOSEN_MUTANT") ? std::atoi(std::getenv("CHOSEN_MUTANT")) : 0;
constexpr bool chosen_mutant(int number) { return !std::is_constant_evaluated() && the_chosen_mutant == number; }
"""
OUTCOMES = ("static_assert", "kit", "own", "time", "known", "new", "no C++")


class Program(NamedTuple):
    name: str
    is_own: bool
    tests: str = "*"  # GoogleTest filter that selects the tests to run


def unit_folders():
    """Returns a dictionary from name to folder: units, author and host."""
    protocol = ROOT / "absenc" / "protocol"
    folders = {folder.name: folder for folder in sorted(protocol.iterdir()) if folder.is_dir()}
    return folders | {"host": ROOT / "absenc" / "host"}


def generic_programs():
    """Returns the names of the programs that test every unit (cmake/tests.cmake)."""
    tests = ROOT / "tests"
    names = []
    for path in [*sorted(tests.glob("*_test.cpp")), *sorted(tests.glob("*/*_test.cpp"))]:
        if "INSTANTIATE_TEST_SUITE_P" in path.read_text(encoding="utf-8"):
            names.append(path.stem if path.parent == tests else f"{path.parent.name}_test")
    return list(dict.fromkeys(names))


def id_of(path):
    """Returns the first part of the ids of the mutants of the source at `path`."""
    below = path.relative_to(ROOT / "absenc")
    return str(below.relative_to("protocol") if below.parts[0] == "protocol" else below)


def find_mutants(folder):
    """Yields (mutant, path of its source, text of the source) for each mutant in the folder."""
    for path in sorted([*folder.rglob("*.cpp"), *folder.rglob("*.hpp")]):
        if not NO_SOURCE.search(path.name):
            text = path.read_text(encoding="utf-8")
            for mutant in mutant_rules.find(id_of(path), text):
                yield mutant, path, text


def shown(mutant, path, text):
    """Returns the place of a mutant, and its lines before and after the change, as a text."""
    last = text.count("\n", 0, mutant.end) + 1
    changed = mutant.applied_to(text).splitlines()
    end = last + len(changed) - len(text.splitlines())
    lines = [f"{path.relative_to(ROOT)}:{mutant.line}  {mutant.id}"]
    lines += [f"  - {line.strip()}" for line in text.splitlines()[mutant.line - 1 : last]]
    lines += [f"  + {line.strip()}" for line in changed[mutant.line - 1 : end]]
    return "\n".join(lines)


def read_survivors(path):
    """Returns a dictionary from the id of each mutant that may survive to the reason why."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    known = [line.split(maxsplit=1) for line in lines if line.strip() and not line.startswith("#")]
    bare = [words[0] for words in known if len(words) < 2]
    if bare:
        sys.exit(f"mutants: {path.name} gives no reason for {', '.join(bare)}")
    return dict(known)


class Tree:
    """A copy of the sources and its build folder, used by one thread."""

    def __init__(self, folder):
        self.source = folder / "source"
        self.build = folder / "tree"
        self.limits = {}
        self.last_own = None
        self.lock = None
        self.switched = {}
        self.environment = {**os.environ, "CCACHE_BASEDIR": str(folder), "GTEST_FAIL_FAST": "1", "GTEST_BRIEF": "1"}

    def prepare(self):
        self.source.mkdir(parents=True, exist_ok=True)
        # A lock file next to this copy of the sources, locked until this process ends.
        self.lock = open(self.source.parent / "lock", "w", encoding="utf-8")
        try:
            fcntl.flock(self.lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise SystemExit(f"mutants: somebody else works in {self.source.parent}") from None
        wanted = set()
        for name in COPIED:
            for path in sorted((ROOT / name).rglob("*")) if (ROOT / name).is_dir() else [ROOT / name]:
                if path.is_file() and "__pycache__" not in path.parts:
                    wanted.add(path.relative_to(ROOT))
        for path in wanted:
            self.write(self.source / path, (ROOT / path).read_bytes())
        for path in self.source.rglob("*"):
            if path.is_file() and path.relative_to(self.source) not in wanted:
                path.unlink()
        # _GLIBCXX_ASSERTIONS detects reads beyond the end of a container.
        options = ["-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -w -D_GLIBCXX_ASSERTIONS"]
        options += ["-DABSENC_TESTS=ON", "-DABSENC_SPLIT_TESTS=ON", "-DABSENC_COMMAND=OFF", "-DABSENC_INSTALL=OFF"]
        options += ["-DABSENC_UNITY=OFF"]
        if shutil.which("ccache"):
            options.append("-DCMAKE_CXX_COMPILER_LAUNCHER=ccache")
        self.run_or_exit(["cmake", "-G", "Ninja", "-S", self.source, "-B", self.build, *options])

    @staticmethod
    def write(path, content):
        """Writes the file only if its content differs, so that only changed files are compiled again."""
        if not path.exists() or path.read_bytes() != content:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)

    def run_or_exit(self, command):
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            shown_command = " ".join(map(str, command))
            raise SystemExit(f"mutants: without any mutant this fails: {shown_command}\n{done.stdout}{done.stderr}")
        return done.stdout

    def build_command(self, *targets):
        return ["cmake", "--build", self.build, "-j", "1", "--target", *targets]

    def compile(self, target):
        """Compiles a target. Returns the compiler's output if it failed, otherwise None."""
        command = self.build_command(target)
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, check=False)
        return None if done.returncode == 0 else done.stdout + done.stderr

    def switch_in(self, numbered):
        """Writes sources with switched mutants. Removes from `numbered` those of constants that cannot be functions."""
        self.write(self.source / SWITCH_HEADER, SWITCH.encode())
        functions = self.constants_as_functions(numbered)
        for number, (mutant, path, _) in list(numbered.items()):
            if mutant.constant and mutant.constant not in functions.get(path, ()):
                del numbered[number]
        self.switched = {path: path.read_text(encoding="utf-8") for path in functions}
        self.switched.update({path: text for _, path, text in numbered.values()})
        for path in self.switched:
            here = [(number, mutant) for number, (mutant, of, _) in numbered.items() if of == path]
            switched = mutant_rules.with_switches(self.switched[path], here)
            switched = mutant_rules.as_functions(switched, functions.get(path, set()))
            self.write(self.source / path.relative_to(ROOT), f'#include "{SWITCH_HEADER}"\n#line 1\n{switched}'.encode())

    @staticmethod
    def constants_as_functions(numbered):
        """Returns, for each source, the constants that can become functions."""
        functions = {}
        for path, name in {(path, mutant.constant) for mutant, path, _ in numbered.values() if mutant.constant}:
            # Constants of absenc/protocol/author may be used in every unit, so users of such a constant are searched in
            # all folders of absenc/protocol.
            folder = path.parent.parent if path.parent.name == "author" else path.parent
            users = [*folder.rglob("*.hpp"), *folder.rglob("*.cpp")] if path.suffix == ".hpp" else [path]
            users = [user for user in users if re.search(rf"\b{name}\b", user.read_text(encoding="utf-8"))]
            if all(mutant_rules.as_functions(user.read_text(encoding="utf-8"), {name}) is not None for user in users):
                for user in users:
                    functions.setdefault(user, set()).add(name)
        return functions

    def restore_switched(self):
        for path, text in self.switched.items():
            self.write(self.source / path.relative_to(ROOT), text.encode())

    def restore(self, mutants):
        for path, text in {path: text for _, path, text in mutants}.items():
            self.write(self.source / path.relative_to(ROOT), text.encode())

    def run(self, program, cpu_limit, number=0):
        """Runs a program. Returns its exit status and its processor time in seconds."""
        limits = ["prlimit", f"--cpu={cpu_limit}:{cpu_limit + 1}", f"--as={4 << 30}", "--core=0"]
        tests = program.tests + (FIRST_SERIES if number else "")
        environment = {**self.environment, "GTEST_FILTER": tests, "CHOSEN_MUTANT": str(number)}
        running = subprocess.Popen(
            [*limits, self.build / "tests" / program.name],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        # Kills a program that waits for an event that never occurs and so uses no processor time.
        too_long = threading.Timer(10 * cpu_limit, running.kill)
        too_long.start()
        _, status, usage = os.wait4(running.pid, 0)
        too_long.cancel()
        running.returncode = os.waitstatus_to_exitcode(status)
        return running.returncode, usage.ru_utime + usage.ru_stime

    def concerning(self, program, unit):
        """Returns a generic program with a filter for tests that concern the unit, or None."""
        listed = self.run_or_exit([self.build / "tests" / program.name, "--gtest_list_tests"])
        suite, chosen, is_named = "", [], False
        for line in listed.splitlines():
            if line[:1] != " ":
                suite = line.split(" ")[0]
                continue
            name = suite + line.split("#")[0].strip()
            if re.search(rf"(?<![a-z0-9]){unit}", line.lower()):
                is_named = True
                chosen.append(name)
            elif "/" not in name:
                chosen.append(name)
        return program._replace(tests=":".join(chosen)) if is_named else None

    def programs(self, unit, folders):
        """Builds the programs that may kill a unit's mutants, and returns them, the fastest first."""
        kit = [Program(name, False) for name in generic_programs()]
        owners = list(folders) if unit == "author" else [unit]
        seeds = [f"{p.stem}_seeds" for owner in owners for p in sorted(folders[owner].rglob("*_fuzz.cpp"))]
        own = [
            "_".join((owner, *path.relative_to(folders[owner]).with_suffix("").parts))
            for owner in owners
            for path in sorted(folders[owner].rglob("*_test.cpp"))
        ]
        self.run_or_exit(self.build_command(*(program.name for program in kit), *seeds, *own))
        if unit not in ("author", "host"):
            kit = [chosen for program in kit if (chosen := self.concerning(program, unit))]
        programs = kit + [Program(name, False) for name in seeds] + [Program(name, True) for name in own]
        for program in programs:
            status, seconds = self.run(program, 600)
            if status != 0:
                raise SystemExit(f"mutants: without any mutant {program.name} fails with {program.tests}")
            self.limits[program] = int(5 * seconds) + 5
        return sorted(programs, key=lambda program: (self.limits[program], program.is_own))

    def killed(self, program, number=0):
        """Returns how the program fails ("time", "own" or "kit"), or an empty text if it passes."""
        status, _ = self.run(program, self.limits[program], number)
        return "" if status == 0 else "time" if status in HANGS else "own" if program.is_own else "kit"

    def switched_outcome(self, number, programs):
        """Returns the outcome of a switched mutant and the program that killed it, if any."""
        for program in programs:
            if outcome := self.killed(program, number):
                return outcome, program.name
        return "survived", ""

    def outcome(self, mutant, path, text, programs):
        """Returns the outcome of a mutant that is compiled alone, and what killed it."""
        self.write(self.source / path.relative_to(ROOT), mutant.applied_to(text).encode())
        # The object of unit.cpp is built first, because it checks the unit's test vectors at compile time.
        unit = path.relative_to(ROOT).with_name("unit.cpp")
        library = "absenc-" + unit.relative_to("absenc/protocol").parts[0] if (ROOT / unit).exists() else ""
        first = [f"CMakeFiles/{library}.dir/{unit}.o"] if library else []
        programs = sorted(programs, key=lambda program: program != self.last_own)
        for program in programs:
            for target in [*first, program.name]:
                refused = self.compile(target)
                if refused is not None:
                    return ("static_assert" if STATIC_CHECK.search(refused) else "no C++"), target.rpartition("/")[2]
            first = []
            if outcome := self.killed(program):
                if program.is_own:
                    # A program that has killed a mutant often kills the next ones, too, so it runs first from now on.
                    self.last_own = program
                return outcome, program.name
        return "survived", ""


class Campaign:
    """A run over the chosen mutants, with one thread for each tree."""

    def __init__(self, known, folders, verbose, quick):
        self.known = known
        self.folders = folders
        self.verbose = verbose
        self.quick = quick
        self.counts = {}
        self.revived = []
        self.work = queue.Queue()
        self.lock = threading.Lock()
        self.stopping = False
        self.failure = None

    def add(self, unit, mutants):
        self.work.put((unit, mutants))
        self.counts[unit] = Counter()

    def run(self, trees):
        threads = [threading.Thread(target=self.serve, args=(tree,), daemon=True) for tree in trees]
        for thread in threads:
            thread.start()
        try:
            for thread in threads:
                thread.join()
        except KeyboardInterrupt:
            self.stopping = True
            print("interrupted: what is being built ends first", flush=True)
            for thread in threads:
                thread.join()
        if self.failure:
            raise self.failure

    def serve(self, tree):
        try:
            tree.prepare()
            while not self.stopping:
                unit, mutants = self.work.get_nowait()
                left = self.switch(tree, unit, mutants)
                if not self.quick:
                    self.compile_alone(tree, unit, left)
        except queue.Empty:
            pass
        except (SystemExit, OSError) as failure:
            self.failure = None if self.stopping else failure
            self.stopping = True

    def switch(self, tree, unit, mutants):
        """Runs the tests with switched mutants. Returns the mutants that are to be compiled alone."""
        numbered = dict(enumerate([one for one in mutants if one[0].switch], start=1))
        left = []
        if numbered:
            programs = self.switched_programs(tree, unit, numbered)
            for number, one in numbered.items():
                began = time.monotonic()
                result = tree.switched_outcome(number, programs)
                if self.stopping:
                    break
                if result[0] == "survived":
                    left.append(one)
                else:
                    self.note(unit, one, result, time.monotonic() - began)
            tree.restore_switched()
        left += [one for one in mutants if one not in numbered.values()]
        left.sort(key=lambda one: (one[1], one[0].start))
        for mutant, _, _ in left if self.verbose else ():
            print(f"left to be compiled alone: {mutant.id}", flush=True)
        return left

    def switched_programs(self, tree, unit, numbered):
        """Builds the test programs with switched mutants, if need be without those of constants."""
        try:
            tree.switch_in(numbered)
            return self.programs(tree, unit)
        except SystemExit as refused:
            print(f"{unit}: its constants are compiled alone: {refused}", flush=True)
        tree.restore_switched()
        for number in [number for number, one in numbered.items() if one[0].constant]:
            del numbered[number]
        tree.switch_in(numbered)
        return self.programs(tree, unit)

    def compile_alone(self, tree, unit, mutants):
        if not mutants or self.stopping:
            return
        programs = self.programs(tree, unit)
        for one in mutants:
            began = time.monotonic()
            result = tree.outcome(*one, programs)
            tree.restore([one])
            if self.stopping:
                break
            self.note(unit, one, result, time.monotonic() - began)

    def programs(self, tree, unit):
        programs = tree.programs(unit, self.folders)
        names = ", ".join(program.name for program in programs)
        print(f"{unit}, which passes without a mutant: {names}", flush=True)
        return programs

    def note(self, unit, one, result, seconds):
        outcome, program = result
        mutant = one[0]
        with self.lock:
            if outcome == "survived":
                outcome = "known" if mutant.id in self.known else "new"
            elif mutant.id in self.known:
                self.revived.append(mutant.id)
            self.counts[unit][outcome] += 1
            if self.verbose:
                print(f"[{seconds:5.1f} s] {outcome:13} {program:20} {mutant.id}", flush=True)
            if outcome in ("new", "no C++"):
                print(f"{'survived' if outcome == 'new' else outcome}: {shown(*one)}", flush=True)


def print_table(counts):
    print(f"{'':12}{'mutants':>9}" + "".join(f"{name:>15}" for name in OUTCOMES))
    for unit, count in [*counts.items(), ("all", sum(counts.values(), Counter()))]:
        print(f"{unit:12}{count.total():9}" + "".join(f"{count[name]:15}" for name in OUTCOMES))


def choose(found, arguments):
    chosen = {}
    for unit, mutants in found.items():
        wanted = [
            one
            for one in mutants
            if (not arguments.units or unit in arguments.units)
            and (not arguments.rule or one[0].rule in arguments.rule)
            and (not arguments.file or str(one[1]).endswith(arguments.file))
            and (one[0].id in arguments.ids if arguments.ids else arguments.fine or one[0].rule in mutant_rules.COARSE or arguments.rule)
        ]
        if wanted:
            chosen[unit] = wanted
    if arguments.sample:
        everything = [(unit, one) for unit, mutants in chosen.items() for one in mutants]
        picked = random.Random(arguments.seed).sample(everything, min(arguments.sample, len(everything)))
        picked = {one[0].id for _, one in picked}
        chosen = {unit: [one for one in mutants if one[0].id in picked] for unit, mutants in chosen.items()}
        chosen = {unit: mutants for unit, mutants in chosen.items() if mutants}
    return chosen


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0], prog="./dev mutants")
    parser.add_argument("chosen", nargs="*", metavar="folder|id",
                        help="only those in a folder of absenc/protocol or in host, or only the mutant with an id")
    parser.add_argument("--file", help="only those of this source: the end of its path")
    parser.add_argument("--rule", action="append", help="only those of this rule: never, half ...; may be given again")
    parser.add_argument("--fine", action="store_true", help="also terms, edges and constants (tests/mutant_rules.py)")
    parser.add_argument("--quick", action="store_true", help="compile none alone: show which are left")
    parser.add_argument("--sample", type=int, metavar="N", help="so many of them, at random")
    parser.add_argument("--seed", type=int, default=1, help="of the sample (%(default)s)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="at a time, each in a tree (%(default)s)")
    parser.add_argument("--list", action="store_true", help="show them, run nothing")
    parser.add_argument("--verbose", action="store_true", help="a line for each")
    arguments = parser.parse_args()
    arguments.ids = [one for one in arguments.chosen if ":" in one]
    arguments.units = [one for one in arguments.chosen if ":" not in one]
    return arguments


def main():
    arguments = parse()
    folders = unit_folders()
    for unit in arguments.units:
        if unit not in folders:
            sys.exit(f"mutants: no unit {unit}: there are {', '.join(folders)}")
    found = {unit: list(find_mutants(folder)) for unit, folder in folders.items()}
    chosen = choose(found, arguments)
    if not chosen:
        sys.exit("mutants: there is no such mutant")
    if arguments.list:
        for mutants in chosen.values():
            for mutant, path, text in mutants:
                print(shown(mutant, path, text))
        for unit, mutants in chosen.items():
            print(f"{unit:12}{len(mutants):6}")
        print(f"{'all':12}{sum(map(len, chosen.values())):6}")
        return 0
    known = read_survivors(ROOT / "tests" / "mutants_survivors.txt")
    stale = sorted(set(known) - {mutant.id for mutants in found.values() for mutant, _, _ in mutants})
    campaign = Campaign(known, folders, arguments.verbose or arguments.quick, arguments.quick)
    for unit, mutants in chosen.items():
        campaign.add(unit, mutants)
    jobs = max(1, min(arguments.jobs, campaign.work.qsize()))
    print(f"{sum(map(len, chosen.values()))} mutants; building in build/mutants, at first for minutes", flush=True)
    campaign.run([Tree(ROOT / "build" / "mutants" / str(number)) for number in range(jobs)])
    print_table(campaign.counts)
    for name in campaign.revived:
        print(f"mutants_survivors.txt lists what is killed now: {name}")
    for name in stale:
        print(f"mutants_survivors.txt lists what is not found any more: {name}")
    survived = sum(count["new"] for count in campaign.counts.values())
    return 130 if campaign.stopping else int(survived > 0 or bool(stale))


if __name__ == "__main__":
    sys.exit(main())
