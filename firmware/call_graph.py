# SPDX-License-Identifier: Apache-2.0
"""The call graph of a program for Cortex-M, and the deepest stack of a function, from its machine code."""
import re
import subprocess

FUNCTION = re.compile(r"^([0-9a-f]+) <(.+)>:$")
INSTRUCTION = re.compile(r"^ *([0-9a-f]+):\t[0-9a-f ]+\t(\S+)(?:\t([^;@]*)(.*))?$")
TARGET = re.compile(r"(?:^|\s)([0-9a-f]+) <[^>]+>")
CONDITIONS = "eq|ne|cs|cc|hs|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le"


class Unknown(Exception):
    """Machine code whose change of the stack is not understood."""


class Recursion(Exception):
    """A function that calls itself, so that the machine code alone does not limit the stack."""


def size_of_list(registers):
    """Returns the bytes of a register list such as {r4, r5-r7, lr} or {d8-d9}."""
    count = 0
    for part in re.search(r"{(.*)}", registers)[1].split(","):
        first, _, last = part.strip().partition("-")
        count += int(last[1:]) - int(first[1:]) + 1 if last else 1
    return count * (8 if re.search(r"{d", registers) else 4)


class Function:
    def __init__(self, name, address):
        self.name, self.address = name, address
        self.code = []  # instructions of the function: address, mnemonic, operands and comment, as objdump prints them
        self.words = {}  # constants that the compiler has placed between the instructions

    def frame_change(self, index):
        """Returns by how many bytes the instruction makes the stack deeper."""
        _, name, operands, _ = self.code[index]
        name = name.removesuffix(".w").removesuffix(".n")
        if name in ("push", "vpush"):
            return size_of_list(operands)
        if name in ("pop", "vpop"):
            return -size_of_list(operands)
        if name in ("stmdb", "ldmia", "ldm") and operands.startswith("sp!"):
            return size_of_list(operands) if name == "stmdb" else -size_of_list(operands)
        if found := re.match(r"(add|sub|addw|subw)\s", name + " "):
            sign = -1 if found[1].startswith("add") else 1
            if number := re.match(r"sp,(?: sp,)? #(\d+)$", operands):
                return sign * int(number[1])
            if register := re.match(r"sp,(?: sp,)? (r\d+)$", operands):
                return sign * self.constant(index, register[1])
        if moved := re.search(r"\[sp, #(-?\d+)\]!|\[sp\], #(-?\d+)", operands):
            return -int(moved[1] or moved[2])
        if re.match(r"sp\b", operands) and not name.startswith(("cmp", "str")):
            raise Unknown(f"{self.name}: {name} {operands} changes the stack")
        return 0

    def constant(self, index, register):
        """Returns the constant that the register holds, which an instruction before loads."""
        while index > 0:
            index -= 1
            _, name, operands, comment = self.code[index]
            if not re.match(rf"{register}\b", operands):
                continue
            if name.startswith("ldr") and (literal := re.search(r"\(([0-9a-f]+) <", comment)):
                word = self.words[int(literal[1], 16)]
                return word - (1 << 32) if word >> 31 else word
            number = re.search(r"#(\d+)$", operands)
            if number and name.startswith("mov"):
                return int(number[1])
            if number and name == "lsls" and operands.startswith(f"{register}, {register},"):
                return self.constant(index, register) << int(number[1])
            break
        raise Unknown(f"{self.name}: the stack changes by an unknown {register}")

    def jump_table(self, address, index_of):
        """Returns the targets in the table of addresses behind the jump at `address`."""
        targets = []
        at = (address + 7) & ~3  # the table begins behind the jump, which has 4 bytes, at a multiple of 4
        while (target := self.words.get(at, 0) & ~1) in index_of:
            targets.append(target)
            at += 4
        if not targets:
            raise Unknown(f"{self.name}: a jump without a table behind it")
        return targets

    def holds_return_address(self, index):
        """Returns whether the bx at `index` jumps to the return address: by lr, or a register popped before."""
        register = self.code[index][2]
        while register != "lr" and index > 0:
            index -= 1
            _, name, operands, _ = self.code[index]
            if name == "pop" and re.search(rf"\b{register}\b", operands):
                return True
            if re.match(rf"{register}\b", operands):
                return False
        return register == "lr"


def functions_of(program):
    text = subprocess.run(["arm-none-eabi-objdump", "-d", program], check=True, capture_output=True, text=True).stdout
    found, current = {}, None
    for line in text.splitlines():
        if start := FUNCTION.match(line):
            current = Function(start[2], int(start[1], 16))
            found[current.address] = current
        elif (one := INSTRUCTION.match(line)) and current:
            address, name, operands, comment = int(one[1], 16), one[2], (one[3] or "").strip(), one[4] or ""
            if name == ".word":
                current.words[address] = int(operands.split()[0], 16)
            elif not name.startswith("."):
                current.code.append((address, name, operands, comment))
    return found


