# SPDX-License-Identifier: Apache-2.0
"""Finds the mutants of a C++ source: one wrong change each, of what a protocol's document demands.

No list of places: rules over the tokens of sources that clang-format has formatted (a binary operator stands between
spaces, a template's bracket does not). By the name that they have in a mutant's id, the coarse ones:

  never        a check does not refuse: its condition is false, or one of those joined by || is left out; a rule counts
               as kept
  skip         a step of a procedure whose answer nobody looks at is left out
  half, twice  a time in a header, where those of the document stand
  zero, ten    a time in a source, which its author chose: nothing, and ten times as much

and the fine ones:

  drop         one term of a condition is left out; `&&` for `||` is no rule: whatever notices these notices that
  edge         `<` for `<=`, `>=` for `>` in a condition, and the other way round
  true, false  what a predicate of one comparison returns
  number       a constant, or a length that a function returns: one more, from 256 on twice as much; written in
               hexadecimal digits, its lowest bit the other way
  bit          a mask without its lowest bit
  shift        one bit further
  sign         + 1 for - 1, and the other way round

A check is an `if` that refuses: with an error or with nothing (`return false`, `return std::nullopt`); what `expect`
takes for a kept rule; `good ? value : Error::x`; and an error that is left when all cases are through. Terms and edges
are also those of what is returned or assigned.
"""

import hashlib
import re
from typing import NamedTuple

from cpp_source import CLOSING, OPENING, Source

ASSIGNMENT = {"=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>="}
# What no operand of && or || reaches across.
ENDS_OPERAND = {";", ",", "?", ":", "return", "co_return", "case", "else"} | ASSIGNMENT
COARSE = {"never", "skip", "half", "twice", "zero", "ten"}
ARITHMETIC = {"bit", "shift", "sign"}  # one of them in a line says what all of them would
EDGE = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
REFUSES = re.compile(r"fail|failed|refuse\w*|reject\w*|settle\w*")
NOTHING = {"returnfalse;", "returnstd::nullopt;", "returnnullptr;", "return{};", "std::nullopt", "nullptr"}
TABLES = {"array", "to_array", "Option", "option", "Argument", "Command", "Fields"}  # texts and their numbers
DURATION = re.compile(r"[\d'.]+(ns|us|ms|s|min|h)")
INTEGER = re.compile(r"(0[xX][\da-fA-F']+|0[bB][01']+|[\d']+)(?:u|U|l|L|ul|UL|z|uz)?")


class Switch(NamedTuple):
    """The same, chosen while a program runs: `IS` in what is put before and behind is whether it is this mutant."""

    start: int
    end: int
    before: str
    behind: str


class Mutant(NamedTuple):
    file: str  # below the folder of the sources, as the id has it
    rule: str
    line: int
    start: int
    end: int
    before: str
    after: str
    id: str
    switch: "Switch | None"
    constant: "str | None" = None  # its name: it is switched where all that use it call a function (as_functions)

    def applied_to(self, text):
        return text[: self.start] + self.after + text[self.end :]


