#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests that the name of a type has one meaning, except those in SHARED and AMBIGUOUS."""

import os
import re
import tempfile
import unittest
from collections import defaultdict
from pathlib import Path

from cpp_source import Source

SOURCE = Path(os.environ.get("ABSENC_SOURCE_DIR", Path(__file__).resolve().parent.parent))

# Names that several types may share, each with the meaning common to these types.
SHARED = {
    "Bits": "the bits of a BiSS word with its check",
    "Candidate": "a guess that is to be tested further",
    "CheckedFrame": "a whole frame with its check; client's is installed, capture's is not",
    "Choices": "what the caller of the constructor chooses",
    "Compiled": "the format's fields as shifts and masks, made once when the format is chosen",
    "CompiledFormat": "a format of the protocol as shifts, masks and a table, for decoding",
    "ConditionIndex": "the conditions of the unit's virtual encoder, in the order of its table",
    "DataId": "the field of that name in the protocol's request",
    "Dialog": "what a procedure of the protocol speaks through",
    "Enough": "thrown to end the decoding of a capture early",
    "Entry": "an entry of the archive or the table that the class around it reads",
    "Exchange": "a request with its reply",
    "Failure": "an exception with sentences for people: os::Failure of a port or a file, client::Failure of all else",
    "Figures": "the counts that the class around it gives to the metrics",
    "Filter": "a machine between a conversation and the port",
    "Format": "which form of the protocol's frames an encoder uses",
    "Guess": "the state that a thread assumes at the begin of its part of a capture",
    "Handle": "releases a resource of the system or of another library",
    "Item": "what the line carries: bytes or CAN frames",
    "ItemOf": "what the line of a protocol carries",
    "Items": "several items of the line",
    "Iterator": "a name that C++ prescribes",
    "Kind": "which kind of the class around it",
    "LineEvent": "what a byte of a line from an slcan adapter completes",
    "Listen": "the conversation that sends nothing and receives an encoder's unsolicited frames",
    "Mark": "how many items had been received at a time",
    "Names": "a list of names",
    "Node": "a machine on the line or bus around it",
    "Nodes": "the encoders that a procedure has found on the bus",
    "Operation": "whether a request reads or writes",
    "Outcome": "how a command ended",
    "P": "the protocol that a template is made for",
    "Parts": "the private members of the class around it, which its header only declares",
    "Pending": "what the class around it has begun and not completed",
    "Phase": "where the state machine around it stands",
    "Position": "the position as the protocol's frame has it",
    "ProcedureResult": "what a procedure of the protocol has found, for the report of its command",
    "Progress": "how far a long command is",
    "Protocol": "what the engine must know of the protocol",
    "ReadKnownPosition": "the conversation that reads a position in a format that is known at compile time",
    "ReadPosition": "the conversation that reads a position",
    "Reply": "a reply of the protocol",
    "Request": "a request of the protocol",
    "RequestBytes": "a request of the protocol as bytes",
    "SendState": "whether a node of the bus around it sends",
    "Settings": "the settings of an encoder, or of the class around it",
    "Sink": "receives the results of the class around it",
    "Snapshot": "what is known of a watched encoder at a moment",
    "State": "where the state machine around it stands",
    "Statistics": "sums over what the class around it has seen",
    "Terminal": "the terminal of a screen",
    "Type": "the type that a template finds",
    "Values": "the values of a protocol's fields",
    "VirtualEncoder": "the virtual encoder of the protocol",
    "Watch": "a thread that reads one encoder, and what is known of that encoder",
    "Watches": "the watches of several encoders",
    "fuse_session": "a name that libfuse prescribes",
    "promise_type": "a name that C++ prescribes",
    "value_type": "a name that C++ prescribes",
}

# Names that several types share without a common meaning. Add no name to this list.
AMBIGUOUS = set("""
    Access Answer Ask BadRequest Burst Bus Carries Channel Check Condition Content Damage Descriptor Encoder Errors
    Finding Frames Known Layout Meaning Mode Open Order Part Place Rate Refusal Report Reported Run
    Sample Samples Sending Server Text Value Verdict Wire WireFrame Word
""".split())

KEYS = ("struct", "class", "union", "enum")
# Tokens that show, directly behind `struct NAME`, that this is no definition of the type.
NO_BODY = set(";(),>=&*")


def is_test(path):
    return bool(re.search(r"_(test|fuzz|bench)\.|^test(_|ing\.)", path.name))


