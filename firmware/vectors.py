# SPDX-License-Identifier: Apache-2.0
"""usage: vectors.py OUTPUT.cpp VECTORS.json...

Writes the vectors as tables for firmware/vectors.cpp."""
import json
import sys

# units whose reference vectors contain frames as text, not as bytes
TEXT_LINKS = {"biss", "biss-safety", "biss-chain", "ssi", "raa38-can"}
SAME_UNIT = {"biss-control": "biss", "biss-control-request": "biss"}


def option_text(value):
    return str(value).lower() if isinstance(value, bool) else str(value)


def options_of(vector):
    # the options of vectors with BiSS control frames are no options of the unit `biss`
    if vector["protocol"] in SAME_UNIT:
        return {}
    options = {name: value for name, value in vector["options"].items() if name != "configuration"}
    channels = options.pop("channels", None)
    if channels is not None:
        options["slaves"] = len(channels)
        for index, channel in enumerate(channels):
            options |= {f"channel{index}_{name}": value for name, value in channel.items()}
    return options


def fields_of(vector):
    fields = {}
    for name, value in vector.get("fields", {}).items():
        if isinstance(value, dict):
            fields |= {f"{name}_{inner}": one for inner, one in value.items()}
        elif name == "channels":
            for index, channel in enumerate(value):
                fields |= {f"channel{index}_{inner}": one for inner, one in channel.items()}
        elif name == "data" and isinstance(value, list):
            fields[name] = bytes(value).hex()
        elif isinstance(value, list) and vector["protocol"] in SAME_UNIT:
            fields[name] = " ".join(map(str, value))
        else:
            fields[name] = value
    return fields


def frames_of(vector):
    if "cdm" in vector:
        return vector["cdm"].encode(), vector.get("cds", "").encode()
    frames = vector["request"], vector["response"]
    if vector["protocol"] in TEXT_LINKS:
        return tuple(frame.encode() for frame in frames)
    return tuple(bytes.fromhex(frame) for frame in frames)


def quoted(text):
    return json.dumps(text)


def wanted(name, value):
    if isinstance(value, list):
        kind, number, text = "names", 0, " ".join(value)
    elif isinstance(value, str):
        kind, number, text = "text", 0, value
    else:
        kind, number, text = ("real" if isinstance(value, float) else "number"), value, ""
    whole = 0 if isinstance(number, float) else int(number)
    return f"{{ExpectedField::Kind::{kind}, {quoted(name)}, {whole}, {float(number)!r}, {quoted(text)}}}"


def table(kind, name, rows):
    return f"constexpr std::array<{kind}, {len(rows)}> {name}{{{{{', '.join(rows)}}}}};\n" if rows else ""


def main():
    output, *sources = sys.argv[1:]
    tables, rows = [], []
    for source in sources:
        with open(source, encoding="utf-8") as file:
            vectors = json.load(file)["vectors"]
        for vector in vectors:
            number = len(rows)
            frames = frames_of(vector)
            for part, frame in zip(("request", "reply"), frames):
                tables.append(table("std::uint8_t", f"{part}{number}", [str(byte) for byte in frame]))
            fields = fields_of(vector)
            tables.append(table("ExpectedField", f"fields{number}", [wanted(*field) for field in fields.items()]))
            request, reply = (f"{part}{number}" if frame else "{}" for part, frame in zip(("request", "reply"), frames))
            settings = " ".join(f"{name}={option_text(value)}" for name, value in options_of(vector).items())
            unit = SAME_UNIT.get(vector["protocol"], vector["protocol"])
            rows.append(f"    {{{quoted(unit)}, {quoted(vector['id'])}, {quoted(settings)}, {request}, {reply}, "
                        f"{f'fields{number}' if fields else '{}'}, Error::{vector.get('error', 'none')}}},\n")
    with open(output, "w", encoding="utf-8") as file:
        file.write('#include "firmware/vectors.hpp"\n\n#include <array>\n\nnamespace absenc::firmware {\nnamespace {\n')
        file.writelines(tables)
        file.write(f"constexpr std::array<ReferenceVector, {len(rows)}> vectors{{{{\n{''.join(rows)}}}}};\n}}\n")
        file.write("std::span<const ReferenceVector> reference_vectors() { return vectors; }\n}\n")


if __name__ == "__main__":
    main()