def with_switches(text, numbered):
    """`text` with all mutants in it, given with their numbers; `chosen_mutant(N)` says whether it is that one."""
    # Those in others are put in between; of those at one place the first is the outermost.
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
    """`text` in which these constants of type Time, and whatever uses them, are functions; None where one of the names
    means something else, too."""
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
    """Of the text of an integer; None for everything else."""
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
        """What stands in the brackets behind `word` is not touched."""
        for i, token in enumerate(self.source.tokens):
            if token.text == word and i + 1 in self.source.partner:
                for j in range(i, self.source.partner[i + 1]):
                    self.left_alone[j] = True

    def _switch(self, first, last, before, behind):
        tokens = self.source.tokens
        return Switch(tokens[first].start, tokens[last - 1].end, before, behind)

    def _change(self, rule, first, last, after, switch=None, constant=None):
        """The tokens from `first` up to, without, `last` become `after`."""
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
        # The id holds while the line does, wherever it goes and whatever is said beside it.
        begin, behind = self.source.tokens_of_lines(line, self.source.line_of(end - 1))
        context = [token.text for token in tokens[begin:behind]]
        told = "\n".join([rule, after, str(first - begin), *context])
        seen = self._seen[told] = self._seen.get(told, 0) + 1
        digest = hashlib.sha256(f"{told}\n{seen}".encode()).hexdigest()[:8]
        name = f"{self.file}:{rule}:{digest}"
        before = self.source.text[start:end]
        self.found.append(Mutant(self.file, rule, line, start, end, before, after, name, switch, constant))

    # ---- Checks

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
        """The conditions of a check; what lambdas in it do is not looked at."""
        i = first
        while i < last:
            if self.source[i] == "{":
                i = self.source.partner.get(i, i)
            self.in_check[i] = True
            i += 1

    def _refuses(self, first, last):
        """Whether a statement, or a block without what its inner blocks do, refuses something."""
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
        """What is left to a function when all its cases are through."""
        source = self.source
        block = self._around(index)
        is_branch = source[block - 1] == "else" or source[source.partner.get(block - 1, 0) - 1] == "if"
        if source.span(index, index + 3) == "return Error::" and source[index + 4] == ";" and not is_branch:
            if source[index + 3] != "none" and source[index - 1] in (";", "{", "}", ":"):
                switch = self._switch(index + 1, index + 4, "(IS ? Error::none : ", ")")
                self._change("never", index + 3, index + 4, "none", switch)

    def _choice(self, index):
        """`good ? value : Error::x`, either way round."""
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
        """Each of the terms that `operator` joins is a check of its own."""
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
        """What `expect(kept, rule, at)` takes for kept; not where it is declared."""
        source = self.source
        first = index + 2
        last = source.right(first, {","})
        if source[index + 1] == "(" and source[index - 1] not in ("bool", "void", "::") and source[first] != "true":
            self._mark(first, last)
            self._never(first, last, "&&", "true")

    # ---- Constants

    def _declared_times(self):
        """`Time name = ...;`, whatever it is computed from."""
        source = self.source
        for i in range(len(source.tokens)):
            if source[i] != "Time" or source[i + 2] != "=" or source.tokens[i + 1].kind != "word" or self.left_alone[i]:
                continue
            end = source.right(i + 3, {";", ","})
            # A constant, or a member with the value it has unless told otherwise: not what a function computes.
            is_member = source[i - 1] in (";", "{", "}") and source.tokens[i + 3].kind == "number" and end == i + 4
            if source[i - 1] == "constexpr" or is_member:
                self._times(i + 3, end, "" if is_member or self._is_local(i) else source[i + 1])
                for j in range(i, end):
                    self.left_alone[j] = True

    def _computed_times(self):
        """What a function returns whose type is Time."""
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
                if source[j] == "return" and end > j + 2 and not self.left_alone[j]:  # more than a name
                    self._times(j + 1, end)
                    for k in range(j, end):
                        self.left_alone[k] = True

    def _is_local(self, index):
        """Whether what is declared there is a function's."""
        source = self.source
        outer = self._around(index)
        begin = source.left(outer, {";", "}"})
        return source[outer] == "{" and not {"namespace", "class", "struct"} & {source[i] for i in range(begin, outer)}

    def _times(self, first, last, constant=None):
        """`constant`: its name; empty: what cannot be switched."""
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
        """The value of an enumerator, or anywhere in that of a constant: the polynomial of a CRC, for example."""
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
                return False  # a function's
        return False

    def _around(self, index):
        """The bracket around a token."""
        while index > 0:
            index -= 1
            if self.source[index] in OPENING:
                return index
            if self.source.partner.get(index, index) < index:
                index = self.source.partner[index]
        return 0


def find(file, text):
    """The mutants of one source; `file` is what their ids begin with."""
    return Finder(file, text).mutants()
