# SPDX-License-Identifier: Apache-2.0
"""Splits a C++ source into tokens, and finds the bounds of its operands and statements."""

import bisect
import re
from typing import NamedTuple

TOKEN = re.compile(
    r"""(?P<space>\s+)
      | (?P<comment>//[^\n]*|/\*.*?\*/)
      | (?P<directive>\#(?:\\\n|[^\n])*)
      | (?P<string>(?:u8|[uUL])?R"(?P<mark>[^()\\\s]{0,16})\(.*?\)(?P=mark)"\w* | (?:u8|[uUL])?"(?:\\.|[^"\\\n])*"\w*)
      | (?P<char>(?:u8|[uUL])?'(?:\\.|[^'\\\n])+')
      | (?P<number>\.?\d(?:[eEpP][+-]|'?[\w.])*)
      | (?P<word>[A-Za-z_]\w*)
      | (?P<operator><=>|<<=|>>=|->\*|\.\.\.|::|->|\+\+|--|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|.)""",
    re.VERBOSE | re.DOTALL,
)
OPENING = {"(": ")", "[": "]", "{": "}"}
CLOSING = set(OPENING.values())


class Token(NamedTuple):
    kind: str
    text: str
    start: int
    end: int


class Source:
    """A C++ source as a list of tokens, and its pairs of matching brackets."""

    def __init__(self, text):
        self.text = text
        self.tokens = [
            Token(found.lastgroup if found.lastgroup != "mark" else "string", found[0], found.start(), found.end())
            for found in TOKEN.finditer(text)
            if found.lastgroup not in ("space", "comment", "directive")
        ]
        self.lines = [0] + [found.end() for found in re.finditer("\n", text)]
        self.line_of_token = [self.line_of(token.start) for token in self.tokens]
        self.partner = {}
        self._pair_brackets()

    def __getitem__(self, index):
        return self.tokens[index].text if 0 <= index < len(self.tokens) else ""

    def _pair_brackets(self):
        open_ones = []
        for i, token in enumerate(self.tokens):
            if token.text in OPENING or (token.text == "<" and not self.is_binary(i)):
                open_ones.append(i)
            elif token.text in CLOSING:
                while open_ones and self[open_ones[-1]] == "<":
                    open_ones.pop()
                if open_ones:
                    self._pair(open_ones.pop(), i)
            elif token.text in (">", ">>") and not self.is_binary(i):
                for _ in token.text:
                    if open_ones and self[open_ones[-1]] == "<":
                        self._pair(open_ones.pop(), i)

    def _pair(self, first, last):
        self.partner[first] = last
        self.partner[last] = first

    def is_binary(self, index):
        token = self.tokens[index]
        return self.text[token.start - 1 : token.start].isspace() and self.text[token.end : token.end + 1].isspace()

    def line_of(self, position):
        return bisect.bisect_right(self.lines, position)

    def tokens_of_lines(self, first, last):
        """Returns the half-open range of the indices of the tokens in the lines `first` to `last`."""
        return bisect.bisect_left(self.line_of_token, first), bisect.bisect_right(self.line_of_token, last)

    def span(self, first, last):
        """Returns the source text of the tokens from `first` to `last`, exclusive."""
        return self.text[self.tokens[first].start : self.tokens[last - 1].end]

    def left(self, index, stops):
        """Returns the index of the first token of the operand that ends before the token `index`."""
        while index > 0 and self[index - 1] not in stops:
            index -= 1
            if self[index] in OPENING:
                return index + 1
            if self[index] in CLOSING and self[index] == "}" and self._is_block(index):
                return index + 1
            if index in self.partner and self.partner[index] < index:
                index = self.partner[index]
        return index

    def _is_block(self, closing):
        before = self.partner.get(closing, closing) - 1
        return before < 0 or self[before] in (")", ";", "{", "}", "else", "do")

    def right(self, index, stops):
        """Returns the index after the last token of the operand that begins at the token `index`."""
        while index < len(self.tokens) and self[index] not in stops and self[index] not in CLOSING:
            index = max(self.partner.get(index, index), index) + 1
        return index

    def statement(self, index):
        """Returns the index behind the statement that begins at the token `index`."""
        while index < len(self.tokens) and self[index] not in CLOSING:
            if self[index] == ";":
                return index + 1
            if self[index] == "{" and self._is_block(self.partner.get(index, index)):
                return self.partner.get(index, index) + 1
            index = max(self.partner.get(index, index), index) + 1
        return index
