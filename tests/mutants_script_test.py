#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests tests/mutant_rules.py and tests/mutants.py."""

import os
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ.get("ABSENC_SOURCE_DIR", Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(SOURCE / "tests"))

import mutant_rules  # noqa: E402
import mutants  # noqa: E402

TOY = """\
// A comment: if (a < b) return Error::timeout; 40us
#define LIMIT (4 < 5 ? 1ms : 2ms)
constexpr Time pause = 40us;
constexpr CrcParameters crc{8, 0x07, 0};
enum class Code : std::uint8_t { read = 3 };
static_assert(sizeof(int) >= 4 && crc_of({1, 2}) == 0x10);

Error check(const Format& format, Bytes bytes) {
  if (bytes.size() < 4 || bytes[0] != format.id) return Error::wrong_length;
  if (format.strict && (bytes[1] & 0x0F) != 0) {
    return fail("not 1 < 2 && 3us");
  }
  for (std::size_t i = 0; i < 3 && i + 1 < bytes.size(); ++i) use(bytes[i] << 8);
  const auto wide = std::max<std::pair<int, int>>(bytes.size() + 1, R"(a && b)");
  return bytes[2] == 7 ? Error::none : Error::cross_check_failed;
}

bool is_mine(Code code) { return code == Code::read; }
Time silence(Line line) { return line.rate > 9 ? 750us : line.character() * 7 / 2; }

void Device::hear(Time at) {
  expect(at >= free_at_, "too early", at);
  if (!expect(at >= last_ + 10ms, "too soon", at)) count_ = 0;
  if (sends_) expect(false, turn_rule, at);
  expect(true, turn_rule, at);
}

Procedure zero(Dialog& dialog) {
  co_await dialog.ask({Ask::zero});
  if (!near((co_await dialog.ask({Ask::position}).after(210ms)).counts, 0)) co_return {Error::cross_check_failed, "no"};
}
"""


def changes(text, file="toy.hpp"):
    """Returns (rule, before, after) of each mutant found in a source text, with single spaces."""
    return [
        (found.rule, " ".join(found.before.split()), " ".join(found.after.split()))
        for found in mutant_rules.find(file, text)
    ]


