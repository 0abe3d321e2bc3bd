#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The sources of a folder are compiled as one file: names of local functions must differ."""

import re
import unittest
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NO_SOURCE = re.compile(r"_(test|fuzz|bench)\.cpp$|/main\.cpp$")
ANONYMOUS = re.compile(r"^namespace \{\n(.*?)^\}  // namespace\n", re.DOTALL | re.MULTILINE)
FUNCTION = re.compile(
    r"^(?!return|if|for|while|else|using|struct|class|enum|namespace|template|#|//|\}|\s)[\w:<>,&*\[\] ]+?[ &*>](\w+)\(",
    re.MULTILINE,
)


def own_functions(text):
    return {name for body in ANONYMOUS.findall(text) for name in FUNCTION.findall(body)}


def shared_names():
    """Returns a line for each name of a local function that two sources of a folder define."""
    found = []
    folders = defaultdict(list)
    for top in ("absenc", "python/src", "tools/absenc"):
        for path in sorted((ROOT / top).rglob("*.cpp")):
            if not NO_SOURCE.search(str(path)):
                folders[path.parent].append(path)
    for folder, paths in folders.items():
        places = defaultdict(list)
        for path in paths:
            for name in own_functions(path.read_text(encoding="utf-8")):
                places[name].append(path.name)
        found += [
            f"{folder.relative_to(ROOT)}: {name} in {', '.join(names)}"
            for name, names in sorted(places.items())
            if len(names) > 1
        ]
    return found


class CompiledTogether(unittest.TestCase):
    def test_local_functions_have_unique_names(self):
        self.assertEqual(shared_names(), [])

    def test_finds_functions(self):
        text = "namespace {\n\nint one(int a) {\n  call(a);\n}\nstd::optional<int> two() { return 0; }\n\n}  // namespace\n"
        self.assertEqual(own_functions(text + "void three() {}\n"), {"one", "two"})


if __name__ == "__main__":
    unittest.main()
