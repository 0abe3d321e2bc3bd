#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes a page of the guide as a man page of section 7: guide_page.py VERSION PAGE.md OUTPUT.7"""
import re
import sys
from pathlib import Path

NARROWEST = 70  # number of columns that a terminal of 80 columns leaves for the text of a page
GITHUB_COMMENT = re.compile(r"<!--.*?-->\n?", re.DOTALL)


def escaped(text):
    """Returns `text` escaped for roff, in ASCII."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq").replace("`", "\\(ga").replace("^", "\\(ha").replace("~", "\\(ti")
    return "".join(one if ord(one) < 128 else f"\\[u{ord(one):04X}]" for one in text)


def line_of(text):
    """Returns `text` as a line of output that does not begin like a roff request."""
    return "\\&" + text if text.startswith(".") else text


def target_of(address, page):
    """Returns the target to show after a link; "" for a part of the same page."""
    path, _, _ = address.partition("#")
    if re.match(r"https?:", address):
        return address
    if not path:
        return ""
    if re.fullmatch(r"[\w-]+\.md", path):
        return f"absenc-{path.removesuffix('.md')}(7)"
    return str((Path("docs") / path).as_posix()).replace("docs/../", "")


def inline(text, page):
    """Returns inline Markdown as roff."""
    parts = re.split(r"(`[^`]+`|\*\*[^*]+\*\*|\*[^*\s][^*]*\*|!?\[[^\]]*\]\([^)]+\))", text)
    out = ""
    for part in parts:
        if len(part) > 2 and part.startswith("`"):
            out += f"\\fB{escaped(part[1:-1])}\\fR"
        elif part.startswith("**"):
            out += f"\\fB{escaped(part[2:-2])}\\fR"
        elif len(part) > 2 and part.startswith("*"):
            out += f"\\fI{escaped(part[1:-1])}\\fR"
        elif link := re.fullmatch(r"(!?)\[([^\]]*)\]\(([^)]+)\)", part):
            shown, target = inline(link[2], page), target_of(link[3], page)
            out += shown if not target or link[2].strip("`") in (link[3], Path(link[3]).name) else f"{shown} ({escaped(target)})"
        else:
            out += escaped(part)
    return out


def breakable(text, length):
    """Returns `text` in which words of at least `length` characters can be broken."""
    return re.sub(rf"\S{{{length},}}", lambda word: broken(word[0]), text)


def broken(word):
    out, before = "", ""
    for token in re.findall(r"\\f.|\\\(..|\\\[[^]]*\]|\\.|.", word):
        if not token.startswith("\\f"):
            if before and (before in "/:=?&_,.(\\-" or (before.islower() and token.isupper()) or token == "("):
                out += "\\:"
            before = token
        out += token
    return out


def longest_word(text):
    return max((len(word) for word in re.split(r"[\s/:=?&_,.()-]", text)), default=0)


def paragraphs(head, body, page):
    """Returns a table that is too wide for a terminal as paragraphs, one for each row."""
    out = []
    for row in body:
        rest = "; ".join(f"{inline(name, page)}: {inline(cell, page)}" for name, cell in zip(head[1:], row[1:]) if cell)
        out += [".TP", line_of(inline(row[0], page) or "\\&"), line_of(rest or "\\&")]
    return out


def table(lines, page):
    """Returns a Markdown table, whose first line is its head, as a table of tbl, or as paragraphs if it is too wide."""
    rows = [[cell.strip().replace("\0", "|") for cell in line.strip().strip("|").replace("\\|", "\0").split("|")] for line in lines]
    head, body = rows[0], rows[2:]
    if sum(max(longest_word(row[i]) for row in [head, *body] if i < len(row)) + 4 for i in range(len(head))) > NARROWEST:
        return paragraphs(head, body, page)
    widest = [max(len(row[i]) if i < len(row) else 0 for row in rows) for i in range(len(head))]
    columns = " ".join("lx" if width > 30 else "l" for width in widest)
    text = ["", ".TS", "allbox;", " ".join(["lb"] * len(head)), columns + "."] if any(head) else ["", ".TS", "allbox;", columns + "."]
    for row in ([head] if any(head) else []) + body:
        for i, cell in enumerate(row):
            text.append(("T{\n.na\n" + line_of(breakable(inline(cell, page), 10)) + "\nT}") if cell else "\\&")
            if i + 1 < len(row):
                text[-1] += "\t\0"
        text.append("\n")
    joined = "\n".join(text).replace("\t\0\n", "\t").replace("\n\n\n", "\n").replace("\n\n", "\n")
    return [*joined.strip("\n").split("\n"), ".TE", ".sp"]


def body_of(text, page):
    lines, out, i = text.split("\n"), [], 0
    while i < len(lines):
        line = lines[i]
        if fence := re.match(r"^(\s*)```", line):
            end = next(k for k in range(i + 1, len(lines)) if lines[k].startswith(fence[1] + "```"))
            out += [".PP", ".RS 4", ".nf", *(line_of(escaped(one[len(fence[1]):])) or "\\&" for one in lines[i + 1:end]), ".fi", ".RE"]
            i = end + 1
        elif heading := re.match(r"^(#+) (.*)$", line):
            level = len(heading[1])
            if level > 1:
                out.append((".SH " if level == 2 else ".SS ") + '"' + inline(heading[2], page).replace('"', "\\(dq") + '"')
            i += 1
        elif line.startswith("|"):
            end = next((k for k in range(i, len(lines)) if not lines[k].startswith("|")), len(lines))
            out += [".PP", *table(lines[i:end], page)]
            i = end
        elif item := re.match(r"^(\s*)(-|\d+\.) (.*)$", line):
            words = [item[3]]
            i += 1
            while i < len(lines) and lines[i].strip() and not re.match(r"^\s*((-|\d+\.) |```)", lines[i]):
                words.append(lines[i].strip())
                i += 1
            mark = "\\(bu" if item[2] == "-" else item[2]
            out += [f'.IP "{mark}" 4', line_of(breakable(inline(" ".join(words), page), 50))]
        elif not line.strip():
            i += 1
        else:
            words = []
            while i < len(lines) and lines[i].strip() and not re.match(r"^(#+ |\||\s*```|\s*(-|\d+\.) )", lines[i]):
                words.append(lines[i].strip())
                i += 1
            if not words:  # the line only looks like a mark of Markdown, so it is taken as text
                words, i = [line], i + 1
            joined = " ".join(words)
            # a paragraph of only pictures is left out, because a terminal cannot show them
            if not re.fullmatch(r"(!\[[^\]]*\]\([^)]+\)\s*)+", joined):
                out += [".PP", line_of(breakable(inline(joined, page), 50))]
    return out


def main(version, source, output):
    page = Path(source)
    text = GITHUB_COMMENT.sub("", page.read_text(encoding="utf-8"))
    title = re.match(r"^# (.*)$", text, re.MULTILINE)[1]
    name = f"absenc-{page.stem}"
    lines = ["'\\\" t", f'.TH "{escaped(name.upper())}" "7" "" "absenc {version}" "Guide of absenc"', ".SH NAME",
             f"{escaped(name)} \\- {inline(title, page)}", ".ad l", ".nh", ".SH DESCRIPTION" if not re.search(r"^# .*\n+## ", text) else "",
             *body_of(text, page), ".SH SEE ALSO", "\\fBabsenc\\fR(1)"]
    Path(output).write_text("\n".join(line for line in lines if line) + "\n", encoding="ascii")


if __name__ == "__main__":
    main(*sys.argv[1:])
