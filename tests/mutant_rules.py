# SPDX-License-Identifier: Apache-2.0
"""Finds the mutants of a C++ source that clang-format has formatted.

The coarse rules, by the name in a mutant's id:

  never        a check never refuses
  skip         leaves out a step of a procedure whose result is not used
  half, twice  changes a time in a header
  zero, ten    changes a time in a source

The fine rules:

  drop         leaves out one term of a condition
  edge         swaps `<` and `<=`, or `>` and `>=`, in a condition
  true, false  fixes the result of a predicate
  number       changes a constant
  bit          clears the lowest set bit of a mask
  shift        shifts by one bit more
  sign         swaps + 1 and - 1"""

import hashlib
import re
from typing import NamedTuple

from cpp_source import CLOSING, OPENING, Source

ASSIGNMENT = {"=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>="}
# Tokens that end an operand of `&&` or `||`; brackets, `&&` and `||` themselves end an operand, too.
ENDS_OPERAND = {";", ",", "?", ":", "return", "co_return", "case", "else"} | ASSIGNMENT
COARSE = {"never", "skip", "half", "twice", "zero", "ten"}
ARITHMETIC = {"bit", "shift", "sign"}  # rules that change arithmetic; they make at most one mutant for a line
EDGE = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
REFUSES = re.compile(r"fail|failed|refuse\w*|reject\w*|settle\w*")
NOTHING = {"returnfalse;", "returnstd::nullopt;", "returnnullptr;", "return{};", "std::nullopt", "nullptr"}
# Words that show that a declaration is a table; numbers in tables are not mutated.
TABLES = {"array", "to_array", "Option", "option", "Argument", "Command", "Fields"}
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
DURATION = re.compile(r"[\d'.]+(ns|us|ms|s|min|h)")
INTEGER = re.compile(r"(0[xX][\da-fA-F']+|0[bB][01']+|[\d']+)(?:u|U|l|L|ul|UL|z|uz)?")


class Switch(NamedTuple):
    """A choice at run time: texts to insert at `start` and `end`. `IS` stands for the condition."""

    start: int
    end: int
    before: str
    behind: str


class Mutant(NamedTuple):
    file: str  # path of the source file, relative to the folder of all sources
    rule: str
    line: int
    start: int
    end: int
    before: str
    after: str
    id: str
    switch: "Switch | None"
    # Name of the constant at namespace scope that the mutant changes; None if it changes none.
    constant: "str | None" = None

    def applied_to(self, text):
        return text[: self.start] + self.after + text[self.end :]


def with_switches(text, numbered):
    """Returns `text` with the switches inserted. `numbered`: pairs of number and mutant."""
    # A switch is inserted code that selects a mutant at run time. If the code of one mutant is part of the code of
    # another, its switch is inserted inside the switch of the other.
    inserted = []
    for order, (number, mutant) in enumerate(numbered):
        start, end, before, behind = mutant.switch
        inserted.append(((start, 1, -end, order), before.replace("IS", f"chosen_mutant({number})")))
        inserted.append(((end, 0, -start, -order), behind))
    parts, position = [], 0
    for key, words in sorted(inserted):
        parts += [text[position : key[0]], words]
        position = key[0]
    return "".join(parts) + text[position:]


def as_functions(text, names):
    """Returns `text` with the constants `names` as functions, or None if that is not possible."""
    source = Source(text)
    inserted = []
    for i, token in enumerate(source.tokens):
        if token.text not in names or source[i - 1] in (".", "->"):
            continue
        if source[i - 2] == "constexpr" and source[i - 1] == "Time" and source[i + 1] == "=":
            end = source.tokens[source.right(i + 2, {";"})].end
            inserted += [(token.end, token.end, "()"), (*source.tokens[i + 1][2:], "{ return"), (end, end, " }")]
        elif source.tokens[i - 1].kind == "word" and source[i - 1] not in ("return", "co_return", "case"):
            return None
        elif source[source.left(i, {";"})] != "using":
            inserted.append((token.end, token.end, "()"))
    for start, end, words in sorted(inserted, reverse=True):
        text = text[:start] + words + text[end:]
    return text


def value_of(number):
    """Returns the value of an integer literal, or None for any other text."""
    found = INTEGER.fullmatch(number)
    if not found:
        return None
    digits = found[1].replace("'", "")
    return int(digits, 0) if digits[1:2] in ("x", "X", "b", "B") else int(digits)