class Graph:
    """`calls`: pairs of the address of an indirect call and its target, as they were observed."""

    def __init__(self, program, calls):
        self.functions = functions_of(program)
        self.calls = {}
        for site, target in calls:
            self.calls.setdefault(site, set()).add(target)
        self.depths = {}
        # for each function that calls others by pointers, the functions that were called so in a measurement
        self.indirect = {}
        self.never_called = set()  # functions that call others by pointers, but did so in no measurement

    def find(self, pattern):
        return [one for one in self.functions.values() if re.search(pattern, one.name)]

    def depth(self, function, callers=()):
        """Returns the most bytes of stack of the function and all that it calls."""
        if function.address in callers:
            raise Recursion(f"{function.name} calls itself")
        if function.address not in self.depths:
            deepest = 0
            for depth, targets in self.flow(function):
                for target in targets:
                    below = self.depth(self.function_at(target), (*callers, function.address))
                    deepest = max(deepest, depth + below)
                deepest = max(deepest, depth)
            self.depths[function.address] = deepest
        return self.depths[function.address]

    def function_at(self, address):
        """Returns the function that contains the address; libgcc also calls into the middle of one."""
        return self.functions[max(one for one in self.functions if one <= address)]

    def flow(self, function):
        """Returns the depth at each instruction, and the functions that it calls there."""
        index_of = {address: index for index, (address, *_) in enumerate(function.code)}
        reached, result, table_depths = {}, [], []
        waiting = [(0, 0)]
        while True:
            while waiting:
                index, depth = waiting.pop()
                if index >= len(function.code) or index in reached:
                    continue
                reached[index] = depth
                address, name, operands, _ = function.code[index]
                name = name.removesuffix(".n").removesuffix(".w")
                if re.match(rf"(push|pop|stmdb|ldmia|bx|blx|bl)({CONDITIONS})$", name):
                    raise Unknown(f"{function.name}: {name} depends on a condition")
                after = depth + function.frame_change(index)
                targets, goes_on = [], True
                literal = TARGET.search(operands) if re.match(rf"(bl|blx|cbn?z|b({CONDITIONS})?)$", name) else None
                if literal and int(literal[1], 16) in index_of and int(literal[1], 16) != function.address:
                    waiting.append((index_of[int(literal[1], 16)], after))
                    goes_on = name not in ("b", "bl")  # `bl` to a place within the same function is a far jump
                elif literal:
                    callee = self.functions.get(int(literal[1], 16))
                    if callee and callee.name.startswith("__gnu_thumb1_case"):
                        table_depths.append(after)
                        goes_on = False
                    targets = [int(literal[1], 16)]
                    goes_on = goes_on and name != "b"
                elif name in ("tbb", "tbh"):
                    table_depths.append(after)
                    goes_on = False
                elif name == "bx" and function.holds_return_address(index):
                    goes_on = False
                elif name in ("bx", "blx"):
                    goes_on = name == "blx"
                    targets = self.indirect_targets(function, address, index_of, waiting, after)
                elif name == "ldr" and operands == "pc, [sp], #4":
                    goes_on = False
                elif name == "ldr" and re.fullmatch(r"pc, \[\w+, \w+, lsl #2\]", operands):
                    waiting += [(index_of[target], after) for target in function.jump_table(address, index_of)]
                    goes_on = False
                elif name in ("mov", "ldr", "add") and operands.startswith("pc,"):
                    raise Unknown(f"{function.name}: a jump by {name} {operands}")
                elif name in ("pop", "ldmia", "ldm") and re.search(r"\bpc\b", operands):
                    goes_on = False
                result.append((max(depth, after), targets))
                if goes_on:
                    waiting.append((index + 1, after))
            missing = [index for index in range(len(function.code)) if index not in reached]
            # An instruction to which no other instruction leads is taken as an entry of a jump table.
            if not missing or not table_depths:
                return result
            waiting.append((missing[0], table_depths[-1]))

    def indirect_targets(self, function, address, index_of, waiting, depth):
        observed = self.calls.get(address, set())
        if not observed:
            self.never_called.add(function.name)
        outside = []
        for target in observed:
            if target in index_of and target != function.address:
                waiting.append((index_of[target], depth))
            else:
                outside.append(target)
        self.indirect.setdefault(function.name, set()).update(self.functions[one].name for one in outside)
        return outside