class Rules(unittest.TestCase):
    def setUp(self):
        self.found = changes(TOY)

    def test_mutates_checks(self):
        for change in (
            ("never", "bytes.size() < 4 ||", ""),
            ("never", "|| bytes[0] != format.id", ""),
            ("never", "format.strict && (bytes[1] & 0x0F) != 0", "false"),
            ("never", "bytes[2] == 7", "true"),
            ("never", "!near((co_await dialog.ask({Ask::position}).after(210ms)).counts, 0)", "false"),
            ("drop", "format.strict &&", ""),
            ("drop", "&& (bytes[1] & 0x0F) != 0", ""),
            ("edge", "<", "<="),
            ("true", "code == Code::read", "true"),
            ("false", "code == Code::read", "false"),
        ):
            self.assertIn(change, self.found)

    def test_leaves_out_each_term_once(self):
        found = changes("bool f() { return a && b == 2 && g(c && d) || e; }")
        terms = [before for rule, before, _ in found if rule == "drop"]
        expected = ["a &&", "&& b == 2", "&& g(c && d)", "c &&", "&& d", "a && b == 2 && g(c && d) ||", "|| e"]
        self.assertEqual(sorted(terms), sorted(expected))

    def test_mutates_final_error(self):
        found = changes("Error f() { switch (x) { case 1: return Error::none; default: return Error::busy; } }")
        self.assertEqual(found, [("never", "busy", "none")])

    def test_mutates_times(self):
        for change in (
            ("half", "40us", "Time(40us) / 2"),
            ("twice", "40us", "Time(40us) * 2"),
            ("half", "10ms", "(Time(10ms) / 2)"),
            ("twice", "210ms", "(Time(210ms) * 2)"),
            ("never", "at >= free_at_", "true"),
            ("edge", ">=", ">"),
            ("never", "at >= last_ + 10ms", "true"),
            ("never", "false", "true"),
        ):
            self.assertIn(change, self.found)
        chosen = changes("constexpr Time pause = 40us;", "toy.cpp")
        self.assertEqual(chosen, [("zero", "40us", "Time{}"), ("ten", "40us", "Time(40us) * 10")])
        self.assertEqual(sum(rule == "half" and "character" in before for rule, before, _ in self.found), 1)

    def test_skips_steps_of_procedures(self):
        self.assertIn(("skip", "co_await dialog.ask({Ask::zero})", ""), self.found)

    def test_mutates_constants(self):
        for change in (("number", "8", "(8 + 1)"), ("number", "3", "(3 + 1)"), ("bit", "0x0F", "(0x0F ^ 1)")):
            self.assertIn(change, self.found)
        self.assertEqual(changes("constexpr std::uint8_t bit = 0x60;"), [("number", "0x60", "(0x60 ^ 32)")])
        self.assertEqual(changes("constexpr int speed = 6'000;"), [("number", "6'000", "(6'000 * 2)")])
        self.assertEqual(changes("void f() { g(a << 8 * i, n - 1); }"), [("shift", "8", "9")])
        self.assertEqual(changes("void f() { g(n - 1); }"), [("sign", "-", "+")])

    def test_leaves_other_places_alone(self):
        lines = TOY.splitlines()
        broken = {lines[found.line - 1] for found in mutant_rules.find("toy.hpp", TOY)}
        for begin in ("//", "#define", "static_assert", "    return fail"):
            self.assertFalse([line for line in broken if line.startswith(begin)], begin)
        # No mutant changes loop headers, template brackets or raw strings.
        self.assertEqual(changes("void f() { for (int i = 0; i < 3 && i + 1 < n; ++i) g(i); }"), [])
        self.assertEqual(changes('void f() { g(h<pair<int, 4>>(1), R"(a && b < 2ms)", "1s", \'&\'); }'), [])

    def test_switches_several_mutants_in(self):
        lines = (
            ("if (a || b) return false;", "if ((!chosen_mutant(1) && (a)) || (!chosen_mutant(2) && (b))) return false;"),
            ("x = good ? value : Error::y;", "x = (chosen_mutant(1) || (good)) ? value : Error::y;"),
            ("co_await dialog.ask();", "if (chosen_mutant(1)) {} else co_await dialog.ask();"),
            ("rest(10ms);", "rest((chosen_mutant(1) ? Time(Time(10ms) / 2) : Time((chosen_mutant(2) ? "
             "Time(Time(10ms) * 2) : Time(10ms)))));"),
            # a mutant of a constant inside a function cannot be switched at run time
            ("constexpr Time pause = 40us;", None),
        )
        for line, expected in lines:
            text = f"void f() {{ {line} }}"
            found = [one for one in mutant_rules.find("toy.hpp", text) if one.rule in mutant_rules.COARSE]
            self.assertEqual(any(one.switch for one in found), expected is not None, line)
            if expected:
                switched = mutant_rules.with_switches(text, list(enumerate(found, start=1)))
                self.assertEqual(switched, f"void f() {{ {expected} }}")

    def test_turns_constants_into_functions(self):
        text = "constexpr Time a = 40us;\nconstexpr Time b = 2 * a;\nTime f(X x) { return x.a + n::a; }\nusing n::a;"
        found = [one for one in mutant_rules.find("toy.cpp", text) if one.constant == "a"]
        switched = mutant_rules.as_functions(mutant_rules.with_switches(text, list(enumerate(found, start=1))), {"a"})
        declared = (
            "constexpr Time a() { return (chosen_mutant(1) ? Time(Time{}) : Time((chosen_mutant(2) ? "
            "Time(Time(40us) * 10) : Time(40us)))); }"
        )
        used = ["constexpr Time b = 2 * a();", "Time f(X x) { return x.a + n::a(); }", "using n::a;"]
        self.assertEqual(switched.splitlines(), [declared, *used])
        self.assertIsNone(mutant_rules.as_functions("constexpr Time a = 40us; void f(Time a);", {"a"}))

    def test_changes_only_its_place(self):
        for found in mutant_rules.find("toy.hpp", TOY):
            broken = found.applied_to(TOY)
            self.assertNotEqual(broken, TOY)
            self.assertEqual(TOY[found.start : found.end], found.before)
            self.assertEqual(broken[: found.start], TOY[: found.start])
            self.assertEqual(broken[found.start + len(found.after) :], TOY[found.end :])