class Finder:
    def __init__(self, file, text):
        self.file = file
        self.source = Source(text)
        self.found = []
        self._results = set()
        self._calculating = set()
        self._seen = {}
        self.left_alone = [False] * len(self.source.tokens)
        self.in_check = [False] * len(self.source.tokens)
        self._leave("static_assert")
        self._leave("for")
        self._leave("requires")

    def mutants(self):
        source = self.source
        self._declared_times()
        self._computed_times()
        self._find_checks()
        for i, token in enumerate(source.tokens):
            if self.left_alone[i]:
                continue
            if token.kind == "number":
                self._number(i)
            elif token.text in ("&&", "||") and source.is_binary(i) and self.in_check[i]:
                self._terms(i)
            elif token.text in EDGE and source.is_binary(i) and self.in_check[i]:
                self._change("edge", i, i + 1, EDGE[token.text])
            elif token.text in ("return", "co_return"):
                self._predicate(i)
            elif token.text == "co_await" and source[i - 1] in (";", "{", "}", ")", "else"):
                end = source.statement(i) - 1
                self._change("skip", i, end, "", self._switch(i, end, "if (IS) {} else ", ""))
        return sorted(self.found, key=lambda mutant: mutant.start)

    def _leave(self, word):
        """Excludes from mutation the bracket after each token `word`."""
        for i, token in enumerate(self.source.tokens):
            if token.text == word and i + 1 in self.source.partner:
                for j in range(i, self.source.partner[i + 1]):
                    self.left_alone[j] = True

    def _switch(self, first, last, before, behind):
        tokens = self.source.tokens
        return Switch(tokens[first].start, tokens[last - 1].end, before, behind)

    def _change(self, rule, first, last, after, switch=None, constant=None):
        """Adds a mutant with `after` in place of the tokens from `first` to `last`, exclusive, unless surplus."""
        tokens = self.source.tokens
        start, end = tokens[first].start, tokens[last - 1].end
        result = (start, end, after)
        if result in self._results:
            return
        self._results.add(result)
        line = self.source.line_of(start)
        if rule in ARITHMETIC:
            if line in self._calculating:
                return
            self._calculating.add(line)
        # The id is computed from the code of the mutant's lines, so that it does not change with line numbers or
        # comments.
        begin, behind = self.source.tokens_of_lines(line, self.source.line_of(end - 1))
        context = [token.text for token in tokens[begin:behind]]
        code_after = " ".join(COMMENT.sub("", after).split())
        description = "\n".join([rule, code_after, str(first - begin), *context])
        repetition = self._seen[description] = self._seen.get(description, 0) + 1
        digest = hashlib.sha256(f"{description}\n{repetition}".encode()).hexdigest()[:8]
        name = f"{self.file}:{rule}:{digest}"
        before = self.source.text[start:end]
        self.found.append(Mutant(self.file, rule, line, start, end, before, after, name, switch, constant))

    # ---- Mutants of checks

    def _find_checks(self):
        source = self.source
        for i in range(len(source.tokens)):
            if self.left_alone[i]:
                continue
            if source[i] == "if" and source[i + 1] == "(":
                self._check(i)
            elif source[i] in ("expect", "note"):
                self._rule(i)
            elif source[i] == "?":
                self._choice(i)
            elif source[i] in ("return", "="):
                self._mark(i + 1, source.right(i + 1, {";", ",", "?"}))
                self._refusal(i)

    def _mark(self, first, last):
        """Marks tokens as conditions of a check, except inside braces."""
        i = first
        while i < last:
            if self.source[i] == "{":
                i = self.source.partner.get(i, i)
            self.in_check[i] = True
            i += 1

    def _refuses(self, first, last):
        """Returns whether a statement or block refuses something, outside its inner blocks."""
        source = self.source
        body = "".join(source[i] for i in range(first, last))
        if body in NOTHING or body[1:-1] in NOTHING:
            return True
        i = first + 1 if source[first] == "{" else first
        while i < last:
            if source[i] == "{" and source._is_block(source.partner.get(i, i)):
                i = source.partner[i]
            elif source[i] == "Error" and source[i + 1] == "::" and source[i + 2] != "none":
                return True
            elif REFUSES.fullmatch(source[i]) and source[i + 1] == "(":
                return True
            i += 1
        return False

    def _check(self, index):
        source = self.source
        opening = index + 1
        closing = source.partner[opening]
        first = opening + 1
        for i in range(first, closing):
            if source[i] == ";":
                first = i + 1
        body = closing + 1
        declares = source[closing - 1] != "=" and any(source[i] == "=" for i in range(first, closing))
        if not declares and self._refuses(body, source.statement(body)):
            self._mark(first, closing)
            self._never(first, closing, "||", "false")

    def _refusal(self, index):
        """Adds a mutant of the error that a function returns after all its cases."""
        source = self.source
        block = self._around(index)
        is_branch = source[block - 1] == "else" or source[source.partner.get(block - 1, 0) - 1] == "if"
        if source.span(index, index + 3) == "return Error::" and source[index + 4] == ";" and not is_branch:
            if source[index + 3] != "none" and source[index - 1] in (";", "{", "}", ":"):
                switch = self._switch(index + 1, index + 4, "(IS ? Error::none : ", ")")
                self._change("never", index + 3, index + 4, "none", switch)

    def _choice(self, index):
        """Adds mutants of the condition in `good ? value : Error::x` or its opposite."""
        source = self.source
        colon = source.right(index + 1, {":", ";"})
        if source[colon] != ":":
            return
        end = source.right(colon + 1, {";", ","})
        is_error = [self._refuses(first, last) for first, last in ((index + 1, colon), (colon + 1, end))]
        if is_error[0] != is_error[1]:
            first = source.left(index, ENDS_OPERAND)
            self._mark(first, index)
            self._never(first, index, *(("||", "false") if is_error[0] else ("&&", "true")))

    def _never(self, first, last, operator, harmless):
        """Adds a mutant for each term joined by `operator`. A `harmless` term refuses nothing."""
        source = self.source
        ends = ENDS_OPERAND | {operator} | ({"||"} if operator == "&&" else set())
        switch = ("(!IS && (", "))") if harmless == "false" else ("(IS || (", "))")
        begins = [first]
        while (end := source.right(begins[-1], ends)) < last and source[end] == operator:
            begins.append(end + 1)
        if len(begins) == 1 or end < last:
            self._change("never", first, last, harmless, self._switch(first, last, *switch))
            return
        self._change("never", first, begins[1], "", self._switch(first, begins[1] - 1, *switch))
        for i in range(1, len(begins)):
            behind = (begins[i + 1 :] + [end + 1])[0] - 1
            self._change("never", begins[i] - 1, behind, "", self._switch(begins[i], behind, *switch))

    def _terms(self, index):
        source = self.source
        operator = source[index]
        stops = ENDS_OPERAND | ({"&&", "||"} if operator == "&&" else {"||"})
        first = source.left(index, stops)
        self._change("drop", index, source.right(index + 1, stops), "")
        if source[first - 1] != operator:
            self._change("drop", first, index + 1, "")

    def _predicate(self, index):
        source = self.source
        end = source.right(index + 1, {";"})
        inside = {source[i] for i in range(index + 1, end) if not self._is_nested(i, index)}
        if inside & {"==", "!="} and not inside & {"&&", "||", "?"}:
            self._change("true", index + 1, end, "true")
            self._change("false", index + 1, end, "false")

    def _is_nested(self, index, outer):
        return any(self.source.partner.get(i, 0) > index for i in range(outer, index) if self.source[i] in OPENING)

    def _rule(self, index):
        """Adds mutants of the condition `kept` in calls of `expect` and `note`."""
        source = self.source
        first = index + 2
        last = source.right(first, {","})
        if source[index + 1] == "(" and source[index - 1] not in ("bool", "void", "::") and source[first] != "true":
            self._mark(first, last)
            self._never(first, last, "&&", "true")

    # ---- Mutants of constants

    def _declared_times(self):
        """Adds mutants of each `constexpr Time name = ...;` and of each `Time name = literal;`."""
        source = self.source
        for i in range(len(source.tokens)):
            if source[i] != "Time" or source[i + 2] != "=" or source.tokens[i + 1].kind != "word" or self.left_alone[i]:
                continue
            end = source.right(i + 3, {";", ","})
            # Only a constant or a member that is a single number is mutated, not a value that a function computes.
            is_member = source[i - 1] in (";", "{", "}") and source.tokens[i + 3].kind == "number" and end == i + 4
            if source[i - 1] == "constexpr" or is_member:
                self._times(i + 3, end, "" if is_member or self._is_local(i) else source[i + 1])
                for j in range(i, end):
                    self.left_alone[j] = True

    def _computed_times(self):
        """Adds mutants of the times in return statements of functions of type Time."""
        source = self.source
        for i in range(len(source.tokens)):
            if source[i] != "Time" or source.tokens[i + 1].kind != "word" or source[i + 2] != "(":
                continue
            body = source.partner[i + 2] + 1
            while source[body] in ("const", "noexcept", "override", "final"):
                body += 1
            if source[body] != "{":
                continue
            for j in range(body, source.partner[body]):
                end = source.right(j + 1, {";"})
                # A return statement is mutated unless it returns a single token, such as a name.
                if source[j] == "return" and end > j + 2 and not self.left_alone[j]:
                    self._times(j + 1, end)
                    for k in range(j, end):
                        self.left_alone[k] = True

    def _is_local(self, index):
        """Returns whether the declaration at `index` is local to a function."""
        source = self.source
        outer = self._around(index)
        begin = source.left(outer, {";", "}"})
        return source[outer] == "{" and not {"namespace", "class", "struct"} & {source[i] for i in range(begin, outer)}

    def _times(self, first, last, constant=None):
        """Adds the mutants of the time in the tokens from `first` to `last`, exclusive."""
        before = f"Time({self.source.span(first, last)})"
        if self.file.endswith(".hpp"):
            changes = {"half": f"{before} / 2", "twice": f"{before} * 2"}
        else:
            changes = {"zero": "Time{}", "ten": f"{before} * 10"}
        is_operand = last == first + 1 and self.source[first - 1] != "="
        for rule, after in changes.items():
            switch = None if constant == "" else self._switch(first, last, f"(IS ? Time({after}) : Time(", "))")
            self._change(rule, first, last, f"({after})" if is_operand else after, switch, constant)

    def _number(self, index):
        source = self.source
        number = source[index]
        if DURATION.fullmatch(number):
            if number[0] != "0":
                self._times(index, index + 1)
            return
        value = value_of(number)
        if value is None:
            return
        before = source[index - 1]
        masks = {"&", "|", "^", "&=", "|=", "^="}
        if before in ("<<", ">>", "<<=", ">>="):
            self._change("shift", index, index + 1, f"{value + 1}")
        elif (before in masks or source[index + 1] in masks - {"&="}) and value > 0:
            self._change("bit", index, index + 1, f"({number} ^ {value & -value})")
        elif before in ("+", "-") and source.is_binary(index - 1):
            if value == 1:
                self._change("sign", index - 1, index, "-" if before == "+" else "+")
        elif (before == "return" and value > 0) or self._is_constant(index):
            self._change("number", index, index + 1, self._other(number, value))

    @staticmethod
    def _other(number, value):
        if number[1:2] in ("x", "X", "b", "B") and value > 0:
            return f"({number} ^ {value & -value})"
        return f"({number} + 1)" if value < 256 else f"({number} * 2)"

    def _is_constant(self, index):
        """Returns whether the token `index` is in the value of an enumerator or of a constant."""
        source = self.source
        outer = self._around(index)
        if source[index - 1] == "=" and source.tokens[index - 2].kind == "word" and source[outer] == "{":
            begin = source.left(outer, {";", "}"})
            if "enum" in [source[i] for i in range(begin, outer)]:
                return True
        while index > 0:
            begin = source.left(index, {";"})
            declared = [source[i] for i in range(begin, index)]
            if "constexpr" in declared and ("=" in declared or source[index] == "{") and ")" not in declared:
                return not TABLES.intersection(declared)
            if source[begin - 1] != "{":
                return False
            index = begin - 1
            if source[index - 1] in (")", ":", "const", "noexcept"):
                return False  # the value is inside a function, so it is no constant at namespace scope
        return False

    def _around(self, index):
        """Returns the index of the opening bracket that encloses the token `index`; 0 if there is none."""
        while index > 0:
            index -= 1
            if self.source[index] in OPENING:
                return index
            if self.source.partner.get(index, index) < index:
                index = self.source.partner[index]
        return 0


def find(file, text):
    """Returns the mutants of `text`. `file` is the first part of their ids."""
    return Finder(file, text).mutants()
