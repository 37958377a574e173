"""Values of a scene file as TOML text."""

import json
import math


def number(x):
    """A finite number, to nine digits, which tell every f32 from its neighbours."""
    x = float(x)
    if not math.isfinite(x):
        raise ValueError(f"a number of the scene is {x}; TOML files of tweenray have finite numbers alone")
    text = f"{x:.9g}"
    return "0" if text == "-0" else text


def value(x):
    """`x` as TOML: a truth value, number, text, list, or dict (an inline table)."""
    if isinstance(x, bool):
        return "true" if x else "false"
    if isinstance(x, int):
        return str(x)
    if isinstance(x, float):
        return number(x)
    if isinstance(x, str):
        return json.dumps(x, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(x, dict):
        return "{ " + ", ".join(f"{key(k)} = {value(v)}" for k, v in x.items()) + " }"
    return "[" + ", ".join(value(item) for item in x) + "]"


def key(name):
    """A key, in quotes where it must be."""
    bare = name and all(c.isascii() and (c.isalnum() or c in "-_") for c in name)
    return name if bare else json.dumps(name, ensure_ascii=False)


def table(heading, entries):
    """A table with its heading, such as `[camera]`."""
    return "\n".join([heading] + [f"{key(k)} = {value(v)}" for k, v in entries.items()]) + "\n"