class MutantIds(unittest.TestCase):
    @staticmethod
    def ids(text):
        return [found.id for found in mutant_rules.find("toy.hpp", text)]

    def test_are_unique(self):
        twice = TOY + TOY
        self.assertEqual(len(set(self.ids(twice))), len(self.ids(twice)))

    def test_stay_when_lines_move_or_comments_change(self):
        moved = TOY.replace("40us;", "40us;  ///< paragraph 10").replace("\n\nbool", "\n\n\nbool")
        moved = "// new\n\nint before;\n" + moved
        self.assertEqual(sorted(self.ids(moved)), sorted(self.ids(TOY)))
        indented = TOY.replace("  if (at < free_at_)", "      if (at < free_at_)")
        self.assertEqual(self.ids(indented), self.ids(TOY))
        other = moved.replace("paragraph 10", "shortest").replace("// new", "/* newer */")
        self.assertEqual(sorted(self.ids(other)), sorted(self.ids(TOY)))

    def test_stay_when_a_comment_is_inside_the_changed_code(self):
        first = self.ids("Time limit(Line line) {\n  return line.pause() +\n      9 * line.bit();\n}")
        commented = self.ids("Time limit(Line line) {\n  return line.pause() +  // why\n      9 * line.bit();\n}")
        self.assertTrue(first)
        self.assertEqual(commented, first)

    def test_change_with_their_line(self):
        other = self.ids(TOY.replace("40us", "50us"))
        gone = set(self.ids(TOY)) - set(other)
        self.assertEqual({name.split(":")[1] for name in gone}, {"half", "twice"})


class Script(unittest.TestCase):
    def test_finds_enough_mutants_in_units(self):
        coarse = [
            found.id
            for folder in mutants.unit_folders().values()
            for found, _, _ in mutants.find_mutants(folder)
            if found.rule in mutant_rules.COARSE
        ]
        self.assertGreaterEqual(len(coarse), 300)
        self.assertEqual(len(set(coarse)), len(coarse))
        self.assertFalse([name for name in coarse if "_test." in name or "vectors" in name or "fields" in name])

    def test_listed_survivors_are_mutants(self):
        # A changed line gives its mutants other ids: those listed here must then be tried again.
        found = {found.id for folder in mutants.unit_folders().values() for found, _, _ in mutants.find_mutants(folder)}
        known = mutants.read_survivors(SOURCE / "tests" / "mutants_survivors.txt")
        self.assertEqual([name for name in known if name not in found], [])

    def test_distinguishes_failure_from_hang(self):
        with tempfile.TemporaryDirectory() as folder:
            tree = mutants.Tree(Path(folder))
            programs = tree.build / "tests"
            programs.mkdir(parents=True)
            for name, text in (("good", "exit 0"), ("bad", "exit 1"), ("endless", "while :; do :; done")):
                (programs / name).write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
                (programs / name).chmod(0o755)
            self.assertEqual(tree.run(mutants.Program("good", True), 5)[0], 0)
            self.assertEqual(tree.run(mutants.Program("bad", True), 5)[0], 1)
            self.assertIn(tree.run(mutants.Program("endless", True), 1)[0], mutants.HANGS)

    def test_survivors_need_reasons(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "survivors.txt"
            path.write_text("# a comment\n\ntoy.cpp:edge:12345678 the same at the edge\n", encoding="utf-8")
            self.assertEqual(mutants.read_survivors(path), {"toy.cpp:edge:12345678": "the same at the edge"})
            path.write_text("toy.cpp:edge:12345678\n", encoding="utf-8")
            with self.assertRaises(SystemExit):
                mutants.read_survivors(path)

    def test_shows_lines_before_and_after(self):
        path = mutants.ROOT / "absenc" / "toy.hpp"
        found = next(one for one in mutant_rules.find("toy.hpp", TOY) if one.rule == "half")
        lines = ["  - constexpr Time pause = 40us;", "  + constexpr Time pause = Time(40us) / 2;"]
        self.assertEqual(mutants.shown(found, path, TOY).splitlines(), [f"absenc/toy.hpp:3  {found.id}", *lines])


if __name__ == "__main__":
    unittest.main()