def type_name(source, index):
    """Returns (type name, index of its body) of the definition at `index`, or None."""
    i = index + 1
    while source[i] in ("class", "struct"):  # skips the second keyword of `enum class`
        i += 1
    while source[i] == "[":  # skips an attribute such as [[nodiscard]]
        i = source.partner[i] + 1
    name = []
    while source.tokens[i : i + 1] and (source.tokens[i].kind == "word" or source[i] == "::"):
        if source[i] != "final":
            name.append(source[i])
        i += 1
    if source[i] == "<":  # a template specialisation is no definition of a new name
        return None
    while i < len(source.tokens) and source[i] != "{":
        if source[i] in NO_BODY:
            return None
        i = max(source.partner.get(i, i), i) + 1
    return ("".join(name), i) if name and i < len(source.tokens) else None


def namespace_body(source, index):
    """Returns the index of the opening brace of the namespace at `index`, or None."""
    if source[index] == "namespace":
        i = index + 1
        while source[i] not in ("{", ";", "="):
            i += 1
        return i if source[i] == "{" else None
    return None


def types_of(text):
    """Yields (name with enclosing classes, definition of an alias or "") of each type."""
    source = Source(text)
    yield from types_between(source, 0, len(source.tokens), "")


def types_between(source, first, last, scope):
    i = first
    while i < last:
        word = source[i]
        body = namespace_body(source, i)
        if body is not None:
            yield from types_between(source, body + 1, source.partner[body], scope)
            i = source.partner[body] + 1
        elif word in KEYS and source[i - 1] not in ("friend", "<", ",", "enum"):
            found = type_name(source, i)
            if found is None:
                i += 1
                continue
            name, body = found
            name = f"{scope}::{name}" if scope else name
            yield name, ""
            if word != "enum":
                yield from types_between(source, body + 1, source.partner[body], name)
            i = source.partner[body] + 1
        elif word == "using" and source[i + 2] == "=":
            end = source.right(i, {";"})
            yield (f"{scope}::{source[i + 1]}" if scope else source[i + 1]), source.span(i + 3, end)
            i = end + 1
        elif word == "{":  # skips the body of a function, or a braced value
            i = source.partner.get(i, i) + 1
        else:
            i += 1


def definitions(root):
    """Returns a dictionary: unqualified type name -> meaning -> places."""
    found = defaultdict(lambda: defaultdict(list))
    for top in ("absenc", "tools"):
        for path in sorted((root / top).rglob("*.[ch]pp")):
            if is_test(path):
                continue
            for name, alias in types_of(path.read_text(encoding="utf-8")):
                file = path.relative_to(root)
                meaning = alias or f"{file.parent}: {name}"
                found[name.split("::")[-1]][meaning].append(f"{name} in {file}")
    return found


def shared_names(root):
    """Returns a line for each type name with several meanings that is not listed."""
    lines = []
    for name, meanings in sorted(definitions(root).items()):
        places = sorted({place for files in meanings.values() for place in files[:1]})
        if len(places) > 1 and name not in SHARED and name not in AMBIGUOUS:
            lines.append(f"{name}: {', '.join(places)}")
    return lines


class TypeNames(unittest.TestCase):
    def test_one_meaning_each(self):
        self.assertEqual(shared_names(SOURCE), [])

    def test_listed_names_are_shared(self):
        shared = {name for name, meanings in definitions(SOURCE).items() if len(meanings) > 1}
        self.assertEqual((set(SHARED) | AMBIGUOUS) - shared, set(), "these names have one meaning: take them off the list")


class CheckItself(unittest.TestCase):
    def names(self, **files):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in files.items():
                file = Path(folder, "absenc", name, "source.hpp")
                file.parent.mkdir(parents=True)
                file.write_text(text, encoding="utf-8")
            return [line.split(":")[0] for line in shared_names(Path(folder))]

    def test_finds_name_with_two_meanings(self):
        for one in (
            "struct Seen { int a; };",
            "namespace a {\nclass Seen final : public B<int> {};\n}",
            "struct Outer {\n  enum class Seen : std::uint8_t { yes, no };\n};",
            "struct Outer::Seen {\n  int a;\n};",
            "using Seen = int;",
            "template <class T>\nclass Seen {\n  T a;\n};",
        ):
            with self.subTest(one):
                self.assertEqual(self.names(one=one, other="struct Seen { bool b; };"), ["Seen"])

    def test_passes_over_what_is_no_second_meaning(self):
        for one in (
            "struct Seen;",
            "class Outer {\n  friend class Seen;\n};",
            "template <class Seen>\nvoid f(Seen seen) { seen(); }",
            "void f(const struct Seen& seen);",
            "int f() {\n  struct Seen {};\n  return 0;\n}",
            "// struct Seen {};",
        ):
            with self.subTest(one):
                self.assertEqual(self.names(one=one, other="struct Seen { bool b; };"), [])
        self.assertEqual(self.names(one="using Seen = std::vector<int>;", other="using Seen = std::vector<int>;"), [])


if __name__ == "__main__":
    unittest.main()
